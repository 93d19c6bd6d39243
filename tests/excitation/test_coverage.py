"""The coverage index states a property of the distribution."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from excitation.coverage import coverage, cumulative_distribution
from excitation.errors import DesignError
from excitation.portable_math import uniform

quick = settings(max_examples=40, deadline=None)


def lattice(cells: int, per_cell: int) -> list[NDArray[np.float64]]:
    """The same number of samples in every cell of a square grid."""
    steps = (np.arange(cells * per_cell) + 0.5) / (cells * per_cell)
    x, y = np.meshgrid(steps, steps)
    return [x.ravel(), y.ravel()]


@quick
@given(st.integers(2, 12), st.integers(1, 4))
def test_the_same_number_in_every_cell_is_zero(cells: int, per_cell: int) -> None:
    assert coverage(lattice(cells, per_cell), (cells, cells)).index == pytest.approx(0.0, abs=1e-12)


@quick
@given(st.integers(2, 15), st.integers(2, 15), st.integers(1_000, 100_000))
def test_all_samples_in_one_cell_is_a_hundred_when_normalised(rows: int, columns: int, samples: int) -> None:
    x, y = np.full(samples, 0.01), np.full(samples, 0.01)
    x[0], y[0], x[1], y[1] = 0.0, 0.0, 1.0, 1.0  # two samples span the box
    found = coverage([x, y], (rows, columns))
    assert found.normalised == pytest.approx(100.0, abs=500.0 / samples)
    assert found.index == pytest.approx(found.normalised * (rows * columns - 1))


@quick
@given(st.integers(0, 10_000), st.integers(2, 5))
def test_repeating_the_samples_changes_nothing(seed: int, periods: int) -> None:
    x, y = uniform((seed, 0), 500), uniform((seed, 1), 500) ** 2
    once = coverage([x, y], (7, 5)).index
    assert coverage([np.tile(x, periods), np.tile(y, periods)], (7, 5)).index == pytest.approx(once)


@quick
@given(st.integers(0, 10_000), st.floats(-5, 5), st.floats(0.01, 100))
def test_units_and_offsets_change_nothing(seed: int, offset: float, scale: float) -> None:
    x, y = uniform((seed, 0), 400), uniform((seed, 1), 400)
    one = coverage([x, y], (6, 6)).counts
    other = coverage([offset + scale * x, y], (6, 6)).counts
    assert np.abs(one - other).sum() <= 4  # a sample on an edge may fall to either side


@pytest.mark.parametrize("cells", [5, 10, 20])
@pytest.mark.parametrize("samples", [20_000, 80_000])
def test_the_index_depends_neither_on_cells_nor_on_samples_beyond_the_counting_noise(cells: int, samples: int) -> None:
    """A density 1 + (cos πx)(cos πy)·0.8: its squared deviation is 0.8²/4 = 16 %, less what cells average
    away.
    """
    from scipy.stats import qmc

    points = qmc.Sobol(3, seed=1).random(2**18)[: 8 * samples]
    density = 1 + 0.8 * np.cos(np.pi * points[:, 0]) * np.cos(np.pi * points[:, 1])
    kept = points[2 * points[:, 2] < density][:samples]
    index = coverage([kept[:, 0], kept[:, 1]], (cells, cells)).index
    averaged = np.sinc(0.5 / cells) ** 4
    assert index == pytest.approx(16.0 * averaged, abs=0.5 + 100.0 * cells**2 / kept.shape[0])


def test_independent_uniform_samples_show_the_counting_noise_of_their_number() -> None:
    indices = [coverage([uniform((s, 0), 8192), uniform((s, 1), 8192)], (10, 10)).index for s in range(40)]
    assert np.mean(indices) == pytest.approx(100.0 * 99 / 8192, rel=0.1)


def test_a_variable_that_does_not_move_is_refused() -> None:
    with pytest.raises(DesignError, match="constant"):
        coverage([np.ones(10), uniform((1,), 10)], (3, 3))
    with pytest.raises(DesignError, match="one number of cells"):
        coverage([uniform((1,), 10)], (3, 3))


def test_the_cumulative_distribution_of_an_even_ramp_is_a_line() -> None:
    values, share = cumulative_distribution(np.linspace(0.0, 1.0, 101)[::-1])
    assert np.ptp(np.diff(values)) < 1e-12
    assert share[-1] == 1.0
