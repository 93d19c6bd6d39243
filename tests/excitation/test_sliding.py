"""Windows that slide along a series, against those of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter, uniform_filter1d

from excitation.sliding import running_maximum, running_mean, running_median

SERIES = st.builds(
    lambda seed, samples: np.random.default_rng(seed).exponential(size=samples),
    st.integers(0, 2**32 - 1),
    st.integers(1, 400),
)


@given(SERIES, st.integers(1, 60))
def test_a_running_mean_is_that_of_scipy_to_the_bit(series: NDArray[np.float64], width: int) -> None:
    assert running_mean(series, width).tobytes() == uniform_filter1d(series, width, mode="nearest").tobytes()


@given(SERIES, st.integers(0, 30))
def test_a_running_median_is_that_of_scipy_to_the_bit(series: NDArray[np.float64], beside: int) -> None:
    width = 2 * min(beside, series.size - 1) + 1
    assert running_median(series, width).tobytes() == median_filter(series, width, mode="mirror").tobytes()


def test_a_long_series_has_a_running_median_too() -> None:
    series = np.random.default_rng(0).exponential(size=50_001)
    assert running_median(series, 101) == pytest.approx(median_filter(series, 101, mode="mirror"), abs=0.0)


@given(SERIES, st.integers(0, 500))
def test_a_running_maximum_is_that_of_scipy_to_the_bit(series: NDArray[np.float64], reach: int) -> None:
    due = maximum_filter1d(series, 2 * reach + 1, mode="constant")
    assert running_maximum(series, reach).tobytes() == due.tobytes()
