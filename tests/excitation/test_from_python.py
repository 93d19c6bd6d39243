"""Specifications and excitations that are made in Python, with whatever stands in their fields."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from excitation import DesignError, Excitation, SineSpec, excitation_from_config, sine

SPEC: dict[str, Any] = {"sample_rate_hz": 1000.0, "amplitude_m": 0.01, "frequency_hz": 2.0, "cycles": 3}


def excitation(**given: Any) -> Excitation:
    own = {"kind": "custom", "sample_rate_hz": 100.0, "period_samples": 0, "displacement_m": np.zeros(4)}
    return Excitation(**{**own, **given})


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: sine(SineSpec(**{**SPEC, "sample_rate_hz": "a"})), "sample_rate is 'a': it must be a number"),
        (lambda: sine(SineSpec(**{**SPEC, "sample_rate_hz": None})), "sample_rate is None: it must be a number"),
        (lambda: sine(SineSpec(**{**SPEC, "cycles": 2.5})), "cycles is 2.5 .float.: it must be int"),
        (lambda: sine(SineSpec(**{**SPEC, "cycles": 0})), "cycles is 0"),
        (lambda: sine(SineSpec(**{**SPEC, "amplitude_m": 1e308})), "displacement reaches 1e.308: it must stay within"),
        (lambda: excitation(displacement_m=["a"]), "displacement is .'a'.: it must be a 1-D array of real numbers"),
        (lambda: excitation(displacement_m=[[1.0], [1.0, 2.0]]), "must be a 1-D array of real numbers"),
        (lambda: excitation(displacement_m=np.ones(3) * 1j), "must be a 1-D array of real numbers"),
        (lambda: excitation(displacement_m=[1e308, -1e308]), "displacement reaches 1e.308"),
        (lambda: excitation(current_a=[1e300] * 4), "current reaches 1e.300"),
        (lambda: excitation(sample_rate_hz="100"), "sample_rate is '100': it must be a number, Hz"),
        (lambda: excitation(sample_rate_hz=1e300), "sample_rate is 1e.300 Hz: it must lie in"),
        (lambda: excitation(period_samples=1.5), "period_samples is 1.5: it must be a whole number"),
        (lambda: excitation_from_config(None), "configuration is None: it must be a table"),  # type: ignore[arg-type]
        (lambda: excitation_from_config([1]), "configuration is .1.: it must be a table"),  # type: ignore[arg-type]
    ],
)
def test_what_is_of_another_type_or_size_is_refused_in_one_line(make: Callable[[], Excitation], says: str) -> None:
    with pytest.raises(DesignError, match=says) as refused:
        make()
    assert "\n" not in str(refused.value)


def test_lists_and_whole_numbers_are_arrays() -> None:
    made = excitation(displacement_m=[0, 1, 2, 1], current_a=(1, 1, 1, 1))
    assert made.displacement_m.dtype == np.float64
    assert made.velocity_m_s.size == made.samples == 4
