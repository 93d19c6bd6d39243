"""On the simulated rig, the measured motion becomes the wanted one in a few iterations, inside the limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excitation.files import read_excitation
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.device import RigState
from rigctl.drive import IterationSettings
from rigctl.drive_file import read_drive, write_drive
from rigctl.errors import InterlockTripped, IterationError, LimitError
from rigctl.interlocks import interlock
from rigctl.iterate import Channel, Iterated, Outcome, iterate
from rigctl.iterate_plot import write_convergence
from rigctl.limits import Limits
from rigctl.player import PlayerSettings, play
from rigctl.runfile import read_run
from sim_rig.actuator import Actuator
from sim_rig.direct import DirectTransport
from sim_rig.plant import SimulatedPlant
from sim_rig.rig import SimulatedRig
from sim_rig.specimens import SPECIMENS
from tests.sim_rig.iterations import homogenised, iterated, road
from tests.sim_rig.virtual import wire_to


@pytest.mark.parametrize("make", [homogenised, road])
def test_within_two_iterations_what_is_measured_is_what_is_wanted_to_two_per_mille(
    bench: Callable[..., Any], tmp_path: Path, make: Callable[[], Excitation]
) -> None:
    b, target, told = bench(speed=50.0), make(), list[Iterated]()
    found = iterated(b, target, tmp_path, on_step=told.append)
    assert found.outcome is Outcome.CONVERGED
    assert [so_far.steps for so_far in told] == [found.steps[: k + 1] for k in range(len(found.steps))]
    assert len(found.steps) <= 3
    assert min(found.steps[0].errors) > 0.02, "the plain command is not good enough"
    run = read_run(found.best.run)
    steady = slice(target.period_samples, None)
    for channel in found.channels:
        wanted = target.displacement_m if channel is Channel.MOTION else target.current_a
        error = run.channels[channel][steady] - wanted[steady]
        assert np.sqrt(np.mean(error**2)) <= 0.002 * np.std(wanted)
    limits = b.rig.identity().limits
    commands = np.concatenate(b.plant.commands)
    assert np.max(np.abs(commands)) <= limits.position_max_m
    assert b.plant.fastest_m_s() <= limits.velocity_m_s


def test_the_drive_is_stored_with_its_target_and_plays_the_target_again(
    bench: Callable[..., Any], tmp_path: Path
) -> None:
    b, target = bench(speed=50.0), road(4000)
    found = iterated(b, target, tmp_path / "runs")
    path = tmp_path / "drive.h5"
    write_drive(path, found)
    drive = read_excitation(path)
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["channels/displacement_target"], target.displacement_m)
    np.testing.assert_array_equal(drive.displacement_m, found.best.drive[:, 0])
    assert drive.figures["iteration_errors"] == [list(step.errors) for step in found.steps]
    wire, again = DirectTransport(b.rig, b.clock), Test(name="again", excitation=drive)
    run = read_run(play(wire, again, tmp_path, clock=b.clock, settings=PlayerSettings(ramp_s=0.5)))
    assert np.std(run.channels["displacement"] - target.displacement_m) < 0.012 * np.std(target.displacement_m)


def test_the_page_of_the_convergence_needs_no_network(bench: Callable[..., Any], tmp_path: Path) -> None:
    found = iterated(bench(speed=50.0), road(4000), tmp_path)
    write_convergence(tmp_path / "page.html", "a <road>", found)
    page = (tmp_path / "page.html").read_text()
    assert "a &lt;road&gt;: converged" in page
    assert "<script src" not in page
    assert page.count("Plotly.newPlot(") == 3


@pytest.mark.parametrize(("room_m", "outcome"), [(5e-5, Outcome.MOST), (0.0, Outcome.LIMITS)])
def test_a_correction_that_exceeds_the_limits_is_made_with_less_gain_or_not_at_all(
    bench: Callable[..., Any], tmp_path: Path, room_m: float, outcome: Outcome
) -> None:
    b, target = bench(speed=50.0), road(4000)
    wire = DirectTransport(b.rig, b.clock)

    def within(test: Test) -> Path:
        if np.max(np.abs(test.excitation.displacement_m - target.displacement_m)) > room_m:
            raise LimitError("outside")
        return play(wire, test, tmp_path, clock=b.clock, settings=PlayerSettings(ramp_s=0.5))

    settings = IterationSettings(tolerance=1e-3, most=1)
    found = iterate(within, Test(name="tight", excitation=target), settings=settings)
    assert found.outcome is outcome
    assert all(step.gain < 1 for step in found.steps)
    assert found.best.error <= found.steps[0].error
    assert (len(found.steps) > 1) == (room_m > 0)


def test_a_target_outside_the_limits_is_refused_before_anything_moves(
    bench: Callable[..., Any], tmp_path: Path
) -> None:
    b = bench(speed=50.0)
    with pytest.raises(LimitError, match="velocity leaves"):
        iterated(b, road(4000), tmp_path, limits=Limits(velocity_m_s=0.01))
    assert b.rig.controller.sample_index == 0


def test_a_constant_target_or_a_stopped_run_cannot_be_iterated(bench: Callable[..., Any], tmp_path: Path) -> None:
    still = replace(road(1000), displacement_m=np.zeros(1000))
    with pytest.raises(IterationError, match="is constant"):
        iterated(bench(), still, tmp_path)
    b, asked = bench(speed=50.0), []

    def stop() -> str | None:
        asked.append(b.rig.controller.fifo.consumed)
        return "enough" if asked[-1] > 1000 else None

    stopping = partial(
        play, DirectTransport(b.rig, b.clock), out_dir=tmp_path, clock=b.clock, should_stop=stop,
        settings=PlayerSettings(ramp_s=0.5),
    )  # fmt: skip
    with pytest.raises(IterationError, match="stopped in round 0"):
        iterate(stopping, Test(name="stopped", excitation=road(4000)))


def test_an_interlock_in_a_round_stops_the_rig_and_what_was_reached_is_known(
    bench: Callable[..., Any], tmp_path: Path
) -> None:
    b, told = bench(speed=50.0), list[Iterated]()
    wire = DirectTransport(b.rig, b.clock)

    def guarded(test: Test) -> Path:
        player = PlayerSettings(ramp_s=0.5, interlocks=(interlock("force:-50:50:stop:0.005"),) if told else ())
        return play(wire, test, tmp_path, clock=b.clock, settings=player)

    with pytest.raises(InterlockTripped, match="force outside -50") as tripped:
        iterate(guarded, Test(name="guarded", excitation=road(4000)), on_step=told.append)
    assert b.rig.controller.state is RigState.DISABLED
    assert tripped.value.run_path is not None
    assert read_run(tripped.value.run_path).status == "aborted"
    assert [so_far.outcome for so_far in told] == [Outcome.UNFINISHED]
    write_drive(tmp_path / "kept.drive.h5", told[-1])
    kept = read_drive(tmp_path / "kept.drive.h5").drive
    np.testing.assert_array_equal(kept.displacement_m, road(4000).displacement_m)


def test_a_machine_that_follows_badly_and_a_specimen_that_sticks_are_iterated_too(
    bench: Callable[..., Any], tmp_path: Path
) -> None:
    b = bench(speed=50.0)
    sticking = SPECIMENS["semi-active"].damper._replace(
        coulomb=800.0, stribeck=400.0, stribeck_rise=400.0, stribeck_speed=0.05, play=0.001
    )
    lazy = Actuator(gain_1_s=15.0, compensation=0.0, lead_s=0.0)
    plant = SimulatedPlant(sticking, SPECIMENS["semi-active"].noise, seed=3, start_degc=25.0, machine=lazy)
    b.rig = SimulatedRig(plant, speed=50.0, now=b.clock.now)
    found = iterated(b, road(6000), tmp_path)
    assert found.steps[0].error > 0.1
    assert found.outcome is Outcome.CONVERGED
    assert found.best.error < 0.005


def test_damaged_traffic_on_a_bus_changes_nothing_in_the_rounds(bench: Callable[..., Any], tmp_path: Path) -> None:
    damaged, sound = bench(speed=20.0, faults=["lost:0.01", "corrupted:0.01", "reordered:0.02"]), bench(speed=20.0)
    found = []
    for b, folder in ((damaged, "damaged"), (sound, "sound")):
        wire = wire_to("can_fd", b.rig, b.clock)
        one = partial(play, wire, out_dir=tmp_path / folder, clock=b.clock, settings=PlayerSettings(ramp_s=0.5))
        found.append(iterate(one, Test(name="road", excitation=road(4000))))
    for disturbed, clean in zip(found[0].steps, found[1].steps, strict=True):
        np.testing.assert_array_equal(disturbed.measured, clean.measured)
