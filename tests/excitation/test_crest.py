"""Low crest factors are reached by phases alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation.crest import crest_factor_of, low_crest, schroeder
from excitation.multisine import random_phase
from excitation.multisine_spec import DisplacementSpec, MultisineSpec
from excitation.portable_math import uniform


@pytest.mark.parametrize("count", [15, 31, 100])
def test_flat_lines_reach_a_crest_factor_of_1_41(count: int) -> None:
    lines, flat = np.arange(1, count + 1), np.ones(count)
    phases = low_crest(lines, flat, goal=1.41)
    fine = np.fft.irfft(np.concatenate([[0], np.exp(2j * np.pi * phases), np.zeros(2**14 - count)]), norm="forward")
    assert np.abs(fine).max() / np.sqrt(np.mean(fine**2)) <= 1.41


@settings(max_examples=10, deadline=None)
@given(st.integers(3, 20), st.integers(0, 99))
def test_the_search_never_ends_above_schroeder(count: int, seed: int) -> None:
    lines, amplitude = np.arange(2, 2 + count), 0.1 + uniform((seed,), count)
    found = low_crest(lines, amplitude, starts=1)
    assert crest_factor_of(lines, amplitude, found) <= crest_factor_of(lines, amplitude, schroeder(amplitude))
    assert found.min() >= 0.0
    assert found.max() < 1.0


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
def test_the_chosen_quantity_gets_the_low_crest(quantity: str) -> None:
    spec = MultisineSpec(
        sample_rate_hz=500.0,
        period_samples=1000,
        displacement=DisplacementSpec(f_min_hz=1.0, f_max_hz=8.0, max_displacement_m=1.0, max_velocity_m_s=100.0),
    )
    chosen = random_phase(replace(spec, phases="crest", crest_of=quantity))  # type: ignore[arg-type]
    names = {"displacement": "displacement_m", "velocity": "velocity_m_s", "acceleration": "acceleration_m_s2"}

    def crest(u: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
        return float(np.abs(u).max() / np.sqrt(np.mean(u * u)))

    assert crest(getattr(chosen, names[quantity])) <= 1.6  # random phases: 2.5 and more
    random = random_phase(spec).displacement.amplitude
    np.testing.assert_allclose(chosen.displacement.amplitude / random, chosen.displacement.amplitude[0] / random[0])
