"""A held-out run that goes where the training never went is told, also where each signal lies within its range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.blackbox import Identified, Structure, identify, regressors
from identification.blackbox.described import identified_text
from identification.blackbox.preparation import course_of
from identification.blackbox.unvisited import unvisited
from identification.models import motion_of
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
    (told,) = unvisited([course_of(run, ())], motion_of(rested), ("displacement", "velocity", "current"))
    assert TOLD in told  # the current does not vary
    assert "first at 2.1" in told
