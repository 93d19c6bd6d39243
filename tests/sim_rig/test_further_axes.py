"""A rig of six axes: the channels of its further axes come over every wire, to hosts that ask for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.errors import InterlockTripped, LimitError, RequestDenied
from rigctl.further_axes import FURTHER_AXES
from rigctl.interlocks import interlock
from rigctl.limits import Configuration
from rigctl.player import PlayerSettings, play
from rigctl.runfile import read_run
from rigctl.transport import Capability
from sim_rig.errors import SpecimenError
from sim_rig.multi_axis import ANTI_YAW
from sim_rig.multi_axis_plant import NOISE, MultiAxisPlant, held_places
from sim_rig.plant import SimulatedPlant
from sim_rig.server import build_rig
from sim_rig.specimens import RAILWAY
from tests.sim_rig.virtual import WIRES, wire_to

HELD = ("displacement_y=0.004", "displacement_rz=-0.02")
QUICK = PlayerSettings(ramp_s=0.1)
S = 2.0


def a_test(samples: int) -> Test:
    """A sine of 4 mm, 2 Hz, at 400 Hz."""
    motion = 0.004 * np.sin(2 * np.pi * 2.0 * np.arange(samples) / 400.0)
    return Test(
        name="sine",
        excitation=Excitation(
            kind=Kind.SINE, sample_rate_hz=400.0, period_samples=0, displacement_m=motion, current_a=None, design={}
        ),
    )


class Rig:
    """A rig of six axes on a clock of the test."""

    def __init__(self, clock: Any, *faults: str) -> None:
        self.clock = clock
        self.rig, _ = build_rig("anti-yaw", hide=(), seed=3, speed=20.0, now=clock.now, faults=faults, held=HELD)

    def play(self, wire: str, test: Test, folder: Path) -> Any:
        transport = wire_to(wire, self.rig, self.clock)
        return read_run(play(transport, test, folder, clock=self.clock, settings=QUICK))


@pytest.fixture
def clock(bench: Callable[..., Any]) -> Any:
    return bench().clock


@pytest.mark.parametrize("wire", WIRES)
def test_a_run_holds_the_channels_of_every_axis(wire: str, clock: Any, tmp_path: Path) -> None:
    run = Rig(clock).play(wire, a_test(400), tmp_path)
    assert (run.status, run.samples) == ("complete", 400)
    assert {name: run.units[name] for name in FURTHER_AXES} == FURTHER_AXES
    for k, name in enumerate(list(FURTHER_AXES)[:5]):
        place = {"displacement_y": 0.004, "displacement_rz": -0.02}.get(name, 0.0)
        assert abs(np.mean(run.channels[name]) - place) < NOISE[k]
    assert np.std(run.channels["force"]) > 1e3
    assert np.std(run.channels["force_y"]) > 2 * NOISE[5]  # the turned damper's force has a part along y
    assert np.corrcoef(run.channels["force_y"], run.channels["force"])[0, 1] > 0.8


@pytest.mark.parametrize("wire", WIRES)
def test_a_load_of_a_further_axis_beyond_its_limit_stops_the_test(wire: str, clock: Any, tmp_path: Path) -> None:
    rig = Rig(clock)
    whole = rig.play(wire, a_test(400), tmp_path / "whole").channels["force_y"]
    limit = 0.5 * float(np.max(np.abs(whole)))
    settings = replace(QUICK, interlocks=(interlock(f"force_y:{-limit:g}:{limit:g}:stop"),))
    with pytest.raises(InterlockTripped, match="interlock: force_y outside"):
        play(wire_to(wire, Rig(clock).rig, clock), a_test(2000), tmp_path, clock=clock, settings=settings)
    (path,) = tmp_path.glob("*.h5")
    run = read_run(path)
    assert run.status == "aborted"
    assert run.samples < 2000


def test_a_rig_of_one_axis_has_no_interlock_on_a_further_one(bench: Callable[..., Any], tmp_path: Path) -> None:
    b = bench()
    settings = replace(QUICK, interlocks=(interlock("torque_z:-10:10:stop"),))
    with pytest.raises(LimitError, match="the rig does not measure torque_z: take the interlock out"):
        play(wire_to("can", b.rig, b.clock), a_test(60), tmp_path, clock=b.clock, settings=settings)
    with pytest.raises(LimitError, match="nothing would end the hold: use stop or indicate"):
        interlock("torque_z:-10:10:hold")


def test_every_wire_brings_the_same_samples(clock: Any, tmp_path: Path) -> None:
    runs = [Rig(clock).play(wire, a_test(60), tmp_path / wire) for wire in WIRES]
    for run in runs[1:]:
        for name in FURTHER_AXES:
            np.testing.assert_allclose(run.channels[name], runs[0].channels[name], rtol=0, atol=1e-9)


@pytest.mark.parametrize("wire", ["can", "can_fd", "modbus"])
@pytest.mark.parametrize("fault", ["lost:0.02", "corrupted:0.02"])
def test_no_sample_is_lost_or_mixed_over_a_bad_wire(
    wire: str, fault: str, bench: Callable[..., Any], tmp_path: Path
) -> None:
    clean = Rig(bench().clock).play(wire, a_test(60), tmp_path / "clean")
    bad = Rig(bench().clock, fault).play(wire, a_test(60), tmp_path / "bad")
    for name in FURTHER_AXES:
        np.testing.assert_allclose(bad.channels[name], clean.channels[name], rtol=0, atol=1e-9)


@pytest.mark.parametrize("wire", WIRES)
def test_a_host_that_does_not_ask_gets_the_samples_of_one_axis(wire: str, clock: Any) -> None:
    transport = wire_to(wire, Rig(clock).rig, clock)
    identity = transport.identify(S)
    assert identity.channel_count == 15
    assert Capability.FURTHER_AXES in identity.capabilities
    transport.claim(S)
    transport.configure(Configuration(), S)
    assert transport.exchange(None, 0, 0, S).capture.values.shape[1] == 5
    transport.configure(Configuration(sample_rate_hz=400.0, further_axes=True), S)
    assert transport.exchange(None, 0, 0, S).capture.values.shape[1] == 15


@pytest.mark.parametrize("wire", WIRES)
def test_a_rig_of_one_axis_refuses_to_send_further_ones(wire: str, bench: Callable[..., Any]) -> None:
    b = bench()
    transport = wire_to(wire, b.rig, b.clock)
    assert Capability.FURTHER_AXES not in transport.identify(S).capabilities
    transport.claim(S)
    with pytest.raises(RequestDenied):
        transport.configure(Configuration(sample_rate_hz=400.0, further_axes=True), S)


def test_nothing_moves_the_further_axes(clock: Any, tmp_path: Path) -> None:
    run = Rig(clock, "emergency_stop@0.2")
    with pytest.raises(Exception, match="emergency stop"):
        run.play("direct", a_test(400), tmp_path)
    stopped = read_run(next(tmp_path.glob("*.h5")))
    assert stopped.status == "aborted"
    for name in list(FURTHER_AXES)[:5]:
        assert np.ptp(stopped.channels[name]) < 20 * NOISE[0 if name[-2] == "_" else 2]


def test_the_plant_is_played_again_from_a_snapshot() -> None:
    inner = SimulatedPlant(RAILWAY.damper, RAILWAY.noise, seed=1, start_degc=25.0)
    plant = MultiAxisPlant(inner, ANTI_YAW, held=held_places(HELD), seed=1)
    motion = np.column_stack([0.004 * np.sin(np.arange(200) / 20.0), np.zeros(200)])
    plant.play(motion[:80])
    before = plant.snapshot()
    once = plant.play(motion[80:])
    plant.restore(before)
    np.testing.assert_array_equal(plant.play(motion[80:]), once)


@pytest.mark.parametrize("order", ["displacement_y", "displacement_y=far", "displacement_y=1", "force_y=0", "x=0.001"])
def test_a_place_that_no_axis_can_take_is_refused(order: str) -> None:
    with pytest.raises(SpecimenError, match=r"write CHANNEL=VALUE in m or rad with one of displacement_y \(±0.02\)"):
        held_places([order])


@pytest.mark.parametrize(
    ("specimen", "more", "text"),
    [
        ("yaw", {"held": HELD}, "specimen 'yaw' has one axis: places are for anti-yaw"),
        ("anti-yaw", {"hide": ["coulomb_friction"]}, "nothing can be hidden in specimen 'anti-yaw'"),
        ("lateral", {}, "choose one of .*, anti-yaw"),
    ],
)
def test_what_a_specimen_cannot_be_is_refused(specimen: str, more: dict[str, Any], text: str) -> None:
    with pytest.raises(SpecimenError, match=text):
        build_rig(specimen, **({"hide": (), "seed": 1, "speed": 1.0, "now": lambda: 0.0} | more))
