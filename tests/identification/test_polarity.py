"""Which signs are refused: a force upside down, and not one that is late."""

from __future__ import annotations

import numpy as np
import pytest

from identification.discrepancy import explain
from identification.discrepancy.checks import check_model
from identification.errors import DataError
from identification.physical.model import Model, element
from identification.record import Record, record_from_run
from rigctl.runfile import Run, with_channel
from tests.identification.ordinary import RATE, motion, recorded

DASHPOT = element("viscous_damping", {"c": 30.0, "c_control": 0.0}, ("c_control",))
SPRING = element("linear_stiffness", {"k": 4000.0})
MASS = element("moving_mass", {"m": 2.0})
OSCILLATOR = Model(name="oscillator", elements=(SPRING, DASHPOT, MASS))
BUSH = Model(name="bush", elements=(SPRING, DASHPOT))


def late_sensor(hz: float, seed: int) -> Run:
    """A driven oscillator of 7 Hz over one sine; its displacement passes a low-pass of 12 Hz."""
    turn = 2.0 * np.pi * hz
    t = np.arange(round(4.0 * RATE)) / RATE
    x, v = 0.01 * np.sin(turn * t), 0.01 * turn * np.cos(turn * t)
    seen = 0.01 * np.imag(np.exp(1j * turn * t) / (1.0 + 1j * hz / 12.0))
    return recorded("oscillator", seed, seen, 4000.0 * x + 30.0 * v - 2.0 * turn**2 * x, noise=0.1)


def bush(seed: int, sign: float) -> Run:
    _, x, v = motion(seed, 0.01)
    return recorded("bush", seed, x, sign * (4000.0 * x + 30.0 * v), noise=0.5)


def records(*runs: Run) -> list[Record]:
    return [record_from_run(r) for r in runs]


def test_a_late_sensor_beside_a_mass_is_no_reversed_sign() -> None:
    runs = records(late_sensor(6.9, 0), late_sensor(30.0, 1))
    work = [np.corrcoef(r.motion.v[r.window], r.measured)[0, 1] for r in runs]
    assert work[0] > 0.3
    assert work[1] < -0.3, "the case is one in which a run works with the motion"
    check_model(OSCILLATOR, runs)


@pytest.mark.parametrize("turned", [(0,), (1,), (0, 1)])
def test_a_spring_that_is_upside_down_is_refused_by_the_name_of_its_run(turned: tuple[int, ...]) -> None:
    runs = [bush(k, -1.0 if k in turned else 1.0) for k in range(2)]
    with pytest.raises(DataError, match=f"bush-{turned[0]}: the measured force falls as the displacement rises"):
        explain(BUSH, runs)
    explain(
        BUSH, [with_channel(r, "force", -r.channels["force"], "N") if k in turned else r for k, r in enumerate(runs)]
    )


def at_a_current(index: int, current: float) -> Run:
    _, x, v = motion(index, 0.01)
    driven = recorded("driven", index, x, (300.0 + 900.0 * current) * v, noise=0.5)
    return with_channel(driven, "current", np.full(x.size, current), "A")


def test_a_model_that_is_wrong_at_one_current_has_no_reversed_sign_and_a_channel_may_have() -> None:
    falls = Model(name="falls", elements=(element("viscous_damping", {"c": 300.0, "c_control": -900.0}),))
    runs = [at_a_current(0, 0.0), at_a_current(1, 1.0)]
    check_model(falls, records(*runs))
    with pytest.raises(DataError, match="driven-1: the simulated force works with the motion"):
        check_model(falls, records(runs[1]))
    channel = [with_channel(r, "force_simulated", sign * r.channels["force"], "N")
               for r, sign in zip(runs, (1.0, -1.0), strict=True)]  # fmt: skip
    with pytest.raises(DataError, match="driven-1"):
        explain(None, channel)


def test_a_mass_is_no_spring_that_is_upside_down() -> None:
    _, x, _ = motion(0, 0.01)
    a = np.gradient(np.gradient(x, 1.0 / RATE), 1.0 / RATE)
    heavy = recorded("heavy", 0, x, 40.0 * a + 100.0 * x, noise=0.5)
    assert np.corrcoef(heavy.channels["displacement"], heavy.channels["force"])[0, 1] < -0.3
    check_model(BUSH, records(heavy))


def test_a_late_force_above_a_spring_is_named_though_a_dashpot_below_zero_would_do_the_same() -> None:
    runs = []
    for k, (amplitude, hz) in enumerate([(0.0115, 0.5), (0.0185, 2.8), (0.008, 1.4)]):
        turn = 2.0 * np.pi * hz * np.arange(round(6.0 * RATE)) / RATE
        runs.append(
            recorded("soft", k, amplitude * np.sin(turn), 9e4 * amplitude * np.sin(turn - 0.12 * hz), noise=4.0)
        )
    soft = Model(name="soft", elements=(element("linear_stiffness", {"k": 9.5e4}), DASHPOT))
    found = explain(soft, runs)
    assert set(found.compared) == {"force_delay"}
    assert found.model.element("force_delay").value("tau") == pytest.approx(0.12 / (2.0 * np.pi), rel=0.02)
