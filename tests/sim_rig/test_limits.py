"""Limits are the machine's, the specimen's and the test's, whichever is tighter, before and while the rig moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.errors import DesignError
from excitation.limits_given import TestLimits
from excitation.plan import Test, TestPlan, config_of, plan_from_config, test_from_config
from excitation.plan_files import read_plan, write_plan
from excitation.rig import Control, Envelope, ForceLimits, MotionLimits, TemperatureWindow
from rigctl.device import RigState
from rigctl.errors import InterlockTripped, LimitError, RequestDenied, RigFault
from rigctl.limit_watch import LimitWatch
from rigctl.limits import Configuration, Limits
from rigctl.limits_together import limits_together
from rigctl.player import PlayerSettings, play
from rigctl.runfile import read_run
from sim_rig.direct import DirectTransport
from sim_rig.rig import MACHINE

SPECIMEN = Envelope(
    name="small damper",
    motion=MotionLimits(max_displacement_m=0.03, max_velocity_m_s=5.0, max_acceleration_m_s2=40.0),
    force=ForceLimits(static_n=9e3, dynamic_n=8e3),
    control=Control(max_current_a=1.5),
    temperature=TemperatureWindow(min_degc=10.0, max_degc=90.0),
)
LIMITS = {"max_force": 5000.0, "max_displacement": 0.05, "max_temperature": 60.0, "max_following_error": 0.01}
SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.02, "frequency": 2.0, "cycles": 4, "current": 0.5}


def a_test(**limits: float) -> Test:
    return test_from_config({"name": "limited", **SINE, "limits": limits})


def test_of_the_limits_of_machine_specimen_host_and_test_the_tightest_holds() -> None:
    own = Limits(velocity_m_s=1.0, force_n=7e3)
    found = limits_together(MACHINE, own, (SPECIMEN,), a_test(**LIMITS))
    assert found == replace(
        MACHINE,
        position_min_m=-0.03,  # of the specimen, tighter than the test's
        position_max_m=0.03,
        velocity_m_s=1.0,
        acceleration_m_s2=40.0,
        force_n=5000.0,
        current_max_a=1.5,
        temperature_max_degc=60.0,
        following_error_m=0.01,
    )


@pytest.mark.parametrize("ending", [".toml", ".csv", ".h5"])
def test_the_limits_of_a_test_are_in_every_plan_file(tmp_path: Path, ending: str) -> None:
    plan = plan_from_config({"tests": [config_of(a_test(**LIMITS)), {"name": "free", **SINE}]})
    write_plan(tmp_path / f"plan{ending}", plan)
    read = read_plan(tmp_path / f"plan{ending}")
    assert [test.limits for test in read.tests] == [a_test(**LIMITS).limits, None]


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"max_force": -1.0}, "max_force is -1"),
        ({"max_force_n": 1.0}, "max_force_n"),
        ({"min_current": 0.5}, "current"),
    ],
)
def test_limits_that_cannot_be_are_refused_in_one_line(limits: dict[str, float], words: str) -> None:
    with pytest.raises(DesignError, match=words) as error:
        a_test(**limits)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("test", "settings", "words"),
    [
        (a_test(max_displacement=0.015), {}, "displacement leaves -0.015 … 0.015"),
        (a_test(max_velocity=0.2), {}, "velocity leaves"),
        (a_test(max_acceleration=2.0), {}, "acceleration leaves"),
        (a_test(max_current=0.4), {}, "current leaves 0 … 0.4 A"),
        (
            a_test(),
            {"envelopes": (replace(SPECIMEN, motion=MotionLimits(max_displacement_m=0.01, max_velocity_m_s=1.0)),)},
            "small damper: test 'limited' exceeds the rig: displacement 0.02 m",
        ),
        (a_test(), {"envelopes": (replace(SPECIMEN, control=Control(sample_rates_hz=(500.0,))),)}, "sample rate"),
        (
            replace(a_test(), excitation=replace(a_test().excitation, sample_rate_hz=999.96)),
            {},
            "design the test at 1000 Hz",
        ),
        (
            replace(a_test(), excitation=replace(a_test().excitation, sample_rate_hz=50.0)),
            {},
            "the rig plays 100 … 5000",
        ),
    ],
)
def test_a_test_outside_any_of_them_is_refused_before_anything_moves(
    bench: Callable[..., Any], tmp_path: Path, test: Test, settings: dict[str, Any], words: str
) -> None:
    b = bench()
    wire, asked = DirectTransport(b.rig, b.clock), PlayerSettings(ramp_s=0.3, **settings)
    with pytest.raises(LimitError, match=words) as error:
        play(wire, test, tmp_path / "runs", clock=b.clock, settings=asked)
    assert "\n" not in str(error.value)
    assert b.rig.controller.sample_index == 0
    assert not (tmp_path / "runs").exists()


class Careless(DirectTransport):
    """A wire to a rig that does not keep limits but its own."""

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        super().configure(replace(configuration, limits=MACHINE), deadline_s)


@pytest.mark.parametrize(
    ("limits", "by_rig", "by_host"),
    [
        ({"max_force": 300.0}, "the force limit was reached", "limit: force"),
        ({"max_following_error": 1e-4}, "did not follow", "limit: following error"),
        ({"max_temperature": 20.0}, "too hot", "limit: temperature"),
    ],
)
def test_while_it_moves_the_rig_acts_first_and_the_host_where_the_rig_does_not(
    bench: Callable[..., Any], tmp_path: Path, limits: dict[str, float], by_rig: str, by_host: str
) -> None:
    for wire, error, words in ((DirectTransport, RigFault, by_rig), (Careless, InterlockTripped, by_host)):
        b = bench(speed=1.0)
        test = test_from_config({"name": "limited", **SINE, "cycles": 20, "limits": limits})
        with pytest.raises(error, match=words) as caught:
            play(wire(b.rig, b.clock), test, tmp_path, clock=b.clock, settings=PlayerSettings(ramp_s=0.3))
        if caught.value.run_path is not None:
            run = read_run(caught.value.run_path)
            assert (run.status, words in run.events[-1][1]) == ("aborted", True)
        assert b.rig.controller.state in (RigState.DISABLED, RigState.FAULT_HOLD, RigState.FAULT_DISABLED)
        assert b.plant.hardest_m_s2() < 1.5 * MACHINE.acceleration_m_s2


def test_a_violation_that_is_shorter_than_its_delay_is_none() -> None:
    watch = LimitWatch(Limits(force_n=1000.0), 1000.0)
    values = np.zeros((25, 5))
    values[8:17, 0] = -1500.0
    assert watch.exceeded(values, np.zeros(25)) is None
    values[17, 0] = 1500.0
    assert watch.exceeded(values[:13], np.zeros(13)) is None  # it may lie in several blocks
    assert watch.exceeded(values[13:], np.zeros(12)) == "limit: force 1500 N, outside -1000 … 1000 for 0.01 s"
    unknown = np.zeros((10, 5))
    unknown[:, 1] = np.nan
    assert "displacement nan" in str(LimitWatch(Limits(), 1000.0).exceeded(unknown, np.zeros(10)))


def test_a_rig_refuses_rates_and_watchdogs_that_it_does_not_have(bench: Callable[..., Any]) -> None:
    b = bench()
    wire = DirectTransport(b.rig, b.clock)
    wire.claim(1.0)
    for configuration in (Configuration(sample_rate_hz=99.0), Configuration(heartbeat_s=11.0)):
        with pytest.raises(RequestDenied, match="here"):
            wire.configure(configuration, 1.0)


def test_a_plan_without_limits_has_none() -> None:
    plan = TestPlan(tests=(test_from_config({"name": "free", **SINE}),))
    assert plan.tests[0].limits is None
    assert limits_together(MACHINE, None, (), plan.tests[0]) == MACHINE
    assert limits_together(MACHINE, None, (), replace(plan.tests[0], limits=TestLimits())) == MACHINE
