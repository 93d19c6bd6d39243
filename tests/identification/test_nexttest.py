"""The tests that a report proposes can be designed, whatever machine the runs were of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation.kinds import Kind
from excitation.plan import test_from_config as excitation_of
from identification.criteria import CHANCE
from identification.discrepancy import nexttest
from identification.discrepancy.naming import Compared, Search
from identification.discrepancy.nexttest import _design, _known, _models_to_tell_apart, _worth, library, propose
from identification.discrepancy.trials import trial_of
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model, element
from identification.physical.predict import predict
from identification.record import Record, record_to_come


@given(amplitude=st.floats(1e-4, 0.2), frequency=st.floats(0.1, 20.0))
def test_every_proposed_triangle_can_be_designed(amplitude: float, frequency: float) -> None:
    design = _design(Kind.TRIANGLE, 2000.0, amplitude, frequency, None)
    assert excitation_of(design).excitation.samples > 0


def record(rate: float, amplitude: float, cycles: float, level: float | None, swing: float) -> Record:
    """A sine of that many cycles in 2000 samples, with a current of that level and swing."""
    turn = 2.0 * np.pi * cycles * np.arange(2000) / 2000
    current = None if level is None else level + swing * np.sign(np.sin(turn))
    return record_to_come(amplitude * np.sin(turn), rate, current=current, period=0, settle=0, sigma=1.0, kind="sine")


LEVEL = st.one_of(st.none(), st.just(0.0), st.floats(0.01, 3.0), st.floats(-3.0, -0.01))


@settings(max_examples=60, deadline=None)
@given(
    rate=st.sampled_from([50.0, 200.0, 997.0, 1000.0, 5000.0]),
    amplitude=st.floats(1e-5, 0.5),
    cycles=st.floats(2.0, 80.0),
    level=LEVEL,
    share=st.sampled_from([0.0, 1e-3, 0.4]),
)
def test_every_test_of_the_library_can_be_designed_and_a_constant_current_gets_no_steps(
    rate: float, amplitude: float, cycles: float, level: float | None, share: float
) -> None:
    designs = library([record(rate, amplitude, cycles, level, share * abs(level or 0.0))])
    assert all(excitation_of(dict(d)).excitation.samples > 0 for d in designs)
    constant = level in (None, 0.0) or share < 0.01
    assert any(d["kind"] == Kind.STEPS for d in designs) is not constant
    assert len(designs) == (18 if constant else 37)


def commanded(current: np.ndarray[Any, np.dtype[np.float64]], noise: float) -> Record:
    """A sine of motion with a current as it is read."""
    read = record(500.0, 0.01, 8.0, 0.0, 0.0)
    scatter = noise * np.random.default_rng(2).standard_normal(current.size)
    return replace(read, motion=replace(read.motion, i=current + scatter), has_current=True)


def steps(*levels: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Current that stands at each of these levels for as long, 2000 samples."""
    return np.repeat(np.array(levels), 2000 // len(levels))


def levels_of(designs: list[Mapping[str, Any]]) -> set[float]:
    return {d["current"] for d in designs if "current" in d}


@pytest.mark.parametrize("noise", [0.0, 1e-4, 2e-3, 0.01])
def test_the_levels_of_a_proposed_current_are_those_that_were_commanded_whatever_the_noise(noise: float) -> None:
    designs = library([commanded(steps(0.5, 1.5), noise), commanded(steps(0.0, 1.0, 0.0, 0.6), noise)])
    low, high = sorted(levels_of(designs))
    assert low == pytest.approx(0.0, abs=0.1 * noise)
    assert high == pytest.approx(1.5, abs=0.1 * noise)
    [stepped] = [d for d in designs if d["kind"] == Kind.STEPS]
    assert stepped["levels"] == pytest.approx([low, low + 2 * (high - low) / 3, low + (high - low) / 3, high], abs=1e-3)


def test_the_levels_of_a_proposed_current_are_within_those_of_the_runs() -> None:
    turn = 2.0 * np.pi * 4.0 * np.arange(2000) / 2000
    low, high = sorted(levels_of(library([commanded(0.8 + 0.5 * np.sin(turn), 2e-3)])))
    assert 0.3 <= low < 0.33
    assert 1.27 < high <= 1.3


def test_a_current_that_only_noise_tells_from_none_gets_one_level() -> None:
    wander = 1e-3 * np.sin(2.0 * np.pi * np.arange(2000) / 2000)
    assert levels_of(library([commanded(wander, 2e-3)])) <= {0.0, -0.0}


YIELDS = element("tanh_hysteresis", {"alpha": 60.0, "alpha_control": 500.0, "beta": 40.0, "delta": 0.0})
LAG, DEAD = element("control_lag", {"tau": 0.017, "fall": 0.017}), element("control_delay", {"tau": 0.017})


def stepped_runs() -> tuple[Model, list[Record]]:
    """Runs with a current in steps of a damper that follows it after a lag, and what is known of it without that."""
    base = Model(name="given", elements=(YIELDS, element("viscous_damping", {"c": 700.0})))
    levels = ((0.0, 1.5, 0.6, 1.0), (0.3, 1.5, 0.0, 1.0))
    runs = [replace(commanded(steps(*one), 2e-3), sigma=4.0) for one in levels]
    rng = np.random.default_rng(3)
    truth = base.with_element(LAG)
    forces = [predict(truth, r)[0] + 4.0 * rng.standard_normal(r.measured.size) for r in runs]
    return base, [replace(r, force=whole(r, f)) for r, f in zip(runs, forces, strict=True)]


def whole(record: Record, measured: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The force of a whole record of which the compared window is known."""
    force = record.force.copy()
    force[record.window] = measured
    return force


@pytest.fixture(scope="module")
def lag_or_dead_time() -> tuple[Search, list[Record]]:
    """A search that found a lag of the control and tried a dead time, whose fit has another build-up of the yield."""
    base, records = stepped_runs()
    start = fit_records(base, records)
    lag, dead = (fit_records(base.with_element(e), records) for e in (LAG, DEAD))
    values = dead.model.element("tanh_hysteresis").values()
    other = element("tanh_hysteresis", values | {"beta": 0.3 * values["beta"]})
    dead = replace(dead, model=dead.model.replacing("tanh_hysteresis", other))
    tried = tuple(trial_of(f, n, start, records, screened=1.0) for f, n in ((lag, LAG.name), (dead, DEAD.name)))
    compared = {LAG.name: Compared(without=start, start=start, beside=(), rivals=tried)}
    return Search(fit=lag, names=(LAG.name,), excess=tried[0].excess, given=base, compared=compared), records


def test_a_lag_of_the_control_is_told_from_its_dead_time_by_a_current_that_changes(
    lag_or_dead_time: tuple[Search, list[Record]], monkeypatch: pytest.MonkeyPatch
) -> None:
    found, records = lag_or_dead_time
    shortest = min(
        (d for d in library(records) if d["kind"] == Kind.SINE and d["current"] > 0), key=nexttest.seconds_of
    )
    [stepped] = [d for d in library(records) if d["kind"] == Kind.STEPS]
    monkeypatch.setattr(nexttest, "library", lambda _: [shortest, stepped])
    assert propose(found, LAG.name, records).design == stepped
    monkeypatch.setattr(nexttest, "library", lambda _: [shortest])
    nothing = propose(found, LAG.name, records)
    assert not nothing.design
    assert nothing.text.startswith("no test within the motion seen so far tells")


def test_a_test_in_which_neither_of_two_effects_acts_is_worth_nothing_whatever_else_differs_between_their_fits(
    lag_or_dead_time: tuple[Search, list[Record]],
) -> None:
    found, records = lag_or_dead_time
    pair = _models_to_tell_apart(found, LAG.name)
    assert pair is not None
    best, rival, _ = pair
    new = replace(record(500.0, 0.01, 8.0, 0.6, 0.0), sigma=4.0)
    worth = _worth(best, rival, _known(best, rival, records), new)
    assert worth is not None
    assert worth < CHANCE.near_floor
