"""A design fills the range that limits and rig allow, and states what it is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, chisquare

from excitation.configuration import to_spec
from excitation.coverage import coverage, coverage_within
from excitation.errors import DesignError
from excitation.homogenise import homogenised
from excitation.multisine import as_excitation, random_phase
from excitation.multisine_spec import CurrentSpec, DisplacementSpec, HomogeniseSpec, MultisineSpec
from excitation.portable_math import uniform
from excitation.range_figures import even_over
from excitation.region import Region
from excitation.response import Lag, ResponseTable, RigResponse, gains
from excitation.synthesis import excitation_from_config

PAPER = MultisineSpec(
    sample_rate_hz=1000.0,
    period_samples=8192,
    displacement=DisplacementSpec(
        f_min_hz=0.25, f_max_hz=30.0, spectrum="quarter-car", max_displacement_m=0.06, max_velocity_m_s=1.5
    ),
    current=CurrentSpec(f_min_hz=0.25, f_max_hz=100.0, min_a=0.3, max_a=1.6),
    homogenise=HomogeniseSpec(),
)
PLANES = [("velocity", "current"), ("displacement", "velocity"), ("velocity", "acceleration")]


def figures(spec: MultisineSpec) -> dict[str, Any]:
    return dict(as_excitation(spec, homogenised(spec), "homogenised").figures)


def with_motion(spec: MultisineSpec, **changes: Any) -> MultisineSpec:
    return replace(spec, displacement=replace(spec.displacement, **changes))


def points_of(count: int, seed: int) -> list[np.ndarray[Any, Any]]:
    """Points spread over the disc, independent and uniform."""
    radius, turns = np.sqrt(uniform((seed, 0), count)), 2.0 * np.pi * uniform((seed, 1), count)
    return [radius * np.cos(turns), radius * np.sin(turns)]


@pytest.mark.parametrize(
    ("grid", "x", "v"), [((6, 6), 1.0, 1.0), ((10, 10), 0.01, 5.0), ((4, 12), 5.0, 0.03)], ids=["6x6", "10x10", "4x12"]
)
def test_an_even_filling_of_an_ellipse_shows_only_the_counting_noise(grid: tuple[int, int], x: float, v: float) -> None:
    """The index times the number of samples is χ² of one degree less than there are cells: its law, on 40 seeds.

    Each lies between the quantiles of 1e-7 and 1 - 1e-7, and their mean within five standard deviations of the mean.
    By chance a change of the seeds would fail one of the three cases with a probability of 3e-5.
    """
    ellipse = Region(names=("displacement", "velocity"), low=(-x, -v), high=(x, v), pair=(0, 1))
    freedom = grid[0] * grid[1] - 1
    found = []
    for seed in range(40):
        points = points_of(20_000, seed)
        counted = coverage_within(ellipse, [x * points[0], v * points[1]], grid)
        assert counted.outside == 0
        found.append(20_000 * counted.index / 100.0)
    assert chi2.ppf(1e-7, freedom) < min(found)
    assert max(found) < chi2.isf(1e-7, freedom)
    assert np.mean(found) == pytest.approx(freedom, abs=5.0 * np.sqrt(2.0 * freedom / 40))


def test_samples_outside_the_range_count_against_it() -> None:
    box = Region(names=("velocity", "current"), low=(-1.0, 0.0), high=(1.0, 1.0))
    v, i = 2.0 * uniform((1,), 5000) - 1.0, uniform((2,), 5000)
    inside = coverage_within(box, [v, i], (5, 5))
    half_out = coverage_within(box, [v, np.where(v > 0, i, 2.0)], (5, 5))
    assert half_out.outside == pytest.approx(2500, abs=200)
    assert half_out.index > inside.index + 40.0


def test_the_index_is_pearsons_statistic_of_equal_filling_over_the_number_of_samples() -> None:
    x, y = uniform((3, 0), 4000), uniform((3, 1), 4000) ** 1.3
    found = coverage([x, y], (8, 9))
    assert found.index == pytest.approx(100.0 * chisquare(found.counts.ravel()).statistic / 4000)


def test_an_even_filling_of_a_smaller_box_leaves_the_cells_outside_it_empty() -> None:
    wanted = Region(names=("velocity", "current"), low=(-1.0, 0.0), high=(1.0, 1.0))
    half = Region(names=("velocity", "current"), low=(-0.5, 0.0), high=(0.5, 1.0))
    disc = Region(names=("displacement", "velocity"), low=(-1.0, -1.0), high=(1.0, 1.0), pair=(0, 1))
    box = replace(disc, pair=None)
    assert even_over(wanted, wanted, (10, 10)) == pytest.approx(0.0, abs=1e-9)
    assert even_over(half, wanted, (4, 10)) == pytest.approx(100.0)
    assert even_over(disc, box, (50, 50)) == pytest.approx(100.0 * (4.0 / np.pi - 1.0), abs=3.0)


@pytest.mark.parametrize("variables", PLANES)
def test_each_plane_is_covered_better_than_half_a_percent_over_what_can_be_achieved(variables: Any) -> None:
    spec = replace(PAPER, homogenise=HomogeniseSpec(variables=variables))
    made = figures(spec)
    assert made["coverage_achievable"] <= 0.5
    assert made["limits"][made["binding_limit"]]["reached"] <= made["limits"][made["binding_limit"]]["limit"]


@pytest.mark.slow
def test_three_variables_are_covered_better_than_independent_samples_would() -> None:
    how = HomogeniseSpec(variables=("displacement", "velocity", "current"), grid=(6, 6, 6), iterations=150)
    spec = replace(PAPER, homogenise=how)
    assert figures(spec)["coverage_achievable"] < 100.0 * 215 / 8192


def test_what_the_limits_allow_is_asked_of_the_whole_range_first() -> None:
    made = figures(PAPER)
    assert made["achievable_range"] == made["asked_range"] == {"velocity": [-1.5, 1.5], "current": [0.3, 1.6]}
    assert made["coverage_asked"] <= 0.5


def test_where_the_displacement_binds_the_range_is_narrower_and_still_covered() -> None:
    made = figures(with_motion(PAPER, max_displacement_m=0.03))
    assert made["binding_limit"] == "displacement"
    assert 0.5 < made["achievable_range"]["velocity"][1] < 1.0
    assert made["coverage_achievable"] <= 0.5
    assert made["coverage_asked"] == pytest.approx(made["coverage_asked_even"], rel=0.1)


@pytest.mark.slow
def test_the_whole_range_can_be_asked_for_all_the_same() -> None:
    narrow = with_motion(PAPER, max_displacement_m=0.05)
    whole = replace(narrow, homogenise=HomogeniseSpec(range="asked"))
    assert figures(whole)["achievable_range"] == figures(whole)["asked_range"]


LAG = RigResponse(displacement=Lag(bandwidth_hz=50.0), current=Lag(bandwidth_hz=50.0))


def test_a_design_that_knows_the_rigs_lag_covers_at_the_damper() -> None:
    made = figures(replace(PAPER, response=LAG))
    ignorant = homogenised(PAPER)
    told = replace(ignorant, at_damper=behind(PAPER, ignorant))
    at_damper = coverage([told.received("velocity"), told.received("current")], (10, 10)).index
    assert made["coverage_at_damper"] <= 0.5 < 1.5 < at_damper


def behind(spec: MultisineSpec, period: Any) -> dict[str, np.ndarray[Any, Any]]:
    """What a damper behind the lag gets, by the DFT of the samples."""
    made = {}
    for name in ("velocity", "current"):
        spectrum = np.fft.rfft(period.variable(name))
        frequency = np.arange(spectrum.size) * spec.sample_rate_hz / spec.period_samples
        made[name] = np.fft.irfft(spectrum / (1.0 + 1j * frequency / 50.0), n=spec.period_samples)
    return made


def test_what_the_damper_gets_is_the_command_through_the_response() -> None:
    period = random_phase(replace(PAPER, homogenise=None, response=LAG))
    for name, values in behind(PAPER, period).items():
        np.testing.assert_allclose(period.received(name), values, atol=1e-9)  # type: ignore[arg-type]


def test_a_rig_with_a_resonance_keeps_the_limits_at_the_damper() -> None:
    ringing = RigResponse(displacement=Lag(bandwidth_hz=15.0, order=2, damping_ratio=0.2))
    period = random_phase(replace(PAPER, homogenise=None, response=ringing))
    assert np.abs(period.received("velocity")).max() <= 1.5
    assert np.abs(period.velocity_m_s).max() <= 1.5
    assert period.binding_limit.name == "velocity_at_damper"


def test_a_measured_response_is_read_as_it_was_made() -> None:
    frequency = np.linspace(0.5, 40.0, 400)
    lag = Lag(bandwidth_hz=20.0, order=2, damping_ratio=0.5, delay_s=0.002)
    gain, turns = gains(lag, frequency)
    phase = 360.0 * np.unwrap(turns, period=1.0)
    known = ResponseTable(frequency_hz=tuple(frequency), gain=tuple(gain), phase_deg=tuple(phase))
    between = np.linspace(1.0, 39.0, 77)
    for one, other in zip(gains(known, between), gains(lag, between), strict=True):
        np.testing.assert_allclose(np.exp(2j * np.pi * one), np.exp(2j * np.pi * other), atol=2e-3)


CONFIG: dict[str, Any] = {
    "kind": "homogenised",
    "sample_rate": 500.0,
    "period_samples": 2000,
    "displacement": {"f_min": 0.5, "f_max": 20.0, "max_displacement": 0.06, "max_velocity": 1.5},
    "current": {"f_min": 0.5, "f_max": 50.0, "min": 0.3, "max": 1.6},
}


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"response": {}}, "response is empty"),
        ({"response": {"displacement": {"bandwidth": -3.0}}}, "bandwidth is -3"),
        ({"response": {"displacement": {"frequency": [1.0, 2.0], "gain": [1.0], "phase": [0.0, 0.0]}}}, "same number"),
        ({"response": {"displacement": {"frequency": [2.0, 1.0], "gain": [1.0, 1.0], "phase": [0.0, 0.0]}}}, "rise"),
        ({"response": {"displacement": {"frequency": [0.1, 99.0], "gain": [1.0, 0.0], "phase": [0.0, 0.0]}}}, "gain"),
        (
            {"response": {"displacement": {"frequency": [0.1, 99.0], "gain": [1.0, 1.0], "phase": [0.0, -270.0]}}},
            "270°",
        ),
        ({"response": {"displacement": {"frequency": [0.1, 9.0], "gain": [1.0, 1.0], "phase": [0.0, -9.0]}}}, "span"),
        ({"homogenise": {"variables": ["displacement", "acceleration"]}}, "cannot be covered together"),
        ({"homogenise": {"variables": ["velocity", "jerk"]}}, "jerk"),
        ({"homogenise": {"range": "all"}}, "range"),
        ({"force": {"max": 1000.0}}, "no damping, stiffness or mass"),
        ({"force": {"max": 1000.0, "damping": 10.0, "friction": 1000.0}}, "friction is 1000 N"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_line(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(DesignError, match=said) as refused:
        excitation_from_config(CONFIG | wrong)
    assert "\n" not in str(refused.value)


def test_a_design_that_was_written_out_before_ranges_were_known_plays_the_same_samples() -> None:
    """Earlier releases wrote every key but `range`; what they filled was the range that the motion reached."""
    made = excitation_from_config({**CONFIG, "homogenise": {"range": "reached", "iterations": 20}})
    how = {key: value for key, value in dict(made.design["homogenise"]).items() if key != "range"}  # type: ignore[call-overload]
    again = excitation_from_config({**made.design, "homogenise": how})
    assert np.array_equal(made.displacement_m, again.displacement_m)
    new = excitation_from_config({**CONFIG, "homogenise": {"iterations": 20}})
    assert not np.array_equal(made.displacement_m, new.displacement_m)


def test_a_configuration_asks_for_the_achievable_range_unless_it_says_otherwise() -> None:
    spec = to_spec(MultisineSpec, {key: value for key, value in CONFIG.items() if key != "kind"} | {"homogenise": {}})
    assert spec.homogenise is not None
    assert spec.homogenise.range == "achievable"
