"""The loops over whole series do what the libraries' do."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.physical.elements.equations.series import add_columns, follow, slope


@pytest.mark.parametrize("poles", [1, 2])
def test_a_filter_goes_on_from_what_was_before(poles: int) -> None:
    rng = np.random.default_rng(poles)
    b, a = np.array([0.2, 0.3, 0.1]), np.array([1.0, -0.9, 0.4])
    b[poles + 1 :] = a[poles + 1 :] = 0.0
    state, series = rng.standard_normal((2, 3)), rng.standard_normal((40, 3))
    if poles == 1:
        state[1] = 0.0
    begun, out = state.copy(), np.empty_like(series)
    follow(b, a, state, series, out)
    for k in range(3):
        expected, after = lfilter(b, a, series[:, k], zi=begun[:, k])
        assert out[:, k] == pytest.approx(expected, abs=1e-12)
        assert state[:, k] == pytest.approx(after, abs=1e-12)


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
