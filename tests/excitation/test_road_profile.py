"""Properties of the roads of ISO 8608."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation.errors import DesignError
from excitation.periodic import derivative
from excitation.road_profile import ROUGHNESS_M3, RoadProfileSpec, ride, road_profile

quick = settings(max_examples=30, deadline=None)


@st.composite
def roads(draw: st.DrawFn) -> RoadProfileSpec:
    return RoadProfileSpec(
        road_class=draw(st.sampled_from(["A", "B", "C", "D", "E", "F", "G", "H"])),
        length_m=draw(st.sampled_from([50.0, 100.0, 200.0])),
        seed=draw(st.integers(0, 2**32)),
        realisation=draw(st.integers(0, 3)),
        min_wavenumber_per_m=draw(st.sampled_from([0.01, 0.05])),
        max_wavenumber_per_m=draw(st.sampled_from([1.0, 4.0])),
        waviness=draw(st.sampled_from([1.5, 2.0, 2.5])),
    )


@quick
@given(roads())
def test_the_density_of_the_height_is_that_of_the_class_on_every_line(spec: RoadProfileSpec) -> None:
    height = road_profile(spec, 0.1)
    n = np.arange(1, height.size // 2) / spec.length_m
    density = 2.0 * np.abs(np.fft.rfft(height)[1 : n.size + 1] / height.size) ** 2 * spec.length_m
    inside = (n >= spec.min_wavenumber_per_m - 1e-9) & (n <= spec.max_wavenumber_per_m + 1e-9)
    asked = ROUGHNESS_M3[spec.road_class] * (n / 0.1) ** -spec.waviness
    np.testing.assert_allclose(density[inside], asked[inside], rtol=1e-6)
    assert density[~inside].max(initial=0.0) <= 1e-12 * density.max()
    assert abs(height.mean()) <= 1e-12


def test_the_values_of_the_classes_are_those_of_the_standard() -> None:
    assert {name: round(1e6 * value) for name, value in ROUGHNESS_M3.items()} == {
        "A": 16, "B": 64, "C": 256, "D": 1024, "E": 4096, "F": 16384, "G": 65536, "H": 262144,
    }  # fmt: skip


def test_the_slope_is_white_so_that_its_variance_is_the_band_times_its_density() -> None:
    spec = RoadProfileSpec(road_class="C", length_m=200.0)
    met = ride(spec, 20.0, 1000.0)
    slope = met.velocity_m_s / met.speed_m_s
    lines = spec.wave_lines.size / spec.length_m
    assert np.mean(slope**2) == pytest.approx((2 * np.pi * 0.1) ** 2 * 256e-6 * lines, rel=1e-9)


@quick
@given(roads(), st.floats(3.0, 40.0))
def test_a_road_is_the_same_at_every_speed_and_its_velocity_is_the_derivative(
    spec: RoadProfileSpec, speed: float
) -> None:
    met = ride(spec, speed, 500.0)
    assert met.speed_m_s == pytest.approx(speed, rel=0.5 / met.height_m.size * 1.01)
    expected = derivative(met.height_m, 500.0)
    np.testing.assert_allclose(met.velocity_m_s, expected, atol=1e-9 * np.abs(expected).max())
    assert np.mean(met.height_m**2) == pytest.approx(np.mean(road_profile(spec, 0.1) ** 2), rel=1e-9)


def test_a_road_that_is_not_periodic_ends_elsewhere_and_has_the_density_of_the_class() -> None:
    spec = RoadProfileSpec(road_class="B", length_m=500.0, periodic=False, seed=3, max_wavenumber_per_m=1.0)
    height = road_profile(spec, 0.05)
    assert height.size == 10_000
    assert abs(height[-1] - height[0]) > 2 * np.abs(np.diff(height)).max()
    assert ride(spec, 20.0, 1000.0).period_samples == 0
    slopes = [
        np.mean(np.gradient(road_profile(RoadProfileSpec(road_class="B", length_m=500.0, periodic=False, seed=s,
                                                         max_wavenumber_per_m=1.0), 0.05), 0.05) ** 2)
        for s in range(20)
    ]  # fmt: skip
    assert np.mean(slopes) == pytest.approx((2 * np.pi * 0.1) ** 2 * 64e-6 * 0.99, rel=0.05)


def test_the_same_seed_is_the_same_road_and_another_realisation_is_another() -> None:
    spec = RoadProfileSpec(road_class="D", length_m=100.0, seed=7)
    other = RoadProfileSpec(road_class="D", length_m=100.0, seed=7, realisation=1)
    assert road_profile(spec, 0.02).tobytes() == road_profile(spec, 0.02).tobytes()
    assert not np.allclose(road_profile(spec, 0.02), road_profile(other, 0.02))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"road_class": "I"}, "road_class is 'I'"),
        ({"length_m": 0.0}, "length is 0 m"),
        ({"length_m": float("nan")}, "length is nan"),
        ({"min_wavenumber_per_m": 2.0, "max_wavenumber_per_m": 1.0}, "no line of a road"),
        ({"length_m": 1e7, "max_wavenumber_per_m": 10.0}, "100000000 waves"),
    ],
)
def test_a_road_that_cannot_be_made_is_refused_in_one_line(change: dict[str, object], says: str) -> None:
    with pytest.raises(DesignError, match=says):
        RoadProfileSpec(**{"road_class": "A", "length_m": 100.0, **change})  # type: ignore[arg-type]


def test_waves_beyond_half_the_sample_rate_are_refused() -> None:
    spec = RoadProfileSpec(road_class="A", length_m=100.0)
    with pytest.raises(DesignError, match="max_wavenumber is 10 /m"):
        ride(spec, 30.0, 500.0)
    with pytest.raises(DesignError, match="whole number"):
        road_profile(spec, 0.03)
