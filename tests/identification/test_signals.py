"""Derivatives and noise floors of measured channels, against signals whose derivatives and noise are known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import decimate, firwin, lfilter

from identification.derivatives import periodic_kinematics
from identification.noise import between_periods, from_cycles, high_frequency, per_line
from identification.smoothing import smooth_kinematics

Floats = NDArray[np.float64]
RATE = 1000.0


def multisine(samples: int, top_hz: float = 30.0) -> tuple[Floats, Floats, Floats]:
    """One period of x, v and a, summed line by line."""
    t = np.arange(samples) / RATE
    x, v, a = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    rng = np.random.default_rng(samples)
    for k in range(1, int(top_hz * samples / RATE) + 1):
        omega, phase, size = 2 * np.pi * k * RATE / samples, rng.uniform(0, 2 * np.pi), 0.01 / k
        x += size * np.cos(omega * t + phase)
        v -= size * omega * np.sin(omega * t + phase)
        a -= size * omega**2 * np.cos(omega * t + phase)
    return x, v, a


@pytest.mark.parametrize("samples", [1000, 1001, 333, 100])
def test_derivatives_of_a_period_of_any_length_are_exact(samples: int) -> None:
    x, v, a = multisine(samples)
    found = periodic_kinematics(np.tile(x + 0.02, (3, 1)), RATE)
    assert found.x == pytest.approx(x + 0.02, abs=1e-12)
    assert found.v == pytest.approx(v, abs=1e-9 * np.abs(v).max())
    assert found.a == pytest.approx(a, abs=1e-9 * np.abs(a).max())
    assert found.bandwidth_hz == pytest.approx(int(30.0 * samples / RATE) * RATE / samples)


@pytest.mark.parametrize("samples", [2000, 2001])
def test_lines_that_are_noise_are_left_out_of_the_derivatives(samples: int) -> None:
    x, v, _ = multisine(samples)
    noise = 2e-5 * np.random.default_rng(1).standard_normal((5, samples))
    found = periodic_kinematics(x + noise, RATE)
    plain = np.gradient(np.mean(x + noise, axis=0), 1 / RATE)
    assert np.std(found.v - v) < 0.1 * np.std(plain - v)
    assert found.bandwidth_hz <= 30.5
    strays = found.noise[0]
    assert np.std(strays) == pytest.approx(2e-5 * np.sqrt(2 * 60 / samples), rel=0.25)  # in the 60 lines that count


def test_a_mean_that_drifts_from_period_to_period_removes_no_line() -> None:
    x, v, _ = multisine(2000)
    wandering = x + np.array([[0.0], [4e-3], [-3e-3], [1e-3]])
    assert np.std(periodic_kinematics(wandering, RATE).v - v) < 1e-6 * np.std(v)


def test_a_record_without_a_period_is_differentiated_up_to_where_its_motion_ends() -> None:
    t = np.arange(4000) / RATE
    x = 0.01 * np.sin(2 * np.pi * 3.3 * t) + 0.002 * np.sin(2 * np.pi * 17.7 * t + 1.0) + 0.005 * t
    v = 0.01 * 2 * np.pi * 3.3 * np.cos(2 * np.pi * 3.3 * t) + 0.005
    v += 0.002 * 2 * np.pi * 17.7 * np.cos(2 * np.pi * 17.7 * t + 1.0)
    found = smooth_kinematics(x + 1e-6 * np.random.default_rng(2).standard_normal(t.size), RATE)
    assert 17.7 < found.bandwidth_hz < 200.0
    inner = slice(400, -400)
    assert np.std((found.v - v)[inner]) < 0.01 * np.std(v)


def coloured(kind: str, sigma: float, samples: int, seed: int) -> Floats:
    """Noise of a displacement sensor, m: white, falling or rising with frequency."""
    white = np.random.default_rng(seed).standard_normal(samples)
    made = {
        "white": white,
        "red": lfilter([1.0], [1.0, -0.95], white),
        "blue": lfilter([1.0, -0.9], [1.0], white),
    }[kind]
    return np.asarray(sigma * made / np.std(made))


def as_sensed(kind: str, sigma: float, x: Floats, seed: int) -> Floats:
    """A displacement with noise of a colour, or in steps of as much rms."""
    step = np.sqrt(12.0) * sigma
    return np.round(x / step) * step if kind == "steps" else x + coloured(kind, sigma, x.size, seed)


@pytest.mark.parametrize("kind", ["white", "red", "blue", "steps"])
@pytest.mark.parametrize("sigma", [1e-6, 2e-5])
@pytest.mark.parametrize(
    ("rate", "samples", "tone"), [(1000.0, 4000, 3.3), (50.0, 1500, 0.2), (500.0, 5000, 15.0), (1000.0, 20000, 1.7)]
)
def test_the_velocity_of_a_sine_without_a_period_strays_as_is_stated(
    rate: float, samples: int, tone: float, sigma: float, kind: str
) -> None:
    t, squares = np.arange(samples) / rate, []
    for seed in range(6):
        angle = 2 * np.pi * tone * t + seed
        x, v = 0.01 * np.sin(angle), 0.01 * 2 * np.pi * tone * np.cos(angle)
        found = smooth_kinematics(as_sensed(kind, sigma, x, seed), rate)
        inner = slice(samples // 50, -samples // 50)
        squares.append([np.mean((found.v - v)[inner] ** 2), np.mean(found.noise[1] ** 2)])
        assert np.max(np.abs(found.v - v)) < 0.15 * np.max(v)  # at its ends too
    error, stated = np.sqrt(np.mean(squares, axis=0))
    assert error < min(2.5 * stated, 0.004 * 0.01 * 2 * np.pi * tone)


@pytest.mark.parametrize("rate", [100.0, 1000.0])
@pytest.mark.parametrize("slope", [0, 2, 3])
def test_the_velocity_of_a_random_motion_without_a_period_strays_as_is_stated(slope: int, rate: float) -> None:
    rng, samples = np.random.default_rng(slope), 6000
    freq = np.fft.rfftfreq(2 * samples, 1 / rate)
    spectrum = rng.standard_normal(freq.size) + 1j * rng.standard_normal(freq.size)
    spectrum *= (freq > 0.3) * (freq < 20.0) / np.maximum(freq, 0.3) ** slope
    x, v = (np.fft.irfft(spectrum * (2j * np.pi * freq) ** k)[:samples] for k in range(2))
    size = np.std(x)
    found = smooth_kinematics(x + 1e-3 * size * rng.standard_normal(samples), rate)
    inner = slice(samples // 20, -samples // 20)
    assert np.std((found.v - v)[inner]) < min(1.3 * np.std(found.noise[1]), 0.1 * np.std(v))


def test_the_same_motion_has_the_same_band_whatever_its_force_and_its_noise_are() -> None:
    t = np.arange(6000) / RATE
    x = 0.01 * np.sin(2 * np.pi * 2.3 * t) + 0.002 * np.sin(2 * np.pi * 9.1 * t)
    bands = [smooth_kinematics(x + coloured("white", 5e-6, t.size, seed), RATE).bandwidth_hz for seed in range(12)]
    assert max(bands) < 1.5 * min(bands)
    assert min(bands) > 9.1


@pytest.mark.parametrize("samples", [500, 501])
@pytest.mark.parametrize("count", [2, 3, 8])
def test_the_noise_between_periods_is_neither_drift_nor_gain_nor_hum(samples: int, count: int) -> None:
    rng, t = np.random.default_rng(count), np.arange(samples * count) / RATE
    wave = np.tile(300.0 * np.tanh(multisine(samples)[1] / 0.2), count)
    warming = 1.0 - 0.002 * np.repeat(np.arange(count), samples)
    force = warming * wave + 4.0 * t + 3.0 * rng.standard_normal(t.size)
    sigma, tones = between_periods(force.reshape(count, -1))
    assert sigma == pytest.approx(3.0, rel=0.1)
    assert tones == []  # by chance 3e-8 of lines are
    if count == 8:
        sigma, tones = between_periods((force + 5.0 * np.sin(2 * np.pi * 50.3 * t)).reshape(count, -1))
        assert sigma == pytest.approx(3.0, rel=0.1)
        assert min(abs(q * RATE - 50.3) for q in tones) < 0.5


def test_the_noise_of_each_line_is_told_where_it_is_coloured() -> None:
    rng = np.random.default_rng(5)
    spectra = np.fft.rfft(rng.standard_normal((60, 400)), axis=1)
    spectra[:, 100:] *= 0.1
    periods = np.fft.irfft(spectra, 400) + multisine(400)[0]
    found = per_line(periods)
    assert np.sqrt(np.mean(found[5:95] ** 2)) == pytest.approx(np.sqrt(2 / 400), rel=0.05)
    assert np.sqrt(np.mean(found[105:195] ** 2)) == pytest.approx(0.1 * np.sqrt(2 / 400), rel=0.05)


def test_noise_is_found_without_periods_too() -> None:
    t, rng = np.arange(5000) / RATE, np.random.default_rng(3)
    x = 0.01 * np.sin(2 * np.pi * 2.37 * t)
    force = 400.0 * np.tanh(np.cos(2 * np.pi * 2.37 * t) / 0.3) + 2.0 * rng.standard_normal(t.size)
    seen = from_cycles(force, x, RATE)
    assert seen is not None
    assert seen[0] == pytest.approx(2.0, rel=0.05)
    sharp = from_cycles(
        400.0 * np.tanh(np.cos(2 * np.pi * 2.37 * t) / 0.06) + 2.0 * rng.standard_normal(t.size), x, RATE
    )
    assert sharp is not None  # a friction has harmonics up to half the sample rate
    assert sharp[0] == pytest.approx(2.0, rel=0.1)
    assert high_frequency(force)[0] == pytest.approx(2.0, rel=0.05)
    assert from_cycles(force, np.cumsum(rng.standard_normal(t.size)), RATE) is None


def test_reversals_of_friction_in_a_random_motion_are_no_noise() -> None:
    rate, rng = 200.0, np.random.default_rng(11)
    tones = rng.uniform(0.5, 6.0, 12)
    t = np.arange(4000) / rate
    v = np.sum(np.cos(2 * np.pi * tones * t[:, None] + rng.uniform(0.0, 6.3, 12)), axis=1)
    force = 100.0 * np.tanh(v / 0.05) + 20.0 * v + 1.0 * rng.standard_normal(t.size)  # 6 reversals a second
    assert high_frequency(force)[0] < 2.7  # the level of the highest frequencies is 17
    assert high_frequency(force - 100.0 * np.tanh(v / 0.05))[0] == pytest.approx(1.0, rel=0.1)


@pytest.mark.parametrize("sine", [True, False], ids=["sine", "two tones"])
def test_the_noise_without_periods_is_that_of_the_sensor_whatever_filter_the_recorder_had(sine: bool) -> None:
    fast, factor = 8000.0, 8
    t, rng = np.arange(160_000) / fast, np.random.default_rng(8)
    v = np.cos(2 * np.pi * 2.37 * t) + (0.0 if sine else 0.4 * np.cos(2 * np.pi * 5.9 * t + 1.0))
    force = 400.0 * np.tanh(v / 0.3) + 2.0 * np.sqrt(factor) * rng.standard_normal(t.size)
    # Noise of 2 N within half the lower rate, however it gets there.
    linear = lfilter(firwin(201, 0.9 / factor), [1.0], force)[::factor]
    recursive = decimate(force, factor, ftype="iir")
    found = [high_frequency(signal[100:])[0] for signal in (force / np.sqrt(factor), linear, recursive)]
    assert max(found) < 1.5 * min(found)
    assert found == pytest.approx([2.0] * 3, rel=0.3)


@pytest.mark.parametrize("gain", [0.2, 1.0, 7.0])
def test_the_steps_of_a_converter_are_noise_too(gain: float) -> None:
    rng = np.random.default_rng(8)
    t = np.arange(20000) / 1000.0
    force = gain * np.cumsum(rng.standard_normal(t.size)) / 1000.0 + 300.0 * gain * np.sin(2.0 * np.pi * 0.7 * t)
    step = 3.0
    noise, _ = high_frequency(step * np.rint(force / step))
    assert step / np.sqrt(12.0) <= noise < 1.5 * step / np.sqrt(12.0)
