"""Hybrids: named parts, and a network for what they leave, which ends where its training ended."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.blackbox import Base, Hybrid, Identified, Structure, identify, regressors, write_identified
from identification.blackbox.hybrid import hybrid_to_json
from identification.blackbox.scaling import MARGIN
from identification.errors import DataError, ModelError
from identification.fitting import simple_base
from identification.models import compare, load_model, model_from_json, motion_of, score_signals, simulate_run
from identification.physical.model import Model, element
from identification.physical.modelfile import model_to_json
from rigctl.runfile import Run
from tests.identification.hysteretic import hysteretic

VISCOUS = Model(name="viscous", elements=(element("viscous_damping", {"c": 900.0}),))
BASE = Base(VISCOUS, model_to_json(VISCOUS))


@cache
def runs() -> tuple[Run, Run]:
    return hysteretic(1, 1500), hysteretic(2, 900)


@cache
def found() -> Identified:
    learned, shown = runs()
    structure = Structure(regressors("F1 F2 v0 v1 M0"), 4)
    return identify("hybrid", [learned], held_out=[shown], structures=[structure], base=BASE)


def model() -> Hybrid:
    hybrid = found().model
    assert isinstance(hybrid, Hybrid)
    return hybrid


def test_the_network_learns_what_the_base_leaves_and_the_share_of_the_base_is_stated() -> None:
    _, shown = runs()
    alone = score_signals(shown.channels["force"], simulate_run(VISCOUS, shown))
    (fit,) = found().shown.values()
    assert fit > 94.0 > 80.0 > alone.fit
    assert abs(fit - found().predicted) < 3.0
    assert model().facts["share_of_base"] == pytest.approx(1.0 - (alone.rrmsse / 100.0) ** 2, abs=0.05)
    base, rest = model().parts(motion_of(shown))
    assert np.allclose(base + rest, simulate_run(model(), shown))


@given(beyond=st.floats(1.0, 1e3), at=st.integers(0, 800), length=st.integers(1, 90))
@settings(max_examples=40, deadline=None)
def test_far_outside_the_training_only_the_base_remains(beyond: float, at: int, length: int) -> None:
    motion = motion_of(runs()[1])
    known = model().training_range
    assert known is not None
    low, high = known.limits["velocity"]
    v = motion.v.copy()
    v[at : at + length] = high + beyond * (MARGIN + 1e-6) * (high - low)
    fast = replace(motion, v=v)
    outside = slice(at, at + length)
    assert np.array_equal(model().force(fast)[outside], VISCOUS.force(fast)[outside])
    assert np.all(model().share(motion) >= 0.0)


def test_a_hybrid_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "hybrid.json"
    write_identified(path, model())
    again = load_model(path)
    assert isinstance(again, Hybrid)
    motion = motion_of(runs()[1])
    assert np.array_equal(again.force(motion), model().force(motion))
    assert list(again.names())[:2] == ["viscous_damping.c", "viscous_damping.c_control"]
    assert len(again.values()) == len(again.free()) == len(again.bounds()[0])


def test_a_broken_hybrid_is_refused_with_the_part() -> None:
    data = json.loads(json.dumps(hybrid_to_json(model())))
    with pytest.raises(ModelError, match="base: kind is 'hybrid': here a model of kind 'physical' is needed"):
        model_from_json(data | {"base": data})
    with pytest.raises(ModelError, match="rest: a model is an object, this is null"):
        model_from_json({key: value for key, value in data.items() if key != "rest"})
    with pytest.raises(ModelError, match="a regressor M needs the base of a hybrid"):
        model_from_json(data["rest"])


def test_a_hybrid_needs_a_base_and_no_other_kind_takes_one() -> None:
    for kind, base in (("hybrid", None), ("arx", BASE)):
        with pytest.raises(DataError, match="a hybrid, and no other kind, needs a base"):
            identify(kind, [runs()[0]], base=base)


def test_the_simple_base_is_a_model_with_names_that_explains_most_of_the_force() -> None:
    learned, shown = runs()
    base = simple_base([learned])
    assert base.has("tanh_hysteresis")
    comparison = compare([base, model()], [shown])
    assert comparison.best_first()[0].kind == "hybrid"
    assert (comparison.rows[0].fit or 0.0) > 70.0
