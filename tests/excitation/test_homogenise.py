"""Homogenised designs change phases only, and cover the working range."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from excitation.coverage import coverage
from excitation.coverage_cost import Axis, CoverageCost, SoftLimit, plain_modes
from excitation.direct import optimise_phases
from excitation.homogenise import homogenised
from excitation.lbfgs import minimise
from excitation.multisine import Period, as_excitation, random_phase
from excitation.multisine_spec import CurrentSpec, DisplacementSpec, HomogeniseSpec, MultisineSpec
from excitation.periodic import Multitone
from excitation.portable_math import uniform
from excitation.synthesis import excitation_from_config

PAPER = MultisineSpec(
    sample_rate_hz=1000.0,
    period_samples=8192,
    displacement=DisplacementSpec(
        f_min_hz=0.25, f_max_hz=30.0, spectrum="quarter-car", max_displacement_m=0.06, max_velocity_m_s=1.5
    ),
    current=CurrentSpec(f_min_hz=0.25, f_max_hz=100.0, min_a=0.3, max_a=1.6),
)
SMALL = replace(PAPER, sample_rate_hz=500.0, period_samples=2000)


def index_of(spec: MultisineSpec, period: Period) -> float:
    return coverage([period.variable(name) for name in spec.covered_variables], spec.grid).index


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_the_direct_design_covers_better_than_half_a_percent(seed: int) -> None:
    spec = replace(PAPER, seed=seed, homogenise=HomogeniseSpec())
    period = homogenised(spec)
    assert index_of(spec, period) <= 0.5
    assert np.abs(period.displacement_m).max() <= 0.06
    assert np.abs(period.velocity_m_s).max() >= 1.35  # random phases and Duym's reach about 0.8 within 6 cm


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_duyms_iteration_reaches_the_papers_figure(seed: int) -> None:
    spec = replace(PAPER, seed=seed, homogenise=HomogeniseSpec(method="duym"))
    assert index_of(spec, homogenised(spec)) <= 5.6


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(
    st.integers(0, 2**32),
    st.sampled_from(["direct", "duym"]),
    st.sampled_from(["all", "odd", "odd-random"]),
    st.sampled_from([("velocity", "current"), ("displacement", "velocity"), ("displacement", "velocity", "current")]),
)
def test_only_phases_change(seed: int, method: Any, lines: Any, variables: Any) -> None:
    how = HomogeniseSpec(method=method, variables=variables, grid=(5,) * len(variables), iterations=8)
    spec = replace(SMALL, seed=seed, displacement=replace(SMALL.displacement, lines=lines), homogenise=how)
    before, after = random_phase(spec), homogenised(spec)
    assert before.current is not None
    assert after.current is not None
    for one, other in ((before.displacement, after.displacement), (before.current, after.current)):
        assert np.array_equal(one.lines, other.lines)
        np.testing.assert_allclose(
            one.amplitude / one.amplitude.sum(), other.amplitude / other.amplitude.sum(), rtol=1e-12
        )
    spectrum = np.abs(np.fft.rfft(after.displacement_m))
    shape = spectrum[after.displacement.lines] / spectrum.sum()
    asked = before.displacement.amplitude / before.displacement.amplitude.sum()
    np.testing.assert_allclose(shape / shape.sum(), asked, rtol=1e-9)
    assert np.delete(spectrum, after.displacement.lines).max() <= 1e-12 * spectrum.max()
    assert np.abs(after.displacement_m).max() <= spec.displacement.max_displacement_m
    assert np.abs(after.velocity_m_s).max() <= spec.displacement.max_velocity_m_s


@pytest.mark.parametrize(
    "variables",
    [
        ("displacement", "velocity"),
        pytest.param(("displacement", "velocity", "current"), marks=pytest.mark.slow),
        ("velocity", "current"),
    ],
)
def test_the_direct_design_beats_duym_and_random_phases(variables: Any) -> None:
    grid = (6,) * len(variables)
    direct = replace(SMALL, seed=4, homogenise=HomogeniseSpec(variables=variables, grid=grid))
    published = replace(SMALL, seed=4, homogenise=HomogeniseSpec(method="duym", variables=variables, grid=grid))
    ours, duym = index_of(direct, homogenised(direct)), index_of(published, homogenised(published))
    assert ours < duym < index_of(direct, random_phase(direct))


def test_the_binding_limit_is_named_and_reached() -> None:
    spec = replace(SMALL, displacement=replace(SMALL.displacement, max_velocity_m_s=0.1), homogenise=HomogeniseSpec())
    made = as_excitation(spec, homogenised(spec), "homogenised")
    assert made.figures["binding_limit"] == "velocity"
    before: Any = excitation_from_config(made.design).figures["coverage_before"]
    assert before > 10 * float(str(made.figures["coverage"]))
    reached: Any = made.figures["limits"]
    assert reached["velocity"]["reached"] == pytest.approx(0.1, rel=1e-6)
    assert reached["displacement"]["reached"] < 0.06


def axes_of(tones: list[Multitone]) -> tuple[list[Axis], list[SoftLimit]]:
    unit = [t.amplitude * np.sqrt(2 / 3 / np.sum(t.amplitude**2)) for t in tones]
    axes = [Axis(tones=0, amplitude=unit[0], offset_turns=0.25), Axis(tones=1, amplitude=unit[1], offset_turns=0.0)]
    soft = [SoftLimit(axis=Axis(tones=0, amplitude=unit[0], offset_turns=0.0), limit=0.4, weight=2.0)]
    return axes, soft


def tones_of(samples: int, seed: int) -> list[Multitone]:
    return [
        Multitone(
            period_samples=samples,
            lines=np.arange(2, 2 + count, dtype=np.int64),
            amplitude=1.0 / np.arange(2.0, 2.0 + count),
            phase_turns=uniform((seed, count), count),
        )
        for count in (9, 14)
    ]


@settings(max_examples=10, deadline=None)
@given(st.integers(60, 400), st.integers(0, 999), st.booleans())
def test_the_gradient_is_that_of_the_value(samples: int, seed: int, three: bool) -> None:
    tones = tones_of(samples, seed)
    axes, soft = axes_of(tones)
    if three:
        axes = [*axes, replace(axes[0], offset_turns=0.0)]
    problem = CoverageCost(tones, axes, soft, plain_modes(8, len(axes)), 1, 1000.0 if three else 30.0)
    phases = np.concatenate([t.phase_turns for t in tones])
    _, gradient = problem.value_and_gradient(phases)
    along = uniform((seed, 77), phases.size) - 0.5
    step = 1e-6
    ahead, behind = (problem.value_and_gradient(phases + s * step * along)[0] for s in (1, -1))
    assert float(gradient @ along) == pytest.approx((ahead - behind) / (2 * step), rel=1e-5, abs=1e-7)


def test_modes_are_means_of_cosines_whatever_the_number_of_samples() -> None:
    from excitation.modes import sums_2d, sums_3d

    for samples in (1, 127, 128, 129, 1000):
        x, y, z = (2.6 * uniform((samples, k), samples) - 1.3 for k in range(3))
        m = np.arange(8)[:, None]
        cx, cy, cz = (np.cos(m * np.pi * (u + 1) / 2) for u in (x, y, z))
        np.testing.assert_allclose(sums_2d(x, y, 8), cx @ cy.T, atol=1e-11)
        np.testing.assert_allclose(sums_3d(x, y, z, 8), np.einsum("pn,qn,rn->pqr", cx, cy, cz), atol=1e-11)


def test_the_result_does_not_depend_on_how_many_threads_share_the_work() -> None:
    """Many samples are worked on in fixed chunks: one thread must give the bits that several give."""
    tones = tones_of(2**16, 3)
    axes, soft = axes_of(tones)

    one, several = (
        np.concatenate(optimise_phases(tones, axes, soft, (10, 10), 3, threads=threads)) for threads in (1, 4)
    )
    assert np.array_equal(one, several)


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 12), st.integers(0, 999))
def test_the_minimiser_finds_the_bottom_of_a_bowl(size: int, seed: int) -> None:
    bottom, stiffness = uniform((seed, 1), size), 0.1 + 10 * uniform((seed, 2), size)

    def bowl(x: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        away = x - bottom
        return float(np.sum(stiffness * away**2)), 2 * stiffness * away

    found = minimise(bowl, np.zeros(size), iterations=200, first_step=0.1, tolerance=1e-14)
    np.testing.assert_allclose(found.x, bottom, atol=1e-5)


def test_the_minimiser_follows_a_bent_valley() -> None:
    def rosenbrock(x: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        a, b = float(x[0]), float(x[1])
        slope = np.array([-2 * (1 - a) - 400 * a * (b - a * a), 200 * (b - a * a)])
        return (1 - a) ** 2 + 100 * (b - a * a) ** 2, slope

    found = minimise(rosenbrock, np.array([-1.2, 1.0]), iterations=500, first_step=0.1, tolerance=1e-16)
    np.testing.assert_allclose(found.x, [1.0, 1.0], atol=1e-4)
