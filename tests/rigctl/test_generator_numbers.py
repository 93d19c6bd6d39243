"""A function generator is told the cycles of a test, also where one period of its samples holds several."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation import SineSpec, TriangleSpec, sine, triangle
from rigctl.errors import LimitError
from rigctl.machines.generator import numbers_of


@settings(max_examples=40, deadline=None)
@given(st.floats(0.2, 40.0), st.integers(3, 40), st.booleans())
def test_the_numbers_are_those_of_the_design(frequency: float, cycles: int, is_triangle: bool) -> None:
    asked = {"sample_rate_hz": 1000.0, "amplitude_m": 0.01, "frequency_hz": frequency, "cycles": cycles}
    made = triangle(TriangleSpec(**asked)) if is_triangle else sine(SineSpec(**asked))  # type: ignore[arg-type]
    told = numbers_of(made)
    assert told.cycles == cycles
    assert told.frequency_hz == pytest.approx(made.design["frequency"], rel=1e-12)
    assert told.amplitude_m == pytest.approx(0.01, rel=1e-9)


def test_a_part_of_a_cycle_is_refused() -> None:
    made = sine(SineSpec(sample_rate_hz=1000.0, amplitude_m=0.01, frequency_hz=30.0, cycles=11))
    more = np.concatenate([made.displacement_m, made.displacement_m[67:80]])
    with pytest.raises(LimitError, match="no whole number of cycles"):
        numbers_of(replace(made, displacement_m=more))
