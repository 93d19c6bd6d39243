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
from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from excitation.synthesis import excitation_from_config
from rigctl.drive import IterationSettings
from rigctl.errors import IterationError, LimitError
from rigctl.iterate import Iterated, Outcome, Step, iterate, write_drive
from rigctl.iterate_plot import write_convergence
from rigctl.limits import Limits
from rigctl.player import PlayerSettings, play
from rigctl.runfile import read_run
from sim_rig.direct import DirectTransport


def homogenised() -> Excitation:
    return excitation_from_config(
        {
            "kind": "homogenised",
            "sample_rate": 1000.0,
            "period_samples": 4096,
            "periods": 3,
            "seed": 1,
            "displacement": {
                "f_min": 0.5,
                "f_max": 30.0,
                "spectrum": "quarter-car",
                "max_displacement": 0.03,
                "max_velocity": 0.6,
            },
            "current": {"f_min": 0.5, "f_max": 100.0, "spectrum": "control", "min": 0.3, "max": 1.6},
            "homogenise": {"method": "duym", "variables": ["velocity", "current"], "grid": [10, 10]},
        }
    )


def road(samples: int = 12_345) -> Excitation:
    """A record without a period, with the spectrum of a rough road, that does not end at zero."""
    spectrum, f = np.zeros(8193), np.fft.rfftfreq(16_384, 1e-3)
    band = (f > 0.3) & (f < 25)
    spectrum[band] = f[band] ** -0.7
    x = np.fft.irfft(spectrum * np.fft.rfft(np.random.default_rng(3).standard_normal(16_384)))[:samples]
    return Excitation(
        kind=Kind.ROAD,
        sample_rate_hz=1000.0,
        period_samples=0,
        displacement_m=0.008 * x / np.max(np.abs(x)),
        current_a=np.full(samples, 0.8),
    )


def iterated(bench: Any, excitation: Excitation, out: Path, limits: Limits | None = None, **more: Any) -> Iterated:
    wire = DirectTransport(bench.rig, bench.clock)
    player = PlayerSettings(ramp_s=0.5, limits=limits)
    return iterate(
        partial(play, wire, out_dir=out, clock=bench.clock, settings=player),
        Test(name="wanted", excitation=excitation, max_temperature_degc=40.0),
        **more,
    )


@pytest.mark.parametrize("make", [homogenised, road])
def test_within_five_iterations_the_measured_motion_is_the_wanted_one_to_one_per_cent(
    bench: Callable[..., Any], tmp_path: Path, make: Callable[[], Excitation]
) -> None:
    b, target, told = bench(speed=50.0), make(), list[Step]()
    found = iterated(b, target, tmp_path, on_step=told.append)
    assert found.outcome is Outcome.CONVERGED
    assert tuple(told) == found.steps
    assert len(found.steps) <= 6
    assert found.steps[0].error > 0.025, "the plain command is not good enough"
    assert found.best.error <= 0.01
    run = read_run(found.best.run)
    steady = slice(target.period_samples, None)
    error = run.channels["displacement"][steady] - target.displacement_m[steady]
    assert np.sqrt(np.mean(error**2)) <= 0.01 * np.std(target.displacement_m)
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
    np.testing.assert_array_equal(drive.displacement_m, found.best.drive_m)
    assert drive.figures["iteration_errors"] == [step.error for step in found.steps]
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
    assert all(step.gain < 0.9 for step in found.steps)
    assert found.best.error <= found.steps[0].error
    assert (len(found.steps) > 1) == (room_m > 0)


def test_a_target_outside_the_limits_is_refused_before_anything_moves(
    bench: Callable[..., Any], tmp_path: Path
) -> None:
    b = bench(speed=50.0)
    with pytest.raises(LimitError, match="velocity leaves"):
        iterated(b, road(4000), tmp_path, limits=Limits(velocity_m_s=0.01))
    assert b.rig.controller.sample_index == 0


def test_a_step_that_increases_the_error_is_reverted(bench: Callable[..., Any], tmp_path: Path) -> None:
    settings = IterationSettings(gain=1.5, tolerance=1e-6, most=6)
    found = iterated(bench(speed=50.0), road(4000), tmp_path, settings=settings)
    assert found.outcome is Outcome.MOST
    assert len(found.steps) == 7
    assert found.best.error < 0.2 * found.steps[0].error


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
    with pytest.raises(IterationError, match="stopped in the plain command"):
        iterate(stopping, Test(name="stopped", excitation=road(4000)))
