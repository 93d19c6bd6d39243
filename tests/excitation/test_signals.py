"""Properties that define the signals."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from excitation.errors import DesignError
from excitation.harmonic import SineSpec, StepsSpec, TriangleSpec, sine, steps, triangle
from excitation.kinds import Kind
from excitation.lines import band_lines, excited_lines
from excitation.multisine import as_excitation, random_phase
from excitation.multisine_spec import CurrentSpec, DisplacementSpec, MultisineSpec
from excitation.periodic import derivative
from excitation.portable_math import cosine_and_sine, uniform
from excitation.synthesis import excitation_from_config

quick = settings(max_examples=30, deadline=None)


@st.composite
def multisines(draw: st.DrawFn) -> MultisineSpec:
    samples = draw(st.integers(512, 3000))
    displacement = DisplacementSpec(
        f_min_hz=draw(st.floats(0.2, 3.0)),
        f_max_hz=draw(st.floats(10.0, 60.0)),
        lines=draw(st.sampled_from(["all", "odd", "odd-random"])),
        detection_group=draw(st.integers(2, 6)),
        spectrum=draw(st.sampled_from(["flat", "quarter-car", "road"])),
        max_displacement_m=draw(st.floats(1e-3, 0.2)),
        max_velocity_m_s=draw(st.floats(1e-2, 3.0)),
        max_acceleration_m_s2=draw(st.none() | st.floats(1.0, 300.0)),
    )
    current = CurrentSpec(
        f_min_hz=0.5,
        f_max_hz=draw(st.floats(20.0, 120.0)),
        min_a=draw(st.floats(-2.0, 0.5)),
        max_a=draw(st.floats(0.6, 5.0)),
        spectrum=draw(st.sampled_from(["flat", "control"])),
    )
    return MultisineSpec(
        sample_rate_hz=500.0,
        period_samples=samples,
        periods=draw(st.integers(1, 4)),
        seed=draw(st.integers(0, 2**32)),
        realisation=draw(st.integers(0, 5)),
        level=draw(st.floats(0.05, 1.0)),
        displacement=displacement,
        current=draw(st.sampled_from([None, current])),
    )


@quick
@given(multisines())
def test_power_lies_on_the_chosen_lines_and_nowhere_else(spec: MultisineSpec) -> None:
    asked = spec.displacement
    band = band_lines(asked.f_min_hz, asked.f_max_hz, spec.sample_rate_hz, spec.period_samples)
    chosen, silent = excited_lines(band, asked.lines, asked.detection_group, spec.seed)
    amplitude = np.abs(np.fft.rfft(random_phase(spec).displacement_m))
    assert (amplitude[chosen] > 0).all()
    assert np.delete(amplitude, chosen).max() <= 1e-12 * amplitude.max()
    assert np.array_equal(np.sort(np.concatenate([chosen, silent])), band)


@quick
@given(multisines())
def test_limits_are_never_exceeded_and_one_is_reached(spec: MultisineSpec) -> None:
    period, asked = random_phase(spec), spec.displacement
    velocity = derivative(period.displacement_m, spec.sample_rate_hz)
    used = [
        np.abs(period.displacement_m).max() / asked.max_displacement_m,
        np.abs(velocity).max() / asked.max_velocity_m_s,
    ]
    if asked.max_acceleration_m_s2 is not None:
        used.append(np.abs(period.acceleration_m_s2).max() / asked.max_acceleration_m_s2)
    assert max(used) <= spec.level
    assert max(used) == pytest.approx(spec.level, rel=1e-6)
    if spec.current is not None and period.current_a is not None:
        assert period.current_a.min() >= spec.current.min_a
        assert period.current_a.max() <= spec.current.max_a
        assert np.ptp(period.current_a) == pytest.approx(spec.current.max_a - spec.current.min_a, rel=1e-6)


@quick
@given(multisines())
def test_the_file_repeats_the_period_exactly_with_zero_mean(spec: MultisineSpec) -> None:
    excitation = as_excitation(spec, random_phase(spec), "multisine")
    periods = excitation.displacement_m.reshape(spec.periods, spec.period_samples)
    assert (periods == periods[0]).all()
    assert abs(periods[0].mean()) <= 1e-15


@quick
@given(multisines())
def test_the_stored_design_makes_the_same_bytes_again(spec: MultisineSpec) -> None:
    first = as_excitation(spec, random_phase(spec), "multisine")
    again = excitation_from_config(first.design)
    assert again.displacement_m.tobytes() == first.displacement_m.tobytes()
    assert (again.current_a is None) == (first.current_a is None)
    if again.current_a is not None and first.current_a is not None:
        assert again.current_a.tobytes() == first.current_a.tobytes()


@quick
@given(multisines())
def test_the_energy_of_the_samples_is_that_of_the_lines(spec: MultisineSpec) -> None:
    period = random_phase(spec)
    assert np.mean(period.displacement_m**2) == pytest.approx(np.sum(period.displacement.amplitude**2) / 2)


@quick
@given(multisines())
def test_derivatives_are_those_of_the_lines(spec: MultisineSpec) -> None:
    period, rate = random_phase(spec), spec.sample_rate_hz
    velocity = derivative(period.displacement_m, rate)
    np.testing.assert_allclose(period.velocity_m_s, velocity, atol=1e-10 * np.abs(velocity).max())
    acceleration = derivative(period.velocity_m_s, rate)
    np.testing.assert_allclose(period.acceleration_m_s2, acceleration, atol=1e-10 * np.abs(acceleration).max())


@quick
@given(multisines(), st.integers(0, 1000))
def test_realisations_share_amplitudes_and_lines_and_differ_in_phases(spec: MultisineSpec, seed: int) -> None:
    one = random_phase(replace(spec, seed=seed, realisation=0)).displacement
    other = random_phase(replace(spec, seed=seed, realisation=1)).displacement
    assert np.array_equal(one.lines, other.lines)
    np.testing.assert_allclose(one.amplitude / one.amplitude[0], other.amplitude / other.amplitude[0])
    assert not np.array_equal(one.phase_turns, other.phase_turns)


def test_own_cosine_and_sine_are_those_of_the_library_to_the_last_bits() -> None:
    turns = np.linspace(-1.0, 1.0, 20_001)
    cos, sin = cosine_and_sine(turns)
    np.testing.assert_allclose(cos, np.cos(2 * np.pi * turns), atol=1e-15)
    np.testing.assert_allclose(sin, np.sin(2 * np.pi * turns), atol=1e-15)


def test_uniform_numbers_depend_on_the_key_alone() -> None:
    assert uniform((1, 2), 3).tolist() == uniform((1, 2), 3).tolist()
    assert uniform((1, 2), 100).tolist() != uniform((2, 1), 100).tolist()
    values = uniform((5,), 20_000)
    assert values.min() >= 0.0
    assert values.max() < 1.0
    assert abs(values.mean() - 0.5) < 0.01


frequencies = st.floats(0.05, 60.0)
amplitudes = st.floats(1e-4, 0.2)


@quick
@given(frequencies, amplitudes, st.integers(1, 5), st.integers(0, 3))
def test_cycles_of_a_sine_take_whole_samples_at_most_at_the_frequency_that_is_asked_for(
    frequency: float, amplitude: float, cycles: int, settling: int
) -> None:
    made = sine(
        SineSpec(
            sample_rate_hz=1000.0,
            amplitude_m=amplitude,
            frequency_hz=frequency,
            cycles=cycles,
            settling_cycles=settling,
        )
    )
    realised = float(str(made.design["frequency"]))
    in_a_period = realised * made.period_samples / 1000.0
    assert in_a_period == pytest.approx(round(in_a_period), abs=1e-9)
    assert 1 <= round(in_a_period) <= max(1, (cycles + settling) // 3)
    assert frequency * (1 - frequency / 1000.0) <= realised <= frequency * (1 + 1e-9)
    assert -1e-6 <= made.samples - (cycles + settling) * 1000.0 / realised < 1
    assert np.abs(made.displacement_m).max() <= amplitude
    assert abs(made.displacement_m[-made.period_samples :].mean()) < 1e-12
    again = excitation_from_config(made.design)
    assert again.design == made.design
    assert again.displacement_m.tobytes() == made.displacement_m.tobytes()


@quick
@given(st.floats(0.05, 60.0), st.floats(1e-4, 0.2))
def test_the_speed_of_thirty_cycles_is_within_a_fifth_of_a_percent_or_nearest_to_it(
    frequency: float, amplitude: float
) -> None:
    made = sine(
        SineSpec(sample_rate_hz=1000.0, amplitude_m=amplitude, frequency_hz=frequency, cycles=29, settling_cycles=1)
    )
    best = max(n * 1000.0 / np.ceil(n * 1000.0 / frequency * (1 - 1e-12)) for n in range(1, 11)) / frequency
    share = np.abs(made.velocity_m_s).max() / (2 * np.pi * frequency * amplitude)
    assert share <= 1 + 1e-9
    assert share >= min(best, 1 - 2e-3) * np.cos(np.pi * frequency / 1000.0) - 1e-9  # the peak lies between samples
    assert made.samples >= 3 * made.period_samples or made.design["frequency"] == 1000.0 / made.period_samples


def test_thirty_hertz_at_a_kilohertz_are_thirty_hertz() -> None:
    made = sine(SineSpec(sample_rate_hz=1000.0, amplitude_m=0.01, frequency_hz=30.0, cycles=11))
    assert (made.design["frequency"], made.period_samples, made.samples) == (30.0, 100, 367)


@quick
@given(st.floats(0.05, 30.0), amplitudes, st.floats(0.0, 0.49))
@example(frequency=1.0, amplitude=0.125, corner=2.2250738585e-313)
def test_a_triangle_reaches_its_amplitude_at_constant_speed(frequency: float, amplitude: float, corner: float) -> None:
    spec = TriangleSpec(
        sample_rate_hz=1000.0,
        amplitude_m=amplitude,
        frequency_hz=frequency,
        cycles=2,
        corner_time_s=corner * 0.9 / frequency,
    )
    made = triangle(spec)
    period, realised = made.displacement_m[: made.period_samples], float(str(made.design["frequency"]))
    assert realised <= frequency * (1 + 1e-9)
    realised_corner = spec.corner_time_s * realised
    speed = 4 * amplitude * realised / (1 - realised_corner)
    between = 0.0 if realised * made.period_samples < 1001.0 else speed / 2000.0  # a turning point between samples
    assert amplitude - between - 1e-9 <= period.max() <= amplitude * (1 + 1e-9)
    assert amplitude - between - 1e-9 <= -period.min() <= amplitude * (1 + 1e-9)
    assert np.abs(np.diff(period)).max() * 1000.0 <= speed * (1 + 1e-9)


@quick
@given(
    st.lists(st.floats(0.0, 2.0).map(lambda x: round(x, 3)), min_size=2, max_size=5, unique=True),
    st.integers(0, 99),
)
def test_current_steps_visit_every_level_and_always_change(levels: list[float], seed: int) -> None:
    made = steps(
        StepsSpec(
            sample_rate_hz=500.0,
            amplitude_m=0.01,
            frequency_hz=2.0,
            cycles=4 * len(levels),
            levels_a=tuple(levels),
            step_time_s=0.25,
            seed=seed,
            periods=2,
        )
    )
    assert made.current_a is not None
    steps_of_first_period = made.current_a[: made.period_samples].reshape(-1, 125)
    assert (steps_of_first_period == steps_of_first_period[:, :1]).all()
    sequence = steps_of_first_period[:, 0]
    assert set(sequence) == set(levels)
    assert (np.diff(sequence) != 0).all()
    assert np.array_equal(made.current_a[made.period_samples :], made.current_a[: made.period_samples])


def test_samples_made_on_demand_are_the_same_each_time_and_are_not_kept() -> None:
    made = sine(SineSpec(sample_rate_hz=500.0, amplitude_m=0.01, frequency_hz=7.0, cycles=9, current_a=0.5))
    assert made.displacement_m is not made.displacement_m
    assert made.displacement_m.tobytes() == made.held().displacement_m.tobytes()
    assert made.held().displacement_m.flags.writeable is False
    assert pickle.loads(pickle.dumps(made)).displacement_m.tobytes() == made.displacement_m.tobytes()
    assert replace(made, sample_rate_hz=250.0).duration_s == 2 * made.duration_s


@quick
@given(multisines())
def test_an_excitation_has_the_time_the_velocity_and_the_acceleration_of_each_sample(spec: MultisineSpec) -> None:
    made = as_excitation(spec, random_phase(spec), "multisine")
    period = random_phase(spec)
    assert made.time_s[-1] == pytest.approx((made.samples - 1) / 500.0)
    expected = np.tile(period.velocity_m_s, spec.periods)
    np.testing.assert_allclose(made.velocity_m_s, expected, atol=1e-9 * np.abs(expected).max())
    expected = np.tile(period.acceleration_m_s2, spec.periods)
    np.testing.assert_allclose(made.acceleration_m_s2, expected, atol=1e-8 * np.abs(expected).max())


def test_the_velocity_of_a_signal_that_ends_within_a_period_is_that_of_its_own_samples() -> None:
    made = sine(SineSpec(sample_rate_hz=1000.0, amplitude_m=0.01, frequency_hz=30.0, cycles=11))
    expected = 0.01 * 2 * np.pi * 30.0 * np.cos(2 * np.pi * 30.0 * made.time_s)
    np.testing.assert_allclose(made.velocity_m_s, expected, atol=1e-9)


def test_an_excitation_shows_itself_in_one_short_line_and_as_a_plot() -> None:
    made = sine(SineSpec(sample_rate_hz=1000.0, amplitude_m=0.01, frequency_hz=2.0, cycles=3, current_a=0.5))
    assert repr(made) == "<sine excitation: 1500 samples at 1000 Hz, 1.5 s, period 500, with current>"
    assert len(made.plot().data) == 4


def test_a_kind_that_no_file_knows_is_refused() -> None:
    made = sine(SineSpec(sample_rate_hz=1000.0, amplitude_m=0.01, frequency_hz=2.0, cycles=3))
    assert replace(made, kind="triangle").kind is Kind.TRIANGLE  # type: ignore[arg-type]
    with pytest.raises(DesignError, match="kind is 'noise': it must be one of"):
        replace(made, kind="noise")  # type: ignore[arg-type]
