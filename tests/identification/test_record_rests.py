"""What counts as rest: where the displacement as it was measured does not move, however its filtered velocity rings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.record import record_from_run
from rigctl.runfile import Run
from tests.identification.specimens import run

Floats = NDArray[np.float64]
RATE_HZ = 200.0
STEP_M = 2e-6


def captured(x: Floats, noise: float = 0.0, step: float = STEP_M) -> Run:
    """A run without a period of a damper under a displacement that a converter with steps has read."""
    rng = np.random.default_rng(4)
    read = x + noise * rng.standard_normal(x.size)
    read = np.round(read / step) * step if step else read
    force = 70.0 * np.gradient(x) * RATE_HZ + 2.0 * rng.standard_normal(x.size)
    channels, units = {"displacement": read, "force": force}, {"displacement": "m", "force": "N"}
    return replace(run("none", 0, 3), sample_rate_hz=RATE_HZ, period_samples=0, channels=channels, units=units)


def triangle(frequency: float, peak: float, seconds: float, rest_s: float) -> tuple[Floats, NDArray[np.bool_]]:
    """A triangle between two rests, and where it rests."""
    t = np.arange(round((seconds + 2.0 * rest_s) * RATE_HZ)) / RATE_HZ - rest_s
    still = (t < 0.0) | (t > seconds)
    turn = np.clip(t, 0.0, seconds) * frequency
    return peak * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * turn)), still


def left_out(given: Run) -> NDArray[np.bool_]:
    """The samples that are left out though they are not near an end."""
    record = record_from_run(given)
    if record.period:  # whole periods are compared
        return np.zeros(record.force.size, dtype=bool)
    counted = np.zeros(record.force.size, dtype=bool)
    counted[record.window] = True
    ends = np.zeros_like(counted)
    ends[: counted.size // 20] = ends[-(counted.size // 20) :] = True
    return ~counted & ~ends


@pytest.mark.parametrize("frequency", [0.1, 0.3, 1.0, 3.0])
@pytest.mark.parametrize(("noise", "step"), [(0.0, STEP_M), (0.0, 0.0), (2e-6, STEP_M), (1e-5, 0.0)])
def test_the_rests_before_and_after_a_triangle_are_left_out_and_its_corners_are_not(
    frequency: float, noise: float, step: float
) -> None:
    x, still = triangle(frequency, 0.04, 10.0, 2.0)
    out = left_out(captured(x, noise, step))
    inner = slice(x.size // 20, -(x.size // 20))
    assert np.mean(out[inner] == still[inner]) > 0.99


@pytest.mark.parametrize("speed", [2e-5, 2e-4, 2e-3])
@pytest.mark.parametrize(("noise", "step"), [(0.0, STEP_M), (0.0, 0.0), (2e-6, STEP_M), (2e-6, 0.0)])
def test_a_slow_ramp_is_no_rest(speed: float, noise: float, step: float) -> None:
    t = np.arange(4000) / RATE_HZ
    x = speed * t + 0.01 * np.sin(2.0 * np.pi * 0.73 * np.maximum(t - 14.0, 0.0))
    assert not np.any(left_out(captured(x, noise, step)))


@pytest.mark.parametrize("frequency", [0.0107, 0.1013, 1.0309, 10.037])
@pytest.mark.parametrize(("noise", "step"), [(0.0, STEP_M), (0.0, 0.0), (2e-6, STEP_M), (1e-5, 0.0), (0.0, 2e-4)])
def test_the_turning_points_of_a_sine_are_no_rests(frequency: float, noise: float, step: float) -> None:
    t = np.arange(round(max(10.0, 3.3 / frequency) * RATE_HZ)) / RATE_HZ
    assert not np.any(left_out(captured(0.02 * np.sin(2.0 * np.pi * frequency * t), noise, step)))


def test_a_rest_at_which_a_machine_arrives_slowly_is_left_out() -> None:
    t = np.arange(2400) / RATE_HZ
    moving = np.clip(t - 1.0, 0.0, 5.0)
    x = 0.03 * np.sin(4.6 * np.pi * moving) + 0.005 * (1.0 - np.exp(-np.maximum(t - 6.0, 0.0) / 0.2))
    out = left_out(captured(x, 1e-6))
    assert np.mean(out[round(8.2 * RATE_HZ) : round(11.4 * RATE_HZ)]) > 0.99
    assert not np.any(out[round(1.1 * RATE_HZ) : round(6.9 * RATE_HZ)])
