"""The correction removes the error where the response is known, and nothing elsewhere; two channels together."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigctl.blocks import blocks_of
from rigctl.drive import IterationSettings, correction, natural_bandwidth_hz, relative_error, roll_off
from rigctl.errors import IterationError
from rigctl.response import measure, response

RATE = 1000.0
N = 2048
BLOCKS = blocks_of(2 * N, N, RATE, 1)
PAIR = blocks_of(2 * N, N, RATE, 2)


def a_multisine(seed: int, lines: int = 60) -> np.ndarray:
    """One period of unit standard deviation."""
    spectrum = np.zeros(N // 2 + 1, dtype=complex)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, lines)
    spectrum[1 : lines + 1] = np.exp(1j * phase)
    x = np.fft.irfft(spectrum)
    return x / x.std()


def a_rig(delay_s: float, corner_hz: float) -> np.ndarray:
    """Response of a linear rig, (K,): a delay and a first-order lag."""
    f = np.fft.rfftfreq(N, 1 / RATE)
    return np.exp(-2j * np.pi * f * delay_s) / (1 + 1j * f / corner_hz)


def played(drive: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """What a rig with gains (K, C, C) does with one period (N, C); given twice, the second one steady."""
    return np.fft.irfft(np.einsum("kic,kc->ki", gains, np.fft.rfft(drive, axis=0)), n=N, axis=0)


def twice(period: np.ndarray) -> np.ndarray:
    return np.concatenate([period, period])


def one_step(target: np.ndarray, gains: np.ndarray, bandwidth_hz: float, **more: float) -> np.ndarray:
    """The drive after one correction, (N, C)."""
    blocks = BLOCKS if target.shape[1] == 1 else PAIR
    plain = played(target, gains)
    spectra = (blocks.tapered(twice(values)) for values in (target, plain))
    found = response(blocks.lines, measure(blocks.lines, *spectra))
    roll = roll_off(found.frequency_hz, np.full(target.shape[1], bandwidth_hz))
    step = correction(found, blocks.spectra(twice(target - plain)), more.get("regularisation", 1e-3), roll)
    return target + blocks.record(step)[:N]


@settings(max_examples=25)
@given(st.integers(0, 99), st.floats(0, 0.006), st.floats(15, 200))
def test_one_step_corrects_nearly_all_the_error_of_a_linear_rig(seed: int, delay_s: float, corner_hz: float) -> None:
    target, gains = a_multisine(seed)[:, None], a_rig(delay_s, corner_hz)[:, None, None]
    drive = one_step(target, gains, natural_bandwidth_hz(target[:, 0], RATE))
    before = relative_error(played(target, gains), target)
    assert relative_error(played(drive, gains), target) < 0.1 * before + 1e-6


@settings(max_examples=25)
@given(st.integers(0, 99), st.floats(0, 0.006), st.floats(15, 200), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_two_channels_that_disturb_each_other_are_corrected_together(
    seed: int, delay_s: float, corner_hz: float, one: float, other: float
) -> None:
    target = np.stack([a_multisine(seed), a_multisine(seed + 100)], axis=1)
    own = a_rig(delay_s, corner_hz)
    gains = np.moveaxis(np.array([[own, one * own], [other * own, a_rig(0.001, 80.0)]]), 2, 0)
    drive = one_step(target, gains, natural_bandwidth_hz(target[:, 0], RATE))
    before, after = (played(values, gains) for values in (target, drive))
    for channel in range(2):
        error = relative_error(before[:, channel], target[:, channel])
        assert relative_error(after[:, channel], target[:, channel]) < 0.15 * error + 1e-3


@settings(max_examples=25)
@given(st.integers(0, 99))
def test_two_proportional_commands_are_each_corrected_by_their_own_channel(seed: int) -> None:
    """One sine in both channels says nothing of how one channel disturbs the other: it is taken as not."""
    both = np.sqrt(2) * np.sin(2 * np.pi * (seed + 2) * np.arange(N) / N)
    target = np.stack([both, both], axis=1)
    gains = a_rig(0.003, 30.0)[:, None, None] * np.eye(2)
    drive = one_step(target, gains, 60.0)
    assert relative_error(played(drive, gains), target) < 0.02


@settings(max_examples=25)
@given(st.integers(0, 99))
def test_nothing_is_corrected_above_the_bandwidth(seed: int) -> None:
    target = a_multisine(seed)[:, None]
    change = np.abs(np.fft.rfft(one_step(target, a_rig(0.003, 40.0)[:, None, None], 10.0) - target, axis=0))[:, 0]
    f = np.fft.rfftfreq(N, 1 / RATE)
    assert np.all(change[f >= 12.5] <= 1e-9 * change.max())
    assert np.all(change[(f > 0.5) & (f < 10)] > 0)


def test_where_the_rig_does_not_answer_the_correction_stays_bounded() -> None:
    target, least = a_multisine(1)[:, None], 0.05
    gains = a_rig(0.0, 0.5)[:, None, None]
    change = one_step(target, gains, 100.0, regularisation=least) - target
    assert np.std(change) <= 0.5 / least * np.std(target - played(target, gains))


@settings(max_examples=25)
@given(st.integers(0, 99), st.floats(0.3, 30.0))
def test_motion_that_the_drive_does_not_explain_is_corrected_less_and_without_coherence_hardly(
    seed: int, foreign: float
) -> None:
    target, random = a_multisine(seed)[:, None], np.random.default_rng(seed)
    drive, answer = target, target + foreign * random.standard_normal((N, 1))
    spectra = (BLOCKS.tapered(twice(values)) for values in (drive, answer))
    found = response(BLOCKS.lines, measure(BLOCKS.lines, *spectra))
    error = np.ones((N // 2 + 1, 1), dtype=complex)
    weight = np.abs(correction(found, error, 0.05, np.ones_like(error, dtype=float)) * found.gain[:, 0])
    known = np.abs(found.gain[:, 0]) ** 2
    least = np.asarray(found.variance[:, 0].real)
    np.testing.assert_allclose(weight, known / (known + least + 0.05**2), atol=1e-9)
    assert np.all(weight[70:] < 0.2), "no drive there"


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
