"""A recorded signal that is a copy of another one is refused before anything is learned from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.blackbox import Structure, given, regressors
from identification.errors import DataError
from identification.inverse import inverse_runs
from rigctl.runfile import Run, with_channel
from tests.identification.hysteretic import hysteretic

SEEN = [Structure(regressors("x0 v0 i0"), 4)]


def driven(seed: int = 1) -> Run:
    return hysteretic(seed, 900, current=True)


def with_current(run: Run, name: str, factor: float, noise: float = 0.0) -> Run:
    """Its current is another channel times a factor, with noise of so many times its own size."""
    copied = factor * run.channels[name] + 0.3
    drawn = np.random.default_rng(1).standard_normal(copied.size)
    return with_channel(run, "current", copied + noise * np.std(copied) * drawn, "A")


def coarse(run: Run) -> Run:
    """Its displacement sensor has noise of a hundredth of the stroke, which the motion is smoothed from."""
    x = run.channels["displacement"]
    drawn = np.random.default_rng(2).standard_normal(x.size)
    return with_channel(run, "displacement", x + 0.01 * np.std(x) * drawn, "m")


def test_a_copy_of_a_rough_displacement_is_a_copy_though_the_motion_that_is_learned_is_smoother() -> None:
    with pytest.raises(DataError, match="current is displacement times a constant in all runs: a duplicate tells noth"):
        given("nnoe", [with_current(coarse(driven()), "displacement", 30.0)], structures=SEEN)


def test_a_current_that_is_the_measured_force_tells_what_the_model_is_to_give() -> None:
    with pytest.raises(DataError, match="current is force times a constant in all runs: a duplicate tells what the mo"):
        given("nnoe", [with_current(driven(), "force", 1e-3)], structures=SEEN)
    with pytest.raises(DataError, match="current is force times a constant"):
        inverse_runs([with_current(driven(), "force", 1e-3)])


def test_a_temperature_that_is_the_current_is_a_copy_of_it() -> None:
    run = driven()
    warm = with_channel(run, "temperature", 10.0 * run.channels["current"] + 20.0, "degC")
    with pytest.raises(DataError, match="current is temperature times a constant"):
        given("nnoe", [warm], structures=[Structure(regressors("v0 i0 T0"), 4)])
    assert given("nnoe", [warm], structures=SEEN).candidates  # of which the temperature is not seen


def test_a_copy_is_found_where_the_runs_are_resampled() -> None:
    with pytest.raises(DataError, match="current is displacement times a constant"):
        given("nnoe", [with_current(coarse(driven()), "displacement", 30.0)], structures=SEEN, rate_hz=100.0)


def test_a_current_with_noise_of_its_own_and_a_copy_in_one_of_two_runs_only_are_learned_from() -> None:
    assert given("nnoe", [with_current(driven(), "force", 1e-3, noise=0.01)], structures=SEEN).candidates
    one, other = with_current(driven(), "displacement", 30.0), replace(driven(2), run_id="other")
    assert given("nnoe", [one, other], structures=SEEN).candidates
