"""Derivatives and noise floors of measured channels, against signals whose derivatives and noise are known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.derivatives import low_pass, periodic_kinematics, smooth_kinematics
from identification.noise import between_periods, from_cycles, high_frequency, per_line

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


def test_a_record_without_a_period_is_differentiated_up_to_the_bandwidth_that_is_stated() -> None:
    t = np.arange(4000) / RATE
    x = 0.01 * np.sin(2 * np.pi * 3.3 * t) + 0.002 * np.sin(2 * np.pi * 17.7 * t + 1.0) + 0.005 * t
    v = 0.01 * 2 * np.pi * 3.3 * np.cos(2 * np.pi * 3.3 * t) + 0.005
    v += 0.002 * 2 * np.pi * 17.7 * np.cos(2 * np.pi * 17.7 * t + 1.0)
    found = smooth_kinematics(x + 1e-6 * np.random.default_rng(2).standard_normal(t.size), RATE)
    assert 17.7 < found.bandwidth_hz < 200.0
    inner = slice(400, -400)
    assert np.std((found.v - v)[inner]) < 0.01 * np.std(v)
    narrow = smooth_kinematics(x, RATE, 8.0)
    assert narrow.bandwidth_hz == 8.0
    assert narrow.x == pytest.approx(low_pass(x, RATE, 8.0), abs=1e-12)


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
    assert from_cycles(force, x, RATE) == pytest.approx(2.0, rel=0.05)
    assert high_frequency(force) == pytest.approx(2.0, rel=0.1)
    assert from_cycles(force, np.cumsum(rng.standard_normal(t.size)), RATE) is None
