"""A waveform's rate is what the wire can carry, as it is measured before anything moves."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigctl.device import RigState
from rigctl.errors import LimitError
from rigctl.player import PlayerSettings, play
from rigctl.runfile import read_run
from rigctl.wire_rate import SHARE, largest_rate_hz, round_trips_s
from sim_rig.direct import DirectTransport
from tests.sim_rig.conftest import Bench, a_sine
from tests.sim_rig.virtual import wire_to


@given(st.floats(1e-5, 1.0), st.integers(2, 1000))
def test_at_the_largest_rate_an_exchange_brings_more_samples_than_are_played_meanwhile(
    round_trip_s: float, samples: int
) -> None:
    played = largest_rate_hz(round_trip_s, samples) * round_trip_s
    assert played == pytest.approx(SHARE * samples)


def at_2_khz(**more: Any) -> Any:
    from dataclasses import replace

    test = a_sine(4000, **more)
    return replace(test, excitation=replace(test.excitation, sample_rate_hz=2000.0))


def test_two_kilohertz_at_a_round_trip_of_20_ms_are_refused_before_power_with_the_rate_that_would_do(
    tmp_path: Any,
) -> None:
    bench = Bench(speed=1.0)
    wire = DirectTransport(bench.rig, bench.clock, call_s=0.02)
    with pytest.raises(LimitError, match=r"2000 Hz, this wire carries 6[34]0 Hz: a round trip takes 20\.0 ms") as error:
        play(wire, at_2_khz(), tmp_path, clock=bench.clock)
    assert "\n" not in str(error.value)
    assert bench.rig.controller.state is RigState.DISABLED
    assert abs(bench.plant.travelled_m).max() < 1e-4
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("speed", "call_s"), [(1.0, 0.005), (20.0, 0.02)])
def test_a_wire_that_is_fast_enough_and_a_simulated_clock_that_waits_are_not_refused(
    tmp_path: Any, speed: float, call_s: float
) -> None:
    bench = Bench(speed=speed)
    wire = DirectTransport(bench.rig, bench.clock, call_s=call_s)
    settings = PlayerSettings(ramp_s=0.2)
    assert play(wire, at_2_khz(amplitude_m=0.002), tmp_path, clock=bench.clock, settings=settings).exists()


@pytest.mark.parametrize("wire", ["modbus", "can", "can_fd"])
def test_what_is_measured_before_a_run_does_not_mix_its_blocks_with_those_of_the_run_before(
    tmp_path: Any, wire: str
) -> None:
    bench = Bench(speed=20.0)
    transport = wire_to(wire, bench.rig, bench.clock)
    for samples in (6000, 400):  # a long run, whose last block has a high number, then a short one
        path = play(transport, a_sine(samples), tmp_path, clock=bench.clock, settings=PlayerSettings(ramp_s=0.1))
        assert read_run(path).samples == samples
        transport.identify(1.0)
        assert round_trips_s(transport, bench.clock, 3) != []
