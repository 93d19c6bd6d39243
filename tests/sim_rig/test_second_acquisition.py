"""A measuring amplifier with a clock of its own is recorded beside a test and put on the rig's clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.errors import AlignmentError, MapError
from rigctl.machines.instrument import LiveRecord, RegisterInstrument, read_instrument_map
from rigctl.machines.modbus_points import ModbusPoints
from rigctl.machines.register_machine import RegisterMachine
from rigctl.machines.rig_map import read_rig_map
from rigctl.machines.transport import MachineTransport
from rigctl.player import PlayerSettings, play
from rigctl.runfile import read_run
from rigctl.second_acquisition import by_pulse, merged
from sim_rig.foreign.amplifier import Amplifier, TappedPlant
from sim_rig.foreign.motion import MotionController
from tests.sim_rig.foreign import EXAMPLES, ForeignModem, Time, WatchedPlant

INSTRUMENT = EXAMPLES.parent / "instruments" / "amplifier.toml"
DRIFT = 150e-6


class Laboratory:
    """A controller, an amplifier on the same sensors, and a host that reads both, on one virtual clock."""

    def __init__(self) -> None:
        self.time = Time()
        self.plant = TappedPlant(WatchedPlant())
        controller = MotionController(self.plant, now=self.time.now)
        self.amplifier = Amplifier(self.plant, now=self.time.now, drift=DRIFT)
        self.time.living += [controller.tick, self.amplifier.tick]
        rig, instrument = read_rig_map(EXAMPLES / "motion_buffered.toml"), read_instrument_map(INSTRUMENT)
        assert rig.modbus is not None
        modem = ForeignModem(controller, self.time, call_s=0.0005)
        points = ModbusPoints(rig.modbus, rig.register, clock=self.time, client=modem)
        self.transport = MachineTransport(rig, RegisterMachine(rig, points, self.time), clock=self.time)
        self.cable = ForeignModem(self.amplifier, self.time, call_s=0.0005)
        its_points = ModbusPoints(instrument.modbus, instrument.register, clock=self.time, client=self.cable)
        self.instrument = RegisterInstrument(instrument, its_points, self.time)


def a_test(seconds: float = 4.0) -> Test:
    """A slow motion, with a current that rises at irregular intervals."""
    time = np.arange(round(seconds * 1000)) / 1000
    rises = np.cumsum(np.random.default_rng(2).uniform(0.15, 0.45, 40))
    return Test(
        name="a test",
        excitation=Excitation(
            kind=Kind.CUSTOM,
            sample_rate_hz=1000.0,
            period_samples=0,
            displacement_m=0.01 * np.sin(2 * np.pi * time),
            current_a=0.2 + 0.8 * (np.searchsorted(rises, time) % 2),
            design={},
        ),
    )


def test_the_force_of_the_amplifier_comes_into_the_run_on_the_clock_of_the_rig(tmp_path: Path) -> None:
    lab = Laboratory()
    live = LiveRecord(lab.instrument, lab.time)
    path = play(
        lab.transport,
        a_test(),
        tmp_path,
        on_progress=lambda progress: live.step(),
        clock=lab.time,
        settings=PlayerSettings(ramp_s=0.2),
    )
    lab.time.sleep(0.5)
    run, record = read_run(path), live.finish()
    relation = by_pulse(run, record, "current", "Coil", 0.6)
    assert abs(relation.drift - -DRIFT) <= 3 * relation.drift_u
    assert relation.delay_u_s <= 1e-3
    found = merged(run, record, relation, {"Load": "force", "Body": "temperature"})
    own = found.run.channels["force_rig"]
    inside = slice(100, -100)  # the band of the slower clock: both smoothed over 20 ms
    kernel = np.ones(20) / 20
    difference = np.convolve(found.run.channels["force"] - own, kernel, "same")[inside]
    assert float(np.sqrt(np.mean(difference**2))) <= 0.03 * float(np.sqrt(np.mean(own**2)))


def test_an_amplifier_that_fails_does_not_disturb_the_test(tmp_path: Path) -> None:
    lab = Laboratory()
    live = LiveRecord(lab.instrument, lab.time)
    lab.amplifier.answers = False  # each attempt costs the host its deadline, which the buffer of set-points bridges
    path = play(
        lab.transport,
        a_test(1.0),
        tmp_path,
        on_progress=lambda progress: live.step(),
        clock=lab.time,
        settings=PlayerSettings(ramp_s=0.2),
    )
    assert read_run(path).status == "complete"
    with pytest.raises(AlignmentError, match="the other acquisition failed"):
        live.finish()


@pytest.mark.parametrize(
    ("was", "becomes", "says"),
    [
        ('role = "trace_count"', 'role = "trace_first"', "role trace_count is missing: an instrument needs it"),
        ("rate = 500.0", "rate = 0.5", "rate is 0.5 Hz: it must lie in 1 … 200 000"),
        ('role = "channel_1"\nname', 'role = "force"\nname', "role is force: it must be channel_1 … channel_8"),
    ],
)
def test_a_wrong_map_of_an_instrument_is_refused_in_one_line(was: str, becomes: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "amplifier.toml"
    text = INSTRUMENT.read_text(encoding="utf-8")
    assert was in text
    path.write_text(text.replace(was, becomes, 1), encoding="utf-8")
    with pytest.raises(MapError) as caught:
        read_instrument_map(path)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
