"""Springs as machines have them: one that softens levels off, and one may act to one side from the middle on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.discrepancy import explain
from identification.discrepancy.choice import choose, is_mistaken
from identification.discrepancy.trials import trial_of
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Element, Model, element
from identification.record import Record, compact, record_from_run
from rigctl.runfile import Run
from tests.identification.ordinary import motion, recorded

Floats = NDArray[np.float64]

BASE = Model(
    name="a spring beside a dashpot",
    elements=(element("linear_stiffness", {"k": 6e4}), element("viscous_damping", {"c": 700.0})),
)
SATURATES: dict[str, Callable[[Floats], Floats]] = {
    "as an arctan": np.arctan,
    "as a tanh": np.tanh,
    "with the displacement": lambda y: y / (1.0 + np.abs(y)),
}


def runs_of(spring: Callable[[Floats], Floats]) -> list[Run]:
    runs = []
    for k, amplitude in enumerate((0.018, 0.012, 0.015, 0.010, 0.016)):
        _, x, v = motion(k, amplitude, seconds=6.0)
        runs.append(recorded("spring", k, x, spring(x) + 900.0 * v, noise=1.5))
    return runs


def records_of(spring: Callable[[Floats], Floats]) -> list[Record]:
    return [compact(record_from_run(r)) for r in runs_of(spring)]


@pytest.mark.parametrize(
    "law", [pytest.param(law, marks=[pytest.mark.slow] if k else []) for k, law in enumerate(SATURATES)]
)
def test_a_spring_that_softens_is_that_and_no_end_stop(law: str) -> None:
    runs = runs_of(lambda x: 700.0 * SATURATES[law](x / 0.010))
    found = explain(BASE, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["cubic_stiffness"]
    assert found.effects[0].parameters["k3"][0] < 0.0


def test_a_spring_that_acts_to_one_side_from_the_middle_on_is_a_stop_there() -> None:
    runs = runs_of(lambda x: 5e4 * x + 2e4 * np.maximum(x, 0.0))
    found = explain(BASE, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["end_stop"]
    stop = {name: value for name, (value, _, _) in found.effects[0].parameters.items()}
    assert stop["side"] == pytest.approx(1.0, abs=0.05)
    assert stop["z_max"] < 0.001
    assert (1.0 + stop["side"]) * stop["k"] == pytest.approx(2e4, rel=0.1)


STOPS = {
    "of both sides, from the middle": ({"k": 8e4, "z_max": 0.0, "k2": 2e6}, True),
    "of both sides": ({"k": 8e4, "z_max": 0.009, "k2": 2e6}, False),
    "of one side, from the middle": ({"k": 8e4, "z_max": 0.0, "side": 1.0}, False),
}


@pytest.mark.parametrize(("own", "is_spring"), STOPS.values(), ids=list(STOPS))
def test_a_stop_of_both_sides_that_acts_from_the_middle_on_is_a_spring(own: dict[str, float], is_spring: bool) -> None:
    assert refused(element("end_stop", own)) is is_spring


HYSTERESES = {"never yields": (0.05, 0.1, True), "yields": (5.0, 0.1, False), "turns over": (0.05, 1.5, False)}


@pytest.mark.parametrize(("beta", "delta", "is_linear"), HYSTERESES.values(), ids=list(HYSTERESES))
def test_a_hysteresis_that_never_yields_is_a_dashpot_and_a_spring(beta: float, delta: float, is_linear: bool) -> None:
    assert refused(element("tanh_hysteresis", {"alpha": 500.0, "beta": beta, "delta": delta, "z_r": 0.01})) is is_linear


def refused(own: Element) -> bool:
    """Whether an element, with its values as they are, is not what its name says; then it is never chosen."""
    records = records_of(lambda x: 6e4 * x)
    base = fit_records(BASE, records)
    fit = fit_records(base.model.with_element(own), records, max_iterations=0)
    trial = trial_of(fit, own.id, base, records, 0.5)
    assert not (is_mistaken(trial) and choose([trial]) is not None)
    return is_mistaken(trial)
