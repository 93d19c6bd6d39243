"""Properties of sweeps, noise, roads and sequences of current, each its own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation.errors import DesignError
from excitation.road_drive import stroke_over_road
from excitation.spectra import QuarterCar, Road, quarter_car
from excitation.synthesis import excitation_from_config
from tests.excitation.generators import CONFIGS

BOUNDS = {"max_displacement": 0.02, "max_velocity": 0.4, "max_acceleration": 30.0}
SWEEP: dict[str, Any] = {
    "kind": "sweep", "sample_rate": 1000.0, "f_start": 0.5, "f_end": 40.0, "duration": 60.0, "bounds": BOUNDS,
}  # fmt: skip


@pytest.mark.parametrize("law", ["linear", "log"])
def test_a_sweep_reaches_at_each_frequency_what_the_bounds_allow(law: str) -> None:
    made = excitation_from_config({**SWEEP, "law": law})
    x = made.displacement_m
    share = np.linspace(0.0, 1.0, x.size)
    frequency = 0.5 + 39.5 * share if law == "linear" else 0.5 * 80.0**share
    omega = 2 * np.pi * frequency
    allowed = np.minimum(np.minimum(0.02, 0.4 / omega), 30.0 / omega**2)
    for start in range(4000, 56_000, 4000):  # a window of more than two cycles, past the fades
        reached = np.abs(x[start : start + 4000] / allowed[start : start + 4000]).max()
        assert 0.95 <= reached <= 1.0


def test_a_sweep_passes_through_its_frequencies_by_its_law() -> None:
    for law, middle in (("linear", 20.25), ("log", np.sqrt(0.5 * 40.0))):
        made = excitation_from_config({**SWEEP, "law": law})
        around = made.displacement_m[29_000:31_000]
        rises = np.flatnonzero((around[:-1] < 0) & (around[1:] >= 0))
        cycles = (len(rises) - 1) / (rises[-1] - rises[0]) * 1000.0
        assert cycles == pytest.approx(middle, rel=0.02)


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(["displacement", "velocity", "acceleration"]), st.integers(0, 99), st.floats(-3.0, 3.0))
def test_the_density_of_noise_is_the_one_that_is_given(of: str, seed: int, slope: float) -> None:
    order = {"displacement": 0, "velocity": 1, "acceleration": 2}[of]
    wide = {"max_displacement": 1e9, "max_velocity": 1e9}
    table = {"of": of, "frequency": [1.0, 30.0], "density": [1e-4, 1e-4 * 30.0**slope]}
    base = {
        "kind": "noise",
        "sample_rate": 200.0,
        "period_samples": 4000,
        "seed": seed,
        "bounds": wide,
        "density": table,
    }
    made = excitation_from_config({**base, "amplitudes": "fixed"})  # type: ignore[dict-item]
    frequency = np.arange(20, 601) * 0.05
    omega = 2 * np.pi * frequency
    lines = np.fft.rfft(made.displacement_m)[20:601] / 4000 * omega**order
    asked = 1e-4 * frequency**slope
    np.testing.assert_allclose(2 * np.abs(lines) ** 2 / 0.05, asked, rtol=1e-6)
    drawn = excitation_from_config(base)  # type: ignore[arg-type]
    lines = np.fft.rfft(drawn.displacement_m)[20:601] / 4000 * omega**order
    share = 2 * np.abs(lines) ** 2 / 0.05 / asked  # of an exponential distribution with the mean 1
    assert share.mean() == pytest.approx(1.0, abs=0.25)
    assert share.std() == pytest.approx(1.0, abs=0.35)


def test_the_stroke_of_the_quarter_car_is_that_of_its_spectrum_and_still_at_standstill() -> None:
    frequency = np.linspace(0.05, 40.0, 500)
    car, smooth = QuarterCar(), Road(corner_hz=0.0)
    expected = quarter_car(frequency, car, smooth) * frequency  # the spectrum has the road's 1/f
    np.testing.assert_allclose(np.abs(stroke_over_road(frequency, car)), expected, rtol=1e-12)
    assert abs(stroke_over_road(np.array([1e-6]), car)[0]) < 1e-9


def test_the_stroke_obeys_the_equations_of_motion() -> None:
    car, omega = QuarterCar(), 2 * np.pi * np.array([0.7, 3.0, 11.0])
    stroke = stroke_over_road(omega / (2 * np.pi), car)
    body = (car.spring_rate_n_m + 1j * omega * car.damping_n_s_m) * stroke / (car.sprung_mass_kg * omega**2)
    wheel = body - stroke
    tyre = car.tyre_rate_n_m * (wheel - 1.0)
    np.testing.assert_allclose(car.sprung_mass_kg * omega**2 * body + car.unsprung_mass_kg * omega**2 * wheel, tyre)


def test_a_rougher_class_moves_the_damper_twice_as_far_and_a_faster_car_more() -> None:
    base = {**CONFIGS["road"], "bounds": {"max_displacement": 1.0, "max_velocity": 10.0}}

    def rms(road_class: str, speed: float) -> float:
        made = excitation_from_config({**base, "speed": speed, "road": {**base["road"], "road_class": road_class}})
        return float(np.std(made.displacement_m))

    assert rms("B", 20.0) == pytest.approx(0.5 * rms("C", 20.0), rel=1e-9)
    assert rms("C", 25.0) > rms("C", 15.0)


def test_a_signal_beyond_its_bounds_is_refused_with_the_level_that_fits() -> None:
    config = {**CONFIGS["road"], "bounds": BOUNDS, "road": {"road_class": "F", "length": 100.0}}
    with pytest.raises(DesignError, match=r"bounds: the signal reaches .* level = [0-9.]+ fits") as refused:
        excitation_from_config(config)
    level = float(str(refused.value).split("level = ")[1].split(" ")[0])
    made = excitation_from_config({**config, "level": level})
    assert np.abs(made.displacement_m).max() <= 0.02
    scaled = excitation_from_config({**config, "bounds": {**BOUNDS, "beyond": "scale"}})
    assert np.abs(scaled.displacement_m).max() == pytest.approx(np.abs(made.displacement_m).max(), rel=0.01)
    assert scaled.figures["scaled_by"] == pytest.approx(level, rel=0.01)


@settings(max_examples=10, deadline=None)
@given(st.integers(2, 9), st.integers(0, 99))
def test_a_prbs_has_the_correlation_of_a_maximum_length_sequence(order: int, seed: int) -> None:
    length = 2**order - 1
    made = excitation_from_config(
        {"kind": "steps", "sample_rate": 100.0, "amplitude": 0.01, "frequency": 1.0, "cycles": length,
         "levels": [0.0, 1.0], "step_time": 1.0, "sequence": "prbs", "order": order, "seed": seed}
    )  # fmt: skip
    assert made.current_a is not None
    bits = 2.0 * made.current_a[::100] - 1.0
    correlation = np.fft.irfft(np.abs(np.fft.rfft(bits)) ** 2, n=length)
    np.testing.assert_allclose(correlation, [length, *[-1.0] * (length - 1)], atol=1e-9)


def test_listed_levels_are_played_in_their_order() -> None:
    made = excitation_from_config(CONFIGS["listed steps"])
    assert made.current_a is not None
    played = made.current_a[np.flatnonzero(np.diff(made.current_a, prepend=np.nan))]
    assert played.tolist() == np.resize([0.2, 0.6, 1.1, 0.5], played.size).tolist()


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("log sweep", {"f_end": 100.0}, "eight samples a period"),
        ("log sweep", {"f_end": 20.0}, "use a sine"),
        ("log sweep", {"duration": 1e9}, "samples; 16"),
        ("log sweep", {"duration": 0.05, "fade": None}, "less than one cycle"),
        ("log sweep", {"fade": 9.0}, "fade is 9 s"),
        ("log sweep", {"bounds": {"max_displacement": 0.0, "max_velocity": 1.0}}, "max_displacement is 0 m"),
        ("noise", {"density": {"frequency": [1.0, 2.0], "density": [1.0]}}, "and density 1"),
        ("noise", {"density": {"frequency": [0.0, 2.0], "density": [1.0, 1.0]}}, "above 0"),
        ("noise", {"density": {"frequency": [1.0, 250.0], "density": [1.0, 1.0]}}, "below half the sample rate"),
        ("noise", {"density": {"frequency": [1.0, 2.0], "density": [1e308, 1e308]}}, "density.density is 1e.308"),
        ("road", {"road": {"road_class": "Z", "length": 100.0}}, "road_class is 'Z'"),
        ("road", {"road": {"road_class": "A", "length": 100.0, "periodic": False}}, "a road that closes"),
        ("road", {"f_max": 0.01}, "no line of a road"),
        ("road", {"speed": 0.0}, "speed is 0"),
        ("prbs", {"levels": [0.1, 0.2, 0.3]}, "a prbs has two"),
        ("prbs", {"order": 40}, "order is 40"),
        ("prbs", {"order": 7}, "its 127 steps last 6.35 s and 8 cycles at 2 Hz 4 s: give 13 cycles or more"),
        ("prbs", {"step_time": 2.0**53}, "step_time is 9.*e.15 s"),
        ("prbs", {"sequence": "gray"}, "sequence is 'gray'"),
    ],
)
def test_what_cannot_be_designed_is_refused_in_one_line(name: str, change: dict[str, Any], says: str) -> None:
    with pytest.raises(DesignError, match=says) as refused:
        excitation_from_config({**CONFIGS[name], **change})
    assert "\n" not in str(refused.value)
