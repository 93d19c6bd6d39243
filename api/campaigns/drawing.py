"""A test as curves over time, for a person who looks at it before it is scheduled."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation import Test

__all__ = ["draw"]

_POINTS = 2000  # more than a chart has pixels
_SHOWN_S = 20.0  # of a test without a period: enough to see what it is


def draw(test: Test) -> dict[str, Any]:
    """Time (s), displacement (m), velocity (m/s) and current (A; None: not driven) of the first period of a test.

    A test without a period shows its first seconds; ``shown_s`` says how many. Lists of at most 2000 floats.
    Any: JSON.
    """
    excitation = test.excitation
    rate = excitation.sample_rate_hz
    shown = min(excitation.samples, max(excitation.period_samples, round(_SHOWN_S * rate)))
    step = -(-shown // _POINTS)
    velocity = np.gradient(excitation.displacement_m[: shown + 1]) * rate
    return {
        "name": test.name,
        "duration_s": excitation.duration_s,
        "shown_s": shown / rate,
        "time_s": _every(np.arange(shown) / rate, step),
        "displacement_m": _every(excitation.displacement_m[:shown], step),
        "velocity_m_s": _every(velocity[:shown], step),
        "current_a": None if excitation.current_a is None else _every(excitation.current_a[:shown], step),
    }


def _every(values: NDArray[np.float64], step: int) -> list[float]:
    """Every so many of the values, (n,), to six digits."""
    return [float(f"{value:.6g}") for value in values[::step]]
