"""A displacement that jumps and a velocity that is another one's: told in one line, and not learned from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.blackbox import Structure, identified_text, identify, regressors
from identification.datachecks import findings_in
from identification.errors import DataError
from identification.inverse import inverse_runs
from identification.motion_faults import jumps_in, velocity_fault
from rigctl.runfile import Run, with_channel
from tests.identification.hysteretic import RATE_HZ, hysteretic

Floats = NDArray[np.float64]
SMALL = [Structure(regressors("v0 P0 R0"), 4)]


def slipped(run: Run, at: int = 500, by: float = 0.02) -> Run:
    """Its displacement sensor slips by `by` metres at a sample."""
    x = run.channels["displacement"].copy()
    x[at:] += by
    return with_channel(run, "displacement", x, "m")


def with_velocity(run: Run, factor: float = 1.0, noise: float = 0.0) -> Run:
    """Its velocity is measured, in another unit, and with noise of so many times its own size."""
    v = np.gradient(run.channels["displacement"], 1.0 / run.sample_rate_hz)
    drawn = np.random.default_rng(1).standard_normal(v.size)
    return with_channel(run, "velocity", factor * v + noise * np.std(v) * drawn, "m/s")


def test_a_displacement_that_slips_is_told_with_where_how_far_and_what_its_motion_allows() -> None:
    (line,) = [one for one in findings_in([slipped(hysteretic(1, 900))]) if "jump" in one]
    assert "hysteretic-1: displacement: it jumps by 18.7 mm from 2.495 to 2.500 s" in line
    assert "where its motion allows 1" in line
    assert "cut the run there" in line
    (jump,) = jumps_in(slipped(hysteretic(1, 900)))
    assert (jump.at, abs(jump.by - 0.02) < jump.allowed < 0.02) == (500, True)


def test_one_wrong_value_makes_two_jumps() -> None:
    run = hysteretic(1, 900)
    x = run.channels["displacement"].copy()
    x[300] += 0.05
    assert [one.at for one in jumps_in(with_channel(run, "displacement", x, "m"))] == [300, 301]


def test_a_step_of_every_period_belongs_to_the_motion_and_one_of_a_single_period_does_not() -> None:
    one = slipped(hysteretic(1, 600))
    every = replace(one, channels={name: np.tile(x, 3) for name, x in one.channels.items()}, period_samples=600)
    assert jumps_in(every) == []
    assert [jump.at for jump in jumps_in(slipped(every, at=900, by=0.05))] == [900]


@pytest.mark.parametrize("step_m", [0.0, 2e-5, 1e-3])
@pytest.mark.parametrize("rest_s", [0.0, 1.5])
def test_no_motion_that_a_machine_makes_jumps_however_coarse_its_sensor(step_m: float, rest_s: float) -> None:
    run = hysteretic(3, 1200, rest_s=rest_s)
    x = run.channels["displacement"]
    coarse = np.round(x / step_m) * step_m if step_m else x
    assert jumps_in(with_channel(run, "displacement", coarse, "m")) == []


def test_a_step_that_the_measured_velocity_bears_out_is_no_jump() -> None:
    run = slipped(hysteretic(1, 900))
    v = with_velocity(hysteretic(1, 900)).channels["velocity"]
    assert len(jumps_in(with_channel(run, "velocity", v, "m/s"))) == 1
    v[500] = 0.02 * RATE_HZ
    assert jumps_in(with_channel(run, "velocity", v, "m/s")) == []


@pytest.mark.parametrize(
    ("factor", "noise", "words"),
    [
        (0.0, 1.0, "it is noise or another channel; leave it out"),
        (0.0, 0.0, "it is frozen at 0 m/s: check its sensor, or leave it out"),
        (-1.0, 0.0, "correlation -1.00: one of their signs is reversed"),
        (1000.0, 0.0, "998 times the derivative of the displacement, and should be 1: check its unit"),
    ],
)
def test_a_velocity_that_is_not_that_of_the_displacement_is_told(factor: float, noise: float, words: str) -> None:
    fault = velocity_fault(with_velocity(hysteretic(2, 900), factor, noise))
    assert words in str(fault)
    assert "\n" not in str(fault)
    assert any(f"velocity: {fault}" in one for one in findings_in([with_velocity(hysteretic(2, 900), factor, noise)]))


def test_a_velocity_with_the_noise_of_a_sensor_is_a_velocity_though_the_displacement_slips() -> None:
    for run in (hysteretic(2, 900), slipped(hysteretic(2, 900))):
        v = with_velocity(hysteretic(2, 900), noise=0.3).channels["velocity"]
        assert velocity_fault(with_channel(run, "velocity", v, "m/s")) is None


def test_what_lies_between_jumps_is_learned_as_if_they_were_runs_and_the_rest_is_told() -> None:
    run, shown = hysteretic(1, 1200), hysteretic(5, 600)
    clean = identify("nnoe", [run], held_out=[shown], structures=SMALL)
    jumped = identify("nnoe", [slipped(run)], held_out=[shown], structures=SMALL)
    (fit,), (known,) = jumped.shown.values(), clean.shown.values()
    assert (
        abs(fit - known) < 3.0
    )  # each piece begins from a past that is predicted: 0.5, 1.0 and 2.2 % on three records
    assert clean.notes == ()
    (note,) = jumped.notes
    assert "1200 of 1200 samples are learned, in 2 pieces" in note
    assert note in identified_text(jumped)


def test_a_velocity_of_noise_is_not_learned_from_and_not_asked_for() -> None:
    run, shown = hysteretic(1, 1200), hysteretic(5, 600)
    clean = identify("nnoe", [run], held_out=[shown], structures=SMALL)
    noisy = identify("nnoe", [with_velocity(run, 0.0, 1.0)], held_out=[with_velocity(shown)], structures=SMALL)
    assert noisy.shown == clean.shown
    assert "velocity" not in noisy.model.inputs
    assert "the derivative of the displacement takes its place" in noisy.notes[0]


def test_a_run_that_jumps_all_the_time_is_refused_in_one_line() -> None:
    run = hysteretic(1, 600)
    x = run.channels["displacement"] + 0.05 * (np.arange(600) // 60 % 2)
    with pytest.raises(DataError, match="no piece between the jumps has 100 samples"):
        identify("nnoe", [with_channel(run, "displacement", x, "m")], structures=SMALL)


def test_an_inverse_learns_between_the_jumps_too() -> None:
    run = replace(hysteretic(1, 900, current=True), path=None)
    learned, _ = inverse_runs([slipped(run)])
    assert [one.samples for one in learned] == [500, 400]
