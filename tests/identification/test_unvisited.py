"""A held-out run that goes where the training never went is told, also where each signal lies within its range."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.blackbox import BlackBox, Identified, Structure, identify, regressors, write_identified
from identification.blackbox.band import LEVELS
from identification.blackbox.described import identified_text
from identification.models import load_model, motion_of, outside_training
from identification.models.visited import CELL, MOST_POINTS, TOGETHER, visited_in
from rigctl.runfile import Run, with_channel
from tests.identification.hysteretic import RATE_HZ, hysteretic

TOLD = "displacement and velocity taken together"


def oscillating(amplitude_m: float, samples: int = 800) -> Run:
    """A sine of 1 Hz of a viscous damper with a spring."""
    turn = 2.0 * np.pi * np.arange(samples) / RATE_HZ
    x, v = amplitude_m * np.sin(turn), 2.0 * np.pi * amplitude_m * np.cos(turn)
    return with_channel(with_channel(hysteretic(1, samples), "displacement", x, "m"), "force", 800.0 * v + 2e3 * x, "N")


def found(*shown: Run) -> Identified:
    return identify("arx", [oscillating(0.02)], held_out=shown, structures=[Structure(regressors("x0 v0"), 0)])


def test_a_smaller_motion_within_every_range_is_told_and_the_same_motion_is_not() -> None:
    small, same = replace(oscillating(0.01), run_id="small"), replace(oscillating(0.02), run_id="same")
    told = [line for line in identified_text(found(small, same)).splitlines() if TOLD in line]
    assert len(told) == 1
    assert told[0].strip().startswith("small: 100 % of the samples")


def test_a_reversal_where_the_training_has_none_is_told_with_its_time() -> None:
    run = oscillating(0.02)
    x = run.channels["displacement"].copy()
    x[420:460] = x[420] + np.minimum(np.arange(40), 39 - np.arange(40)) * 1e-5  # it rests between its ends
    rested = with_channel(run, "displacement", x, "m")
    motion = motion_of(run)
    visited = visited_in([(motion, np.ones(motion.x.size, dtype=np.bool_))], TOGETHER)
    assert visited is not None
    (told,) = visited.described(motion_of(rested))
    assert TOLD in told  # the current does not vary
    assert "first at 2.1" in told


def test_the_file_of_a_model_tells_what_was_told_when_it_was_identified(tmp_path: Path) -> None:
    small = replace(oscillating(0.01), run_id="small")
    result = found(small)
    write_identified(tmp_path / "model.json", result.model)
    told = [line for line in outside_training(load_model(tmp_path / "model.json"), small) if TOLD in line]
    assert told == [line for line in result.beyond if TOLD in line]
    assert "farthest at" in told[0]


def test_no_sample_of_a_training_lies_farther_from_its_points_than_the_diagonal_of_a_cell() -> None:
    motion = motion_of(hysteretic(1, 4000))
    visited = visited_in([(motion, np.ones(motion.x.size, dtype=np.bool_))], TOGETHER)
    assert visited is not None
    assert len(visited.points) <= min(MOST_POINTS, motion.x.size // 2)
    assert np.max(visited.distances(motion)) <= CELL * np.sqrt(visited.points.shape[1])


def test_a_band_widens_with_the_distance_from_all_of_the_training_within_every_range_too() -> None:
    model = found().model
    assert isinstance(model, BlackBox)
    bare = replace(model, visited=None)
    small, same = motion_of(oscillating(0.01)), motion_of(oscillating(0.02))
    assert model.half_width(same, 0.9) == pytest.approx(bare.half_width(same, 0.9))
    wider, before = model.half_width(small, 0.9), bare.half_width(small, 0.9)
    assert wider is not None
    assert before is not None
    assert model.band is not None
    middle = int(np.argmax(-np.hypot(small.x / 0.02, small.v / (0.04 * np.pi))))  # a quarter of the ranges inside
    factor = model.band.factors[LEVELS.index(0.9)]
    assert wider[middle] == pytest.approx(factor * model.band.within * model.band.swing * 0.25, rel=0.2)
    assert np.all(wider > before)


def test_a_signal_that_hardly_moves_is_none_of_those_that_are_taken_together() -> None:
    motion = motion_of(hysteretic(1, 400))
    still = replace(motion, x=0.02 + 1e-14 * motion.x, i=np.zeros(motion.x.size))
    counted = np.ones(motion.x.size, dtype=np.bool_)
    assert 0.0 < np.ptp(still.x) < 1e-12
    assert visited_in([(still, counted)], TOGETHER) is None
