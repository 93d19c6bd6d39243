"""Which lines carry power: by rules, spaced by their logarithm, and as given."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from excitation.errors import DesignError
from excitation.lines import LogLines, band_lines, chosen_lines
from excitation.synthesis import excitation_from_config

BASE: dict[str, Any] = {"kind": "multisine", "sample_rate": 1000.0, "period_samples": 4000}
DISPLACEMENT = {"f_min": 0.25, "f_max": 30.0, "max_displacement": 0.02, "max_velocity": 0.5}


def excited(lines: object) -> NDArray[np.float64]:
    """The frequencies that carry power, Hz."""
    made = excitation_from_config({**BASE, "displacement": {**DISPLACEMENT, "lines": lines}})  # type: ignore[dict-item]
    amplitude = np.abs(np.fft.rfft(made.displacement_m))
    return np.flatnonzero(amplitude > 1e-9 * amplitude.max()) * 0.25


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 60), st.booleans(), st.integers(3, 9))
def test_lines_spaced_by_their_logarithm_lie_on_the_grid_and_span_the_band(count: int, odd: bool, last: int) -> None:
    band = band_lines(0.25, 4.0 * last, 1000.0, 4000)
    lines = chosen_lines(band, LogLines(count=count, odd=odd), 4, 0, 0.25)
    assert 2 <= lines.size <= count
    assert (np.diff(lines) > 0).all()
    assert not odd or (lines % 2 == 1).all()
    assert lines[0] == 1
    assert lines[-1] in (16 * last, 16 * last - 1)
    wide = lines[lines > 60]
    ratio = np.diff(np.log(wide.astype(float)))
    assert wide.size < 3 or np.ptp(ratio) < 4.1 * (2 if odd else 1) / 60  # even, up to the move to a line


def test_lines_spaced_by_their_logarithm_are_odd_ones_for_a_low_crest_factor_where_none_is_lost() -> None:
    for low, high in ((10, 1000), (20, 2000), (3, 300), (1, 100)):
        band = np.arange(low, high + 1)
        plain, flat, odd = (
            chosen_lines(band, LogLines(count=35, odd=odd), 4, 0, 1.0, flat=flat)
            for odd, flat in ((None, False), (None, True), (True, True))
        )
        assert flat.size == plain.size
        assert np.array_equal(flat, odd if odd.size == plain.size else plain)
        assert np.abs(flat - plain)[[0, -1]].max() <= 1
    assert np.array_equal(chosen_lines(np.arange(10, 1001), LogLines(count=35, odd=False), 4, 0, 1.0, flat=True),
                          chosen_lines(np.arange(10, 1001), LogLines(count=35), 4, 0, 1.0))  # fmt: skip


def test_35_log_spaced_lines_over_two_decades_have_a_crest_factor_below_2_1() -> None:
    spacing = 500.0 / 2**13
    motion = {"f_min": 10 * spacing, "f_max": 1000.2 * spacing, "lines": {"count": 35}, "spectrum": "flat",
              "max_displacement": 0.02, "max_velocity": 50.0}  # fmt: skip
    asked = {"kind": "multisine", "sample_rate": 500.0, "period_samples": 2**13, "displacement": motion}
    made = excitation_from_config({**asked, "phases": "crest", "crest_of": "displacement"})  # type: ignore[dict-item]
    x = made.displacement_m[-made.period_samples :]
    power = np.abs(np.fft.rfft(x)) ** 2
    assert np.sum(power > 1e-9 * power.max()) == 35
    assert np.abs(x).max() / x.std() < 2.1


def test_the_lines_that_are_given_are_those_that_carry_power() -> None:
    assert excited([0.25, 1.0, 2.5, 17.75]).tolist() == [0.25, 1.0, 2.5, 17.75]
    assert excited({"count": 5}).tolist() == [0.25, 0.75, 2.75, 9.0, 30.0]


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ([1.1], "1.1 Hz is no line.*the nearest is 1 Hz"),
        ([40.0], "40 Hz is no line of the band 0.25 … 30 Hz"),
        ([1.0, 1.0], "twice"),
        ([], "empty list"),
        ([-1e300], "is no line"),
        ([1e308], "is no line"),
        ({"count": 1}, "count is 1"),
        ({"number": 3}, "number = 3 is not a known key: known are count, odd"),
        ("even", "lines is 'even'"),
    ],
)
def test_lines_that_are_none_are_refused_in_one_line(lines: object, says: str) -> None:
    with pytest.raises(DesignError, match=says):
        excited(lines)
