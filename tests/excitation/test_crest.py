"""Low crest factors are reached by phases alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation.configuration import to_spec
from excitation.crest import crest_factor_of, low_crest, schroeder
from excitation.force_estimate import ForceEstimate
from excitation.joint_crest import Limited, _Norm, low_shares
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


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 12), st.integers(0, 999), st.sampled_from([4, 16, 64]))
def test_the_gradient_of_the_joint_norm_is_that_of_its_value(count: int, seed: int, exponent: int) -> None:
    lines = np.arange(1, 1 + count)
    quantities = [
        Limited(amplitude=0.1 + uniform((seed, n), count), turns=uniform((seed, n, 1), count), limit=1.0 + n)
        for n in range(3)
    ]
    norm = _Norm(lines, quantities)
    phases, along = uniform((seed, 7), count), uniform((seed, 8), count) - 0.5
    ahead, behind = (norm(exponent, phases + step * along)[0] for step in (1e-6, -1e-6))
    assert float(norm(exponent, phases)[1] @ along) == pytest.approx((ahead - behind) / 2e-6, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("count", [31, 100])
def test_flat_lines_reach_a_crest_factor_of_1_38_in_the_joint_search(count: int) -> None:
    lines, flat = np.arange(1, count + 1), np.ones(count)
    limited = Limited(amplitude=flat, turns=np.zeros(count), limit=float(np.sqrt(0.5 * count)))
    phases = low_shares(lines, [limited], goal=1.379)
    assert crest_factor_of(lines, flat, phases) <= 1.38


SPEC = MultisineSpec(
    sample_rate_hz=500.0,
    period_samples=1024,
    displacement=DisplacementSpec(
        f_min_hz=0.5, f_max_hz=12.0, spectrum="road", max_displacement_m=0.03, max_velocity_m_s=0.8,
        max_acceleration_m_s2=20.0,
    ),
)  # fmt: skip


@pytest.mark.slow
def test_the_joint_search_uses_more_of_the_limits_than_any_single_quantity() -> None:
    def speed(crest_of: Any) -> float:
        return float(random_phase(replace(SPEC, phases="crest", crest_of=crest_of)).velocity_m_s.std())

    assert speed("limits") > 1.2 * max(speed(one) for one in ("displacement", "velocity", "acceleration"))


def test_the_joint_search_keeps_the_force_within_its_limit() -> None:
    estimate = ForceEstimate(max_n=900.0, damping_n_s_m=2000.0, stiffness_n_m=20_000.0, mass_kg=15.0, friction_n=50.0)
    period = random_phase(replace(SPEC, phases="crest", force=estimate))
    force = (
        20_000.0 * period.displacement_m + 2000.0 * period.velocity_m_s + 15.0 * period.acceleration_m_s2
    )  # and ± 50 N of friction
    assert np.abs(force).max() <= 850.0
    assert np.abs(force).max() == pytest.approx(850.0, rel=5e-3)
    assert {limit.name for limit in period.limits if limit.used > 0.99} >= {"force"}


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


@pytest.mark.slow
def test_a_thousand_flat_lines_of_the_chosen_quantity_are_as_low_as_a_few() -> None:
    asked = _flat(1000, period_samples=2**14)
    period = random_phase(asked)
    crest = crest_factor_of(period.displacement.lines, np.ones(1000), period.displacement.phase_turns)
    assert crest <= 1.38


def test_realisations_of_a_chosen_quantity_have_phases_of_their_own() -> None:
    asked = _flat(31, period_samples=1000)
    one, other = (random_phase(replace(asked, realisation=number)) for number in (0, 1))
    turned = one.displacement_m @ other.displacement_m / np.sum(one.displacement_m**2)
    assert abs(turned) < 0.9


def _flat(count: int, period_samples: int) -> MultisineSpec:
    """So many lines from the first on, displacement alone kept flat."""
    spacing = 1000.0 / period_samples
    config = {
        "sample_rate": 1000.0, "period_samples": period_samples, "phases": "crest", "crest_of": "displacement",
        "displacement": {
            "f_min": spacing, "f_max": (count + 0.2) * spacing, "spectrum": "flat",
            "max_displacement": 0.02, "max_velocity": 5.0,
        },
    }  # fmt: skip
    return to_spec(MultisineSpec, config)
