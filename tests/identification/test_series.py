"""The loops over whole series do what the libraries' do."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import lfilter

from identification.models.motion import repeated
from identification.models.series import between, is_beyond, is_constant
from identification.physical.elements.equations.series import add_columns, follow, leave, means, slope


@pytest.mark.parametrize("poles", [1, 2])
def test_a_filter_goes_on_from_what_was_before(poles: int) -> None:
    rng = np.random.default_rng(poles)
    b, a = np.array([0.2, 0.3, 0.1]), np.array([1.0, -0.9, 0.4])
    b[poles + 1 :] = a[poles + 1 :] = 0.0
    state, series = rng.standard_normal((2, 3)), rng.standard_normal((40, 3))
    if poles == 1:
        state[1] = 0.0
    mean, begun, out, left = np.array([0.3, 0.0]), state.copy(), series.copy(), state.copy()
    leave(b, a, mean, left, out, 25, 2)
    assert np.array_equal(out, series)
    follow(b, a, mean, state, out, 2)
    for k in range(2):
        expected, after = lfilter(b, a, series[:, k] - mean[k], zi=begun[:, k])
        assert out[:, k] == pytest.approx(expected + mean[k], abs=1e-12)
        assert state[:, k] == pytest.approx(after, abs=1e-12)
        assert left[:, k] == pytest.approx(lfilter(b, a, series[:25, k] - mean[k], zi=begun[:, k])[1], abs=1e-12)
    assert np.array_equal(out[:, 2], series[:, 2])


def test_means_are_those_of_the_first_samples_and_columns() -> None:
    series, out = np.random.default_rng(1).standard_normal((40, 3)), np.full(2, np.nan)
    means(series, 30, 2, out)
    assert out == pytest.approx(series[:30, :2].mean(axis=0), abs=1e-12)


@pytest.mark.parametrize("samples", [2, 3, 50])
def test_a_slope_is_that_of_the_samples_on_both_sides(samples: int) -> None:
    series, out = np.random.default_rng(samples).standard_normal(samples), np.empty(samples)
    slope(series, 0.01, out)
    assert out == pytest.approx(np.gradient(series, 0.01), abs=1e-9)


def test_columns_are_added_where_they_belong() -> None:
    total, own = np.ones((5, 4)), np.arange(10.0).reshape(5, 2)
    add_columns(total, np.array([3, 1]), own)
    assert np.array_equal(total[:, [3, 1]], 1.0 + own)
    assert np.array_equal(total[:, [0, 2]], np.ones((5, 2)))


@pytest.mark.parametrize("late", [0.0, 0.3, 1.0, 2.75, -0.4, -3.0, 38.6, 60.0, -60.0])
def test_a_motion_of_some_samples_ago_lies_on_cubics_and_beyond_the_samples_is_held(late: float) -> None:
    dt, n = 0.01, 40
    x, v, a = np.random.default_rng(4).standard_normal((3, n))
    out, t = np.empty((3, n)), dt * np.arange(n)
    between(x, v, a, late, dt, out)
    then = np.clip(t - late * dt, 0.0, t[-1])
    for found, one, slopes in zip(out, (x, v, a), (v, a, np.gradient(a, dt)), strict=True):
        assert found == pytest.approx(CubicHermiteSpline(t, one, slopes)(then), abs=1e-9)


def test_a_single_sample_is_held_however_late_it_is() -> None:
    out = np.empty((3, 1))
    between(np.array([1.0]), np.array([2.0]), np.array([3.0]), 0.4, 0.01, out)
    assert np.array_equal(out[:, 0], [1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("series", "constant"), [([2.0, 2.0, 2.0], True), ([2.0, 2.0, 2.1], False), ([7.0], True), ([1.0, np.nan], False)]
)
def test_a_series_is_constant_where_every_value_is_the_first(series: list[float], constant: bool) -> None:
    assert is_constant(np.array(series)) is constant


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 3.1, -3.1])
def test_one_value_beyond_a_limit_or_none_at_all_is_seen(value: float) -> None:
    series = np.full((5, 4), 3.0)
    assert not is_beyond(series, 3.0)
    assert not is_beyond(series[:, :0], 3.0)
    series[3, 1] = value
    assert is_beyond(series, 3.0)
    assert is_beyond(series[:, 1], 3.0)


@pytest.mark.parametrize("samples", [2, 5, 10, 13])
def test_what_repeats_goes_on_from_its_beginning(samples: int) -> None:
    period = np.arange(10.0).reshape(5, 2)
    assert np.array_equal(repeated(period, samples), period[np.arange(samples) % 5])
