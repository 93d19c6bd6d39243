"""The inverse response corrects the error where the response is coherent, and nothing elsewhere."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigctl.drive import (
    IterationSettings,
    corrected,
    frequency_response,
    inverse,
    natural_bandwidth_hz,
    relative_error,
)
from rigctl.errors import IterationError

RATE = 1000.0
N = 4096


def a_multisine(seed: int, lines: int = 120) -> np.ndarray:
    spectrum = np.zeros(N // 2 + 1, dtype=complex)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, lines)
    spectrum[1 : lines + 1] = N * 1e-3 * np.exp(1j * phase)
    return np.fft.irfft(spectrum)


def rig(drive: np.ndarray, delay_s: float, corner_hz: float) -> np.ndarray:
    """A linear rig: a delay and a first-order lag."""
    f = np.fft.rfftfreq(drive.size, 1 / RATE)
    return np.fft.irfft(np.fft.rfft(drive) * np.exp(-2j * np.pi * f * delay_s) / (1 + 1j * f / corner_hz), n=drive.size)


@given(st.integers(0, 99), st.floats(0, 0.006), st.floats(15, 200))
def test_one_full_step_corrects_nearly_all_the_error_of_a_linear_rig(
    seed: int, delay_s: float, corner_hz: float
) -> None:
    target, settings = a_multisine(seed), IterationSettings(gain=1.0, regularisation=1e-3)
    plain = rig(target, delay_s, corner_hz)
    found = frequency_response(target, plain, RATE, periodic=True)
    band = natural_bandwidth_hz(target, RATE)
    drive = corrected(target, target - plain, inverse(found, settings, band), settings.gain)
    after = relative_error(rig(drive, delay_s, corner_hz), target)
    assert after < 0.1 * relative_error(plain, target) + 1e-6


@given(st.integers(0, 99))
def test_nothing_is_corrected_above_the_bandwidth(seed: int) -> None:
    target = a_multisine(seed)
    found = frequency_response(target, rig(target, 0.003, 40.0), RATE, periodic=True)
    inverted = inverse(found, IterationSettings(), 10.0)
    assert np.all(inverted[found.frequency_hz >= 12.5] == 0)
    assert np.all(np.abs(inverted[(found.frequency_hz > 0.5) & (found.frequency_hz < 10)]) > 0.5)


def test_where_the_rig_does_not_answer_the_inverse_stays_bounded() -> None:
    target, settings = a_multisine(1), IterationSettings(regularisation=0.05)
    found = frequency_response(target, rig(target, 0.0, 0.5), RATE, periodic=True)
    assert np.max(np.abs(inverse(found, settings, 100.0))) <= 0.5 / settings.regularisation + 1e-9


def test_motion_that_the_drive_does_not_explain_is_not_corrected() -> None:
    target = a_multisine(1)
    foreign = 3e-2 * np.random.default_rng(2).standard_normal(N)
    found = frequency_response(target, foreign, RATE, periodic=True)
    assert np.mean(np.abs(inverse(found, IterationSettings(regularisation=1.0), 25.0)[4:100])) < 0.1


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"gain": 0.0}, "gain is 0"),
        ({"gain": float("nan")}, "gain is nan"),
        ({"tolerance": 2.0}, "tolerance is 2"),
        ({"bandwidth_hz": -1.0}, "bandwidth is -1"),
        ({"most": 0}, "iterations is 0"),
    ],
)
def test_numbers_with_which_nothing_can_converge_are_refused_in_one_line(wrong: dict[str, float], words: str) -> None:
    with pytest.raises(IterationError, match=words) as caught:
        IterationSettings(**wrong)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
