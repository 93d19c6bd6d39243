"""Checks on the host: the whole waveform, before its first sample leaves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import LimitError
from rigctl.limits import Limits


def check_waveform(
    displacement_m: NDArray[np.float64], current_a: NDArray[np.float64], sample_rate_hz: float, limits: Limits
) -> None:
    """Refuse a waveform that leaves the limits anywhere, differences taken from sample to sample.

    Raises
    ------
    LimitError
        One line: which quantity, at which sample, its value, and the limit.
    """
    velocity = np.diff(displacement_m) * sample_rate_hz
    _within("displacement", displacement_m, limits.position_min_m, limits.position_max_m, "m")
    _within("velocity", velocity, -limits.velocity_m_s, limits.velocity_m_s, "m/s")
    _within("current", current_a, limits.current_min_a, limits.current_max_a, "A")


def _within(name: str, values: NDArray[np.float64], low: float, high: float, unit: str) -> None:
    bad = np.flatnonzero(~((values >= low) & (values <= high)))  # the negation catches NaN too
    if bad.size:
        worst = values[bad][np.argmax(np.abs(values[bad]))]
        raise LimitError(
            f"{name} leaves {low:g} … {high:g} {unit}: {values[bad[0]]:.6g} at sample {bad[0]}, "
            f"{bad.size} samples in all, worst {worst:.6g}"
        )
