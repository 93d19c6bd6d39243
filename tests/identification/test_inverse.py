"""Inverse models: the current for a wanted force, learned and by inversion, and what cannot be made."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.blackbox import Base, Structure, identify, regressors
from identification.blackbox.model import BlackBox
from identification.blackbox.modelfile import blackbox_to_json
from identification.errors import DataError, ModelError, ModelFileError
from identification.inverse import (
    INVERSE,
    IdentifiedInverse,
    Inverse,
    Limits,
    Wanted,
    by_forward,
    identify_inverse,
    track,
    tracking_data,
    wanted_of,
    write_inverse,
)
from identification.inverse.modelfile import inverse_to_json
from identification.inverse.recipe import inverse_regressors
from identification.models import load_model
from identification.models.modelfile import KINDS
from identification.physical.model import Model, element
from rigctl.runfile import Run
from tests.identification.hysteretic import hysteretic
from tests.identification.motions import motion

LIMITS = Limits(0.0, 1.0)
CONTROLLED = Model(
    name="controlled",
    elements=(
        element("viscous_damping", {"c": 300.0, "c_control": 900.0}),
        element("tanh_hysteresis", {"alpha": 30.0, "alpha_control": 80.0, "beta": 20.0, "delta": 0.2}),
    ),
)
LAGGING = CONTROLLED.with_element(element("control_lag", {"tau": 0.01}))
ON_A_BUSH = CONTROLLED.with_element(element("series_compliance", {"k": 3e5, "c": 50.0}))


@cache
def runs() -> tuple[Run, ...]:
    return tuple(hysteretic(seed, 900, current=True) for seed in (1, 2, 3))


@cache
def forward() -> Base:
    model = identify("nnoe", runs()[:2], structures=[Structure(regressors("F1 F2 v0 v1 i0"), 8)]).model
    assert isinstance(model, BlackBox)
    return Base(model, blackbox_to_json(model))


@cache
def found() -> IdentifiedInverse:
    chosen = [Structure(inverse_regressors("F0 F1 F2 v0 v1 v2"), 8)]
    return identify_inverse(runs()[:2], forward(), held_out=runs()[2:], structures=chosen)


def wanted_by(model: Model, current: np.ndarray | float) -> Wanted:
    """A force that the model gives at a current."""
    asked = Wanted(name="asked", motion=motion(), force=np.zeros(motion().x.size))
    return replace(asked, force=model.force(asked.driven(current)))


@given(low=st.floats(0.0, 0.9), rise=st.floats(0.02, 0.5), hz=st.floats(0.1, 5.0))
@settings(max_examples=15, deadline=None)
def test_what_a_model_gave_at_a_current_is_made_again_within_the_limits(low: float, rise: float, hz: float) -> None:
    current = np.clip(low + rise * np.sin(2 * np.pi * hz * motion().t) ** 2, 0.0, 1.0)
    asked = wanted_by(CONTROLLED, current)
    tracked = track(CONTROLLED, asked, LIMITS)
    assert tracked.fit > 99.0
    assert not tracked.cannot.any()
    assert tracked.current.min() >= LIMITS.low
    assert tracked.current.max() <= LIMITS.high


@pytest.mark.parametrize("model", [LAGGING, ON_A_BUSH], ids=["lag", "bush"])
def test_a_model_with_memory_of_the_current_is_tracked_too(model: Model) -> None:
    asked = wanted_by(model, 0.5 + 0.4 * np.sin(2 * np.pi * 1.3 * motion().t))
    assert track(model, asked, LIMITS).fit > 97.0


def test_the_current_of_a_sample_does_not_depend_on_what_comes_later() -> None:
    asked = wanted_by(LAGGING, 0.5)
    late = replace(asked, force=np.where(motion().t > 1.0, 0.5 * asked.force, asked.force))
    one, other = (by_forward(LAGGING, w, LIMITS) for w in (asked, late))
    before = motion().t < 0.9
    assert np.std((one - other)[before]) < 0.05


def test_a_force_that_cannot_be_made_is_named_with_how_often_and_by_how_much() -> None:
    asked = wanted_by(CONTROLLED, 1.0)
    tracked = track(CONTROLLED, replace(asked, force=1.3 * asked.force), LIMITS)
    assert 0.3 < tracked.share_cannot < 1.0
    sentence = tracked.described(asked.motion.dt)
    assert "cannot be made in" in sentence
    assert f"{np.abs(tracked.lack[tracked.cannot]).max():.3g} N" in sentence
    assert tracked.fit < 90.0


def test_a_force_of_which_nothing_can_be_made_is_refused() -> None:
    asked = wanted_by(CONTROLLED, 0.5)
    with pytest.raises(DataError, match=r"no sample of the wanted force can be made within \[0, 1\] A: .* lacking"):
        track(CONTROLLED, replace(asked, force=asked.force + 1e5), LIMITS)


def test_limits_far_beyond_the_training_cost_no_exactness_and_what_leaves_it_is_told() -> None:
    model = forward().model
    asked = wanted_of(runs()[2], model)
    near = track(model, asked)
    far = track(model, asked, Limits(-5.0, 50.0))
    assert far.fit > near.fit - 1.0
    assert not any("current leaves the training range" in one for one in near.beyond)
    (sentence,) = [one for one in far.beyond if "current leaves the training range" in one]
    assert sentence.startswith(f"{asked.name}: ")
    assert far.current.min() > -1.0  # half of the trained span beyond, where the network sees its edge
    assert far.current.max() < 2.0
    assert tracking_data(far)["outside_training"] == list(far.beyond)


def test_limits_that_lie_wholly_beyond_what_a_network_tells_apart_are_refused() -> None:
    model = forward().model
    with pytest.raises(DataError, match="the current hardly changes the force"):
        track(model, wanted_of(runs()[2], model), Limits(20.0, 50.0))


def test_a_model_without_a_current_cannot_be_inverted() -> None:
    passive = Model(name="passive", elements=(element("viscous_damping", {"c": 300.0}),))
    with pytest.raises(DataError, match="'passive' has no current among its inputs"):
        track(passive, wanted_by(CONTROLLED, 0.5), LIMITS)
    with pytest.raises(DataError, match="'passive' has no current among its inputs"):
        identify_inverse(runs(), Base(passive, {}))
    with pytest.raises(DataError, match="'controlled' states no range of the current"):
        track(CONTROLLED, wanted_by(CONTROLLED, 0.5))


def test_limits_are_two_numbers_the_lower_first() -> None:
    with pytest.raises(ModelError, match=r"limits of the current are \[1, 0\] A"):
        Limits(1.0, 0.0)


def test_a_network_is_inverted_from_sample_to_sample() -> None:
    asked = wanted_of(runs()[2], forward().model)
    tracked = track(forward().model, asked)
    assert tracked.fit_where_it_can > 94.0
    assert tracked.limits == Limits(*forward().model.training_range.limits["current"])  # type: ignore[union-attr]
    own = runs()[2].channels["current"]
    assert np.std(tracked.current - own) < 0.6 * np.std(own)


def test_a_learned_inverse_tracks_a_force_that_it_has_not_seen() -> None:
    (tracked,), (inverted,) = found().learned.values(), found().inverted.values()
    assert tracked.fit > 88.0
    assert inverted.fit > 92.0
    assert found().model.facts["fit_tracked_held_out"] == pytest.approx(tracked.fit)


def test_an_inverse_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "inverse.json"
    write_inverse(path, found().model)
    data = json.loads(path.read_text())
    assert data["network"]["members"][0]["regressors"] == ["v0", "v1", "v2", "F0", "F1", "F2"]
    assert set(data["network"]["signals"]) == {"force", "velocity", "current"}
    again: Any = load_model(path, kinds=(*KINDS, INVERSE))  # Any: an inverse is no model of a force
    assert isinstance(again, Inverse)
    asked = wanted_of(runs()[2], again.forward)
    assert np.array_equal(again.current(asked), found().model.current(asked))
    with pytest.raises(ModelFileError, match="it gives a current for a wanted force, see damper-rig track"):
        load_model(path)


def test_a_fact_that_is_no_number_leaves_a_file_that_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "inverse.json"
    write_inverse(path, replace(found().model, facts={"fit_tracked_held_out": -math.inf, "other": 1.0}))
    again: Any = load_model(path, kinds=(*KINDS, INVERSE))  # Any: an inverse is no model of a force
    assert again.facts == {"other": 1.0}


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"limits": [1.0]}, "limits must be a list of two currents"),
        ({"limits": [0.0, "1"]}, r"limits\[1\] is '1'"),
        ({"network": {}}, "network: format is None"),
        ({"forward": None}, "forward: forward is missing"),
        ({"forward": {"format": "damper-rig/model", "format_version": 1, "kind": "spline"}}, "forward: kind is"),
    ],
)
def test_a_broken_file_is_refused_with_the_place(more: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(inverse_to_json(found().model) | more))
    with pytest.raises(ModelFileError, match=message):
        load_model(path, kinds=(*KINDS, INVERSE))


def test_runs_from_which_no_inverse_can_be_learned_are_refused() -> None:
    one_current = [replace(run, channels={**run.channels, "current": np.full(900, 0.5)}) for run in runs()]
    with pytest.raises(DataError, match=r"current is 0\.5 A in all runs"):
        identify_inverse(one_current, forward())
    with pytest.raises(DataError, match="hysteretic-4 has no control current: an inverse is learned from it"):
        identify_inverse([*runs(), hysteretic(4, 900)], forward())
    with pytest.raises(DataError, match="no channel 'pressure': the wanted force"):
        wanted_of(runs()[0], forward().model, "pressure")
