"""What every kind of model in the family does: in a free run, beside a bad input, in its file, and out of range."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from identification.blackbox import Base, Layers, Structure, identify, regressors, write_identified
from identification.blackbox.scaling import MARGIN
from identification.errors import SimulationError
from identification.inverse import INVERSE, Inverse, Limits, Wanted, identify_inverse, write_inverse
from identification.inverse.recipe import inverse_regressors
from identification.models import SimulationModel, load_model, motion_of
from identification.models.modelfile import KINDS as FILE_KINDS
from identification.models.motion import Motion
from identification.models.simulation import outside_training, simulate_run
from identification.physical.model import Model, element
from identification.physical.modelfile import model_to_json, write_model
from rigctl.runfile import Run, with_channel
from tests.identification.hysteretic import hysteretic

Floats = NDArray[np.float64]

PHYSICAL = Model(
    name="physical",
    elements=(
        element("viscous_damping", {"c": 300.0, "c_control": 100.0}),
        element("tanh_hysteresis", {"alpha": 60.0, "alpha_control": 80.0, "beta": 20.0, "delta": 0.2}),
    ),
)
BASE = Base(PHYSICAL, model_to_json(PHYSICAL))
LEARNED = ("nnoe", "narx", "mlp", "arx", "polynomial", "layered", "hybrid")
EVERY = ("physical", *LEARNED, "inverse")
SETTLED = 60  # samples beside the memory: the predictions that continue a motion backwards, and the longest delays
BAD = st.one_of(
    st.sampled_from([math.nan, math.inf, -math.inf, 1e300, -1e300, 0.0]), st.floats(-1e6, 1e6, allow_nan=False)
)
SIGNALS = ("x", "v", "a", "i", "temperature")


@cache
def runs() -> tuple[Run, ...]:
    return tuple(hysteretic(seed, 900, current=True) for seed in (1, 2, 3))


@cache
def model(kind: str) -> Any:  # Any: an inverse is no model of a force
    """A small model of a kind, learned from two runs."""
    if kind == "physical":
        return PHYSICAL
    learned = runs()[:2]
    if kind == "inverse":
        return identify_inverse(learned, BASE, structures=[Structure(inverse_regressors("F0 F1 v0 v1"), 4)]).model
    text = {"mlp": "x0 v0 i0", "hybrid": "F1 v0 i0 M0", "polynomial": "F1 v0 i0", "narx": "F1 v0 v1 i0"}.get(
        kind, "F1 F2 v0 v1 i0"
    )
    chosen = [Structure(regressors(text), 0 if kind == "arx" else 4)]
    if kind == "layered":
        return identify("narx", learned, structures=chosen, layers=Layers((4, 3))).model
    return identify(kind, learned, structures=chosen, base=BASE if kind == "hybrid" else None).model


def answer(kind: str, motion: Motion) -> Floats:
    """The force, or of an inverse the current for a force that is wanted along the motion."""
    one = model(kind)
    if isinstance(one, Inverse):
        return one.current(Wanted(name="wanted", motion=motion, force=runs()[2].channels["force"][: motion.x.size]))
    return np.asarray(one.force(motion))


def memory(kind: str) -> int:
    """Samples after which it has forgotten its start."""
    one = model(kind)
    facts = {} if kind in ("physical", "inverse") else one.facts
    seconds = facts.get("memory_s", 0.2)
    assert math.isfinite(seconds), f"{kind} never forgets"
    return int(200.0 * 2.0 * seconds) + SETTLED


@cache
def clean(kind: str) -> Floats:
    return answer(kind, whole())


@cache
def whole() -> Motion:
    return motion_of(runs()[2]).head(700)


def with_series(motion: Motion, signal: str, change: Callable[[Floats], None]) -> Motion:
    series = getattr(motion, signal).copy()
    change(series)
    given_: dict[str, Any] = {signal: series}  # Any: dataclasses.replace is not typed by field
    return replace(motion, **given_)


def test_every_kind_of_the_family_is_tested_here() -> None:
    assert {*EVERY, "fmu"} == {kind.name for kind in (*FILE_KINDS, INVERSE)}  # an FMU is a program of its own


@pytest.mark.parametrize("kind", [*LEARNED, "inverse"])
@settings(max_examples=25, deadline=None)
@given(at=st.integers(0, 300), length=st.integers(1, 60), bad=BAD, signal=st.sampled_from(SIGNALS))
def test_a_bad_input_for_a_moment_neither_diverges_nor_lasts(
    kind: str, at: int, length: int, bad: float, signal: str
) -> None:
    def hit(series: Floats) -> None:
        series[at : at + length] = bad

    found = answer(kind, with_series(whole(), signal, hit))
    assert np.all(np.isfinite(found))
    low, high = edges(kind)
    assert low <= found.min()
    assert found.max() <= high
    after = at + length + memory(kind)
    np.testing.assert_allclose(found[after:], clean(kind)[after:], atol=0.03 * np.std(clean(kind)))


def edges(kind: str) -> tuple[float, float]:
    """Between which its answer lies whatever its input; a hybrid far outside is its base."""
    one = model(kind)
    if isinstance(one, Inverse):
        return one.limits.low, one.limits.high
    if kind == "hybrid":
        return -np.inf, np.inf
    force = one.scales["force"]
    margin = MARGIN * (force.high - force.low) + 1e-9
    return force.low - margin, force.high + margin


@pytest.mark.parametrize("kind", [*(one for one in LEARNED if one != "hybrid"), "inverse"])
@settings(max_examples=15, deadline=None)
@given(values=st.lists(BAD, min_size=60, max_size=60), signal=st.sampled_from(SIGNALS), length=st.integers(1, 11))
def test_the_answer_is_finite_and_bounded_whatever_the_input(
    kind: str, values: list[float], signal: str, length: int
) -> None:
    def hit(series: Floats) -> None:
        series[:] = np.resize(np.repeat(values, length), series.size)

    found = answer(kind, with_series(whole().head(300), signal, hit))
    low, high = edges(kind)
    assert np.all(np.isfinite(found))
    assert low <= found.min()
    assert found.max() <= high


@settings(max_examples=25, deadline=None)
@given(at=st.integers(0, 300), length=st.integers(1, 60), bad=BAD, signal=st.sampled_from(("v", "i")))
def test_a_physical_model_recovers_from_a_spike_and_names_what_is_no_number(
    at: int, length: int, bad: float, signal: str
) -> None:
    def hit(series: Floats) -> None:
        series[at : at + length] = bad

    motion = with_series(whole(), signal, hit)
    if not math.isfinite(bad):
        with pytest.raises(SimulationError, match=rf"at sample {at} "):
            PHYSICAL.force(motion)
        motion = motion.held()
    found = PHYSICAL.force(motion)
    after = at + length + SETTLED
    assert np.all(np.isfinite(found))
    np.testing.assert_allclose(found[after:], clean("physical")[after:], rtol=1e-9)


@pytest.mark.parametrize("kind", EVERY)
@settings(max_examples=10, deadline=None)
@given(start=st.integers(1, 400))
def test_it_may_start_anywhere_and_then_does_what_it_did(kind: str, start: int) -> None:
    run = runs()[2]
    part = replace(run, channels={name: values[start:700] for name, values in run.channels.items()})
    if kind == "inverse":
        wanted = Wanted(name="part", motion=motion_of(part), force=part.channels["force"])
        found = model(kind).current(wanted)
    else:
        found = simulate_run(model(kind), part)
    late = memory(kind)
    assert np.all(np.isfinite(found))
    inner = slice(late, -40)  # a derivative at the end of a run knows nothing of what follows
    np.testing.assert_allclose(found[inner], clean(kind)[start:][inner], atol=0.05 * np.std(clean(kind)))


@pytest.mark.parametrize("kind", [one for one in EVERY if one != "inverse"])
def test_it_simulates_from_the_inputs_alone(kind: str) -> None:
    run = runs()[2]
    blind = with_channel(run, "force", np.zeros(run.samples), "N")
    assert np.array_equal(simulate_run(model(kind), blind), simulate_run(model(kind), run))


@pytest.mark.parametrize("kind", [*LEARNED, "inverse"])
def test_its_step_is_fixed_and_another_rate_is_refused_in_one_line(kind: str) -> None:
    other = replace(whole(), dt=0.5 * whole().dt)
    with pytest.raises(
        SimulationError, match="200 Hz and the run has 400 Hz: identify the model again with --rate 400"
    ):
        answer(kind, other)


@pytest.mark.parametrize("kind", EVERY)
def test_its_file_is_plain_json_and_gives_the_same_answer_to_the_last_bit(kind: str, tmp_path: Path) -> None:
    path, one = tmp_path / "model.json", model(kind)
    if kind == "physical":
        write_model(path, one)
    elif kind == "inverse":
        write_inverse(path, one)
    else:
        write_identified(path, one)
    assert json.loads(path.read_text())["kind"] == kind
    again: Any = load_model(path, kinds=(*FILE_KINDS, INVERSE))  # Any: an inverse is no model of a force
    if isinstance(again, Inverse):
        wanted = Wanted(name="wanted", motion=whole(), force=runs()[2].channels["force"][:700])
        assert np.array_equal(again.current(wanted), clean(kind))
        assert again.limits == Limits(one.limits.low, one.limits.high)
    else:
        assert np.array_equal(again.force(whole()), clean(kind))


@pytest.mark.parametrize("kind", LEARNED)
def test_a_run_beyond_its_training_is_flagged_with_where_and_how_far(kind: str) -> None:
    one: SimulationModel = model(kind)
    known = one.training_range
    assert known is not None
    assert all(share < 0.05 for share in known.left(motion_of(runs()[0])).values())  # its first and last samples
    far = with_channel(runs()[2], "current", 5.0 + runs()[2].channels["current"], "A")
    said = [text for text in outside_training(one, far) if ": current leaves the training range" in text]
    assert len(said) == 1
    assert "A in 100 % of the samples, first at 0 s, farthest at" in said[0]
