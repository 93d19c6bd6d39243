"""The analysis of periodic tests: what it finds of systems whose truth is known, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import ndtri

from benchmarks.friction_system import FrictionCase, friction_played
from benchmarks.known_system import Case, played
from excitation.analysis import Measurement, Realisation, analyse, excited_in, spoiled_in
from excitation.analysis.criteria import CONFIDENCE, SIGMAS
from excitation.configuration import to_spec
from excitation.errors import AnalysisError
from excitation.lines import Lines, band_lines, excited_lines
from excitation.multisine import as_excitation, random_phase
from excitation.multisine_spec import MultisineSpec

Floats = NDArray[np.float64]

SAMPLES, RATE = 2048, 256.0
FAST = Case(samples=SAMPLES, sample_rate_hz=RATE)


def two_inputs(realisations: int, *, seed: int = 0, noise: float = 0.0, product: float = 0.0) -> Measurement:
    """F = 3·x + 1.5·ẋ/ω₁ + 2·i + product·x·i, both inputs on the same random odd lines."""
    rng = np.random.default_rng(seed)
    lines = excited_lines(band_lines(0.5, 20.0, RATE, SAMPLES), "odd-random", 4, 3)[0]
    runs = []
    for m in range(realisations):
        x, i = (samples_of(np.exp(2j * np.pi * rng.random(lines.size)), lines) for _ in range(2))
        force = 3.0 * x + 2.0 * i + product * x * i + noise * rng.standard_normal((3, SAMPLES))
        runs.append(
            Realisation(name=f"run {m}", inputs=np.array([np.tile(x, (3, 1)), np.tile(i, (3, 1))]), force=force)
        )
    return Measurement(sample_rate_hz=RATE, inputs=("displacement", "current"), realisations=tuple(runs))


def samples_of(coefficients: NDArray[np.complex128], lines: NDArray[np.int64]) -> Floats:
    spectrum = np.zeros(SAMPLES // 2 + 1, dtype=np.complex128)
    spectrum[lines] = coefficients * SAMPLES / np.sqrt(2.0 * lines.size)
    return np.fft.irfft(spectrum, n=SAMPLES)


def with_force(measurement: Measurement, change: Floats) -> Measurement:
    """The measurement with something added to the force of its first realisation."""
    first, *rest = measurement.realisations
    return replace(measurement, realisations=(replace(first, force=first.force + change), *rest))


@pytest.mark.parametrize(
    "case",
    [
        FrictionCase(samples=SAMPLES, sample_rate_hz=RATE),
        FrictionCase(samples=SAMPLES, sample_rate_hz=RATE, displacement_noise_m=1e-5, force_noise_n=0.1),
        FrictionCase(samples=SAMPLES, sample_rate_hz=RATE, displacement_noise_m=1e-5, lines="odd", realisations=3),
    ],
)
def test_noise_of_the_displacement_is_no_distortion_of_a_damper_with_friction(case: FrictionCase) -> None:
    inside, ratio = [], []
    for seed in range(20):
        known = friction_played(case, seed)
        levels = analyse(known.measurement).levels
        for level, true in ((levels.odd, known.odd), (levels.even, known.even)):
            assert level is not None
            inside.append(level.bounds[0] <= true <= level.bounds[1])
            ratio.append(level.rms / true)
    assert np.mean(inside) >= 0.85  # of 40 levels that hold with 95 % each, 34 or more do in 99.7 % of trials
    assert np.median(ratio) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    "case", [FAST, replace(FAST, lines="odd", realisations=4), replace(FAST, lines="all", realisations=3)]
)
def test_known_distortion_lies_within_the_bounds_nearly_always(case: Case) -> None:
    inside = []
    for seed in range(20):
        known = played(case, seed)
        levels = analyse(known.measurement).levels
        pairs = ((levels.odd, known.odd), (levels.even, known.even), (levels.nonlinear, known.both))
        inside += [level.bounds[0] <= true <= level.bounds[1] for level, true in pairs if level is not None]
    assert np.mean(inside) > 0.9


@pytest.mark.parametrize("lines", ["odd-random", "odd"])
def test_the_approximation_lies_within_its_bounds_on_nearly_all_lines(lines: Lines) -> None:
    inside = []
    for seed in range(10):
        known = played(replace(FAST, lines=lines, realisations=1 if lines == "odd-random" else 4), seed)
        response = analyse(known.measurement).responses[0]
        away = np.abs(response.value - known.value[np.isin(known.driven, response.lines)])
        inside.append(np.mean(away <= response.bound))
    assert 0.91 < np.mean(inside) < 0.99


def test_a_linear_system_without_noise_is_found_exactly_and_has_no_distortion() -> None:
    known = played(replace(FAST, odd=0.0, even=0.0, noise=0.0), 1)
    found = analyse(known.measurement)
    assert found.responses[0].value == pytest.approx(known.value, rel=1e-9)
    assert found.responses[1].value == pytest.approx(known.value / (2j * np.pi * found.frequency_hz), rel=1e-9)
    assert found.levels.nonlinear is not None
    assert found.levels.nonlinear.rms < 1e-12
    assert np.nanmin(found.coherence) > 1.0 - 1e-12


@pytest.mark.parametrize(("odd", "even"), [(0.1, 0.0), (0.0, 0.1)])
def test_odd_and_even_distortion_are_told_apart(odd: float, even: float) -> None:
    levels = analyse(played(replace(FAST, odd=odd, even=even, noise=0.001), 2).measurement).levels
    assert levels.odd is not None
    assert levels.even is not None
    there, absent = (levels.odd, levels.even) if odd else (levels.even, levels.odd)
    assert there.is_seen
    assert there.rms > 50.0 * absent.rms


@settings(max_examples=15, deadline=None)
@given(st.floats(1e-3, 1e6), st.integers(0, 1000))
def test_levels_follow_the_unit_of_the_force(factor: float, seed: int) -> None:
    known = played(replace(FAST, samples=1024, sample_rate_hz=128.0), seed).measurement
    scaled = replace(known, realisations=tuple(replace(r, force=factor * r.force) for r in known.realisations))
    one, other = analyse(known).levels, analyse(scaled).levels
    assert one.odd is not None
    assert other.odd is not None
    assert other.odd.rms == pytest.approx(factor * one.odd.rms, rel=1e-6)
    assert other.force_rms == pytest.approx(factor * one.force_rms)


def test_the_noise_is_that_of_the_load_cell_on_the_lines_that_are_looked_at() -> None:
    found = analyse(played(replace(FAST, noise=0.1, periods=8), 3).measurement)
    share = 2.0 * (found.lines.band[1] * 5) / SAMPLES
    assert found.levels.noise is not None
    assert found.levels.noise.rms == pytest.approx(0.1 * np.sqrt(min(share, 1.0)), rel=0.03)


@pytest.mark.parametrize("realisations", [1, 4])
def test_the_coherence_is_the_linear_share_of_the_power_of_each_line(realisations: int) -> None:
    case = replace(FAST, odd=0.0, even=0.0, noise=1.0, periods=8, realisations=realisations)
    known = played(case, 3)
    found = analyse(known.measurement)
    moved = np.fft.rfft(known.measurement.realisations[0].inputs[0, 0])[known.driven] * np.sqrt(2.0) / SAMPLES
    linear, noise = np.abs(known.value * moved) ** 2, 2.0 * case.noise**2 / SAMPLES
    assert np.mean(found.coherence) == pytest.approx(np.mean(linear / (linear + noise)), abs=0.03)
    assert np.mean(found.noise_coherence) == pytest.approx(np.mean(linear / (linear + noise)), abs=0.03)


def test_one_realisation_of_two_inputs_tells_the_lines_that_one_of_them_drives_alone() -> None:
    both = two_inputs(1)
    (run,) = both.realisations
    lines = excited_in(np.abs(np.fft.rfft(run.inputs[1, 0])) ** 2, np.zeros(SAMPLES // 2 + 1))
    fewer = samples_of(np.exp(2j * np.pi * np.random.default_rng(5).random(lines[::2].size)), lines[::2])
    inputs = np.array([run.inputs[0], np.tile(fewer, (3, 1))])
    found = analyse(replace(both, realisations=(replace(run, inputs=inputs, force=3.0 * inputs[0] + 2.0 * inputs[1]),)))
    (displacement, _) = found.responses[:2]
    assert displacement.lines.tolist() == lines[1::2].tolist()
    assert displacement.value == pytest.approx(np.full(displacement.value.size, 3.0))
    assert any("one realisation cannot tell them apart" in note for note in found.notes)
    assert found.levels.linear_rms == pytest.approx(found.levels.force_rms, rel=1e-6)


def test_a_first_period_that_has_not_settled_is_left_out() -> None:
    known = played(replace(FAST, periods=4), 4).measurement
    decay = np.zeros((4, SAMPLES))
    decay[0] = 0.5 * np.exp(-np.arange(SAMPLES) / 60.0)
    assert [one.left_out for one in analyse(known).played] == [0]
    assert [(one.left_out, one.periods) for one in analyse(with_force(known, decay)).played] == [(1, 3)]


def test_an_unsettled_first_of_two_periods_is_seen_too() -> None:
    known = played(replace(FAST, periods=2), 5).measurement
    decay = np.zeros((2, SAMPLES))
    decay[0] = 0.5 * np.exp(-np.arange(SAMPLES) / 60.0)
    found = analyse(with_force(known, decay))
    assert found.played[0].left_out == 1
    assert any("3 periods" in note for note in found.notes)


def test_warming_is_no_transient_but_a_variation_in_time() -> None:
    known = played(replace(FAST, periods=8), 6).measurement
    force = known.realisations[0].force
    fading = -0.002 * np.arange(8)[:, None] * force
    still, faded = analyse(known), analyse(with_force(known, fading))
    assert faded.played[0].left_out == 0
    assert still.variation.level is not None
    assert not still.variation.level.is_seen
    assert faded.variation.level is not None
    assert faded.variation.level.is_seen
    trend = faded.variation.trends[0]
    assert trend.change == pytest.approx(-0.014, abs=4.0 * trend.change_std + 2e-4)


def test_two_runs_of_the_same_phases_are_one_realisation() -> None:
    known = played(replace(FAST, lines="all"), 7).measurement
    first = known.realisations[0]
    rng = np.random.default_rng(1)
    again = replace(first, name="again", force=first.force + 0.01 * rng.standard_normal(first.force.shape))
    found = analyse(replace(known, realisations=(first, again)))
    assert found.levels.nonlinear is None
    assert [(one.periods, one.also) for one in found.played] == [(8, ("again",))]


def test_two_inputs_on_the_same_lines_are_told_apart_by_realisations() -> None:
    found = analyse(two_inputs(4, noise=0.01, product=0.2))
    by_name = {one.over: one for one in found.responses}
    assert np.mean(np.abs(by_name["displacement"].value - 3.0) <= by_name["displacement"].bound) > 0.85
    assert np.mean(np.abs(by_name["current"].value - 2.0) <= by_name["current"].bound) > 0.85
    assert found.levels.even is not None
    assert found.levels.odd is not None
    assert found.levels.even.rms > 20.0 * found.levels.odd.rms  # a product of two odd inputs is even


def test_two_inputs_on_the_same_lines_need_two_realisations() -> None:
    with pytest.raises(AnalysisError, match="from 2 realisations on"):
        analyse(two_inputs(1))
    exact = analyse(two_inputs(2))
    assert exact.responses[0].value == pytest.approx(np.full(exact.responses[0].value.size, 3.0), rel=1e-6)


def test_runs_of_two_levels_lines_or_periods_are_refused() -> None:
    known = played(FAST, 8).measurement
    first = known.realisations[0]
    doubled = replace(first, name="loud.h5", inputs=2.0 * first.inputs)
    with pytest.raises(AnalysisError, match=r"loud\.h5 has displacement of .* analyse each level by itself"):
        analyse(replace(known, realisations=(first, doubled)))
    other = played(replace(FAST, lines="odd"), 8).measurement.realisations[0]
    level = np.std(first.inputs[0]) / np.std(other.inputs[0])
    with pytest.raises(AnalysisError, match="drives other lines of displacement"):
        analyse(replace(known, realisations=(first, replace(other, name="b", inputs=level * other.inputs))))
    short = replace(first, name="short", inputs=first.inputs[..., :1024], force=first.force[:, :1024])
    with pytest.raises(AnalysisError, match="periods of 1024 samples"):
        replace(known, realisations=(first, short))


def test_what_is_no_measurement_is_refused_in_one_line() -> None:
    force = np.random.default_rng(0).standard_normal((2, 16))
    with pytest.raises(AnalysisError, match="force is 3 in every sample: check its sensor"):
        Realisation(name="a", inputs=np.zeros((1, 2, 16)), force=np.full((2, 16), 3.0))
    with pytest.raises(AnalysisError, match=r"a sample is 1e\+40"):
        Realisation(name="a", inputs=np.full((1, 2, 16), 1e40), force=force)
    with pytest.raises(AnalysisError, match="shape"):
        Realisation(name="a", inputs=np.zeros((1, 2, 8)), force=force)
    with pytest.raises(AnalysisError, match="not a finite number"):
        Realisation(name="a", inputs=np.full((1, 2, 16), np.nan), force=force)
    with pytest.raises(AnalysisError, match="no run is given"):
        Measurement(sample_rate_hz=1.0, inputs=("displacement",), realisations=())
    still = Realisation(name="still", inputs=np.zeros((1, 2, 16)), force=force)
    with pytest.raises(AnalysisError, match="displacement does not move"):
        analyse(Measurement(sample_rate_hz=1.0, inputs=("displacement",), realisations=(still,)))


def test_one_period_tells_no_noise_and_says_so() -> None:
    found = analyse(played(replace(FAST, periods=1), 9).measurement)
    assert found.levels.noise is None
    assert any("noise is not known" in note for note in found.notes)
    assert found.variation.level is None


def test_one_realisation_on_every_line_tells_no_distortion_and_says_what_would() -> None:
    found = analyse(played(replace(FAST, lines="all"), 10).measurement)
    assert found.levels.odd is found.levels.even is found.levels.nonlinear is None
    assert any("odd-random" in note for note in found.notes)
    assert np.isnan(found.responses[0].std).all()
    assert np.isfinite(found.responses[0].noise_std).all()


def test_a_sine_shows_its_harmonics_as_odd_and_even() -> None:
    t = np.arange(512) / 512
    x = np.tile(np.sin(2 * np.pi * t), (3, 1))
    force = 10.0 * x + 2.0 * x**2 + 4.0 * x**3
    run = Realisation(name="sine", inputs=x[None], force=force)
    levels = analyse(Measurement(sample_rate_hz=512.0, inputs=("displacement",), realisations=(run,))).levels
    assert levels.even is not None
    assert levels.odd is not None
    assert levels.even.rms == pytest.approx(1.0 / np.sqrt(2.0))  # sin² = ½ − ½·cos 2φ
    assert levels.odd.rms == pytest.approx(1.0 / np.sqrt(2.0))  # sin³ = ¾·sin φ − ¼·sin 3φ


@settings(max_examples=20, deadline=None)
@given(
    lines=st.sampled_from(["all", "odd", "odd-random"]),
    spectrum=st.sampled_from(["flat", "quarter-car", "road"]),
    seed=st.integers(0, 1000),
    stray=st.floats(0.0, 0.02),
)
def test_driven_lines_are_seen_though_the_rig_distorts(lines: Lines, spectrum: str, seed: int, stray: float) -> None:
    spec = specified(lines, "all", seed=seed, spectrum=spectrum, current=False)
    period = random_phase(spec)
    x = period.displacement_m
    moved = x + stray * np.max(np.abs(x)) * (x / np.max(np.abs(x))) ** 3
    power = np.abs(np.fft.rfft(moved)) ** 2
    assert np.array_equal(excited_in(power, np.zeros_like(power)), period.displacement.lines)


def test_lines_that_a_design_states_are_not_believed_where_they_are_not_driven() -> None:
    known = played(replace(FAST, lines="odd"), 11)
    wrong = np.arange(4, 200, dtype=np.int64)  # it says all lines
    found = analyse(replace(known.measurement, excited=(wrong,)))
    assert np.array_equal(found.lines.driven, known.driven)
    assert any("not what its design states" in note for note in found.notes)


def test_a_current_that_spoils_detection_lines_is_told_of_when_designed_and_when_analysed() -> None:
    spec = specified("odd", "all")
    (told,) = spoiled_in(as_excitation(spec, random_phase(spec), "multisine"))
    assert "current excites" in told
    alike = specified("odd-random", "odd-random")
    assert spoiled_in(as_excitation(alike, random_phase(alike), "multisine")) == ()
    found = analyse(of_spec(spec))
    assert any("current excites" in note for note in found.notes)
    assert found.levels.odd is None


def test_the_warning_is_the_same_for_a_current_of_any_size() -> None:
    made = as_excitation(specified("odd", "all"), random_phase(specified("odd", "all")), "multisine")
    assert made.current_a is not None
    assert spoiled_in(replace(made, current_a=5e8 * made.current_a)) == spoiled_in(made) != ()


def test_force_of_a_current_is_no_distortion_where_both_channels_leave_out_the_same_lines() -> None:
    found = analyse(of_spec(specified("odd-random", "odd-random"), realisations=3))
    assert found.levels.nonlinear is not None
    assert found.levels.nonlinear.rms < 1e-9 * found.levels.force_rms


def specified(
    lines: Lines, current_lines: Lines, *, seed: int = 1, spectrum: str = "flat", current: bool = True, number: int = 0
) -> MultisineSpec:
    config = {
        "sample_rate": RATE,
        "period_samples": SAMPLES,
        "seed": seed,
        "realisation": number,
        "displacement": {
            "f_min": 0.5, "f_max": 15.0, "lines": lines, "spectrum": spectrum, "max_displacement": 0.05,
            "max_velocity": 1.0,
        },
    }  # fmt: skip
    if current:
        config["current"] = {
            "f_min": 0.5,
            "f_max": 25.0,
            "lines": current_lines,
            "spectrum": "flat",
            "min": 0.3,
            "max": 1.6,
        }
    return to_spec(MultisineSpec, config)


def of_spec(spec: MultisineSpec, realisations: int = 1) -> Measurement:
    """F = 20 000·x + 300·i, without noise."""
    runs = []
    for number in range(realisations):
        period = random_phase(replace(spec, realisation=number))
        assert period.current_a is not None
        x, i = (np.tile(u, (2, 1)) for u in (period.displacement_m, period.current_a))
        runs.append(Realisation(name=f"r{number}", inputs=np.array([x, i]), force=2e4 * x + 300.0 * i))
    return Measurement(sample_rate_hz=RATE, inputs=("displacement", "current"), realisations=tuple(runs))


SHAPES = ("zero", "constant", "sine", "noise", "alternating", "tiny", "three sines")


def shaped(shape: str, n: int, rng: np.random.Generator) -> Floats:
    turns = np.arange(n) / n
    match shape:
        case "zero":
            return np.zeros(n)
        case "constant":
            return np.full(n, rng.normal())
        case "sine":
            return np.sin(2.0 * np.pi * turns * rng.integers(1, n // 2))
        case "noise":
            return rng.standard_normal(n)
        case "alternating":
            return np.resize([1.0, -1.0], n)
        case "tiny":
            return 1e-300 * np.sin(2.0 * np.pi * turns)
        case _:
            return sum((np.sin(2.0 * np.pi * (k * turns + rng.random())) for k in (1, 3, n // 4)), np.zeros(n))


@settings(max_examples=150, deadline=None)
@given(
    samples=st.sampled_from([8, 9, 16, 17, 31, 64]),
    periods=st.integers(1, 4),
    realisations=st.integers(1, 3),
    inputs=st.lists(st.sampled_from(SHAPES), min_size=1, max_size=2),
    force=st.sampled_from(SHAPES),
    noise=st.sampled_from([0.0, 1e-3, 1.0]),
    seed=st.integers(0, 10_000),
)
def test_whatever_it_is_given_it_answers_or_refuses_in_one_line_without_a_warning(
    samples: int, periods: int, realisations: int, inputs: list[str], force: str, noise: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    try:
        runs = tuple(
            Realisation(
                name=f"r{m}",
                inputs=np.array([np.tile(shaped(one, samples, rng), (periods, 1)) for one in inputs]),
                force=shaped(force, samples, rng) + noise * rng.standard_normal((periods, samples)),
            )
            for m in range(realisations)
        )
        found = analyse(
            Measurement(sample_rate_hz=1.0, inputs=("displacement", "current")[: len(inputs)], realisations=runs)
        )
    except AnalysisError as refused:
        told, figures = str(refused), [0.0]
    else:
        told, figures = found.method, [found.levels.force_rms, found.levels.linear_rms]
    assert "\n" not in told
    assert np.isfinite(figures).all()


def test_the_bounds_of_a_normal_number_hold_it_with_the_probability_of_every_bound() -> None:
    assert ndtri(0.5 * (1.0 + CONFIDENCE)) == SIGMAS
