"""What the steps of the solver leave is no effect that the model lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.criteria import FORM
from identification.discrepancy import Verdict, explain
from identification.discrepancy.excess import solver_error
from identification.models.motion import Motion
from identification.physical.accuracy import numerical_error, simulate_within
from identification.physical.model import Model, element
from identification.physical.simulate import simulate
from identification.record import compact, record_from_run
from rigctl.runfile import Run
from tests.identification.ordinary import recorded

RATE = 100.0
SIZES = (0.01, 0.02, 0.03, 0.015, 0.025)


def joint(gap: float, stiffness: float, damping: float) -> Model:
    """A dashpot with friction behind a bush in a worn joint, which meets hard between two samples."""
    return Model(
        name="a joint",
        elements=(
            element("free_play", {"gap": gap}),
            element("series_compliance", {"k": stiffness, "c": 50.0}),
            element("viscous_damping", {"c": damping}),
            element("coulomb_friction", {"f_c": 20.0}),
        ),
    )


def moved(k: int, size: float) -> Motion:
    rng, t = np.random.default_rng([3, k]), np.arange(1500) / RATE
    x, v, a = np.zeros((3, t.size))
    for share, hz in ((0.7, 0.8 + rng.uniform(0.0, 0.4)), (0.3, 3.0 + rng.uniform(0.0, 1.5))):
        turn, phase = 2.0 * np.pi * hz, rng.uniform(0.0, 6.0)
        x = x + size * share * np.sin(turn * t + phase)
        v = v + size * share * turn * np.cos(turn * t + phase)
        a = a - size * share * turn**2 * np.sin(turn * t + phase)
    return Motion(dt=1.0 / RATE, x=x, v=v, a=a, i=np.zeros(t.size), temperature=np.full(t.size, 25.0), t=t)


def run(k: int, size: float, model: Model) -> Run:
    motion = moved(k, size)
    return recorded("joint", k, motion.x, simulate_within(model, motion, 1e-4).force, noise=0.3, rate=RATE)


@pytest.mark.parametrize("values", [(1e-3, 2e5, 800.0), pytest.param((5e-4, 6e5, 1500.0), marks=pytest.mark.slow)])
def test_of_a_model_that_is_the_machine_nothing_is_missing_though_samples_are_coarse(
    values: tuple[float, float, float],
) -> None:
    model = joint(*values)
    assert numerical_error(model, moved(0, SIZES[0])).rms > 0.6  # twice the noise
    runs = [run(k, size, model) for k, size in enumerate(SIZES)]
    found = explain(model, runs[:4], runs[4:])
    assert found.verdict == Verdict.NO_DISCREPANCY
    assert "one step of the solver a sample" in found.remainder
    assert any("numerical error" in note for note in found.notes)


@pytest.mark.parametrize("period", [0, 500])
@pytest.mark.parametrize("path", ["control_lag", "control_delay"])
def test_a_current_that_steps_is_held_between_samples_and_no_error_of_the_solver(path: str, period: int) -> None:
    """Half way it was the mean of both: a lag of 30 ms had an error of a percent of its force that is not there."""
    model = Model(
        name="a coil",
        elements=(element(path, {"tau": 0.03}), element("viscous_damping", {"c": 800.0, "c_control": 1500.0})),
    )
    steps = np.array([0.0, 1.2, 0.4, 2.0, 0.8])[np.arange(1500) // 100 % 5]
    motion = replace(moved(0, 0.02), i=steps, period=period)
    if period:
        x, v, a = (np.resize(s[:period], s.size) for s in (motion.x, motion.v, motion.a))
        motion = replace(motion, x=x, v=v, a=a)
    between = replace(motion, i=np.full(1500, 1.0))
    assert numerical_error(model, motion).relative < 1e-6 + 2.0 * numerical_error(model, between).relative


def test_a_drift_along_the_mean_of_periods_is_no_error_of_the_solver() -> None:
    """The times of a mean period are later than the steps of its clock say: a drift between them was taken for one."""
    turn = 2.0 * np.pi * np.arange(400) / 400
    x = np.tile(0.02 * np.sin(turn) + 0.004 * np.sin(3 * turn), 12)
    force = 800.0 * np.gradient(x) * RATE + 2.0 * np.arange(x.size) / RATE
    record = record_from_run(replace(recorded("drift", 0, x, force, noise=0.1, rate=RATE), period_samples=400))
    model = Model(
        name="a load cell that drifts",
        elements=(element("viscous_damping", {"c": 800.0, "c_control": 0.0}), element("force_drift", {"rate": 2.0})),
    )
    assert record.period == 400
    assert numerical_error(model, compact(record).motion).relative < 1e-6
    assert solver_error(model, [compact(record)]) < 1e-3


def test_the_steps_excuse_no_more_than_the_tolerance_of_form() -> None:
    """Of a model that one step a sample carries far from its own answer nobody can say that it meets the data."""
    model = joint(1e-3, 6e5, 1500.0)
    slow = recorded("slow", 0, moved(0, 0.01).x[::6], simulate(model, moved(0, 0.01)).force[::6], rate=RATE / 6.0)
    record = record_from_run(slow)
    error = numerical_error(model, record.motion).force[record.window]
    energy = record.measured.size * float(np.var(record.measured)) / record.sigma**2
    assert float(np.dot(error, error)) / record.sigma**2 > FORM.tolerance**2 * energy
    assert solver_error(model, [record]) == pytest.approx(FORM.tolerance**2 * energy)
