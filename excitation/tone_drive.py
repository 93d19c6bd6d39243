"""A motion by its lines that has an amplitude of its own, as an excitation within bounds."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from excitation.bounds import Bounds
from excitation.kinds import Kind
from excitation.periodic import Multitone
from excitation.signal import JSON, Excitation, Samples, made_on_demand

__all__ = ["constant", "peaks_of", "tone_drive"]


def tone_drive(
    tones: Multitone,
    *,
    sample_rate_hz: float,
    periods: int,
    bounds: Bounds,
    level: float,
    current_a: float | None,
    kind: Kind,
    design: Mapping[str, JSON],
) -> Excitation:
    """The lines at their amplitudes times ``level``, scaled where the bounds ask for it.

    Raises DesignError where the bounds refuse.
    """
    full = peaks_of(tones, sample_rate_hz)
    factor = bounds.factor(full, level)
    tones, samples = tones.scaled(factor), tones.period_samples * periods
    current: Samples | None = None if current_a is None else partial(constant, current_a, samples)
    reached = [factor * peak for peak in full]
    return made_on_demand(
        kind=kind,
        sample_rate_hz=sample_rate_hz,
        period_samples=tones.period_samples,
        samples=samples,
        displacement_m=partial(_repeated, tones, periods),
        current_a=current,
        design=design,
        figures={
            "peak_displacement": reached[0],
            "peak_velocity": reached[1],
            "peak_acceleration": reached[2],
            "scaled_by": factor,
        },
    )


def peaks_of(tones: Multitone, sample_rate_hz: float) -> tuple[float, float, float]:
    """The largest displacement, speed and acceleration over one period."""
    moved = (tones.samples(), tones.derivative(sample_rate_hz), tones.second_derivative(sample_rate_hz))
    x, v, a = (float(np.abs(values).max()) for values in moved)
    return x, v, a


def _repeated(tones: Multitone, periods: int) -> NDArray[np.float64]:
    return np.tile(tones.samples(), periods)


def constant(value: float, samples: int) -> NDArray[np.float64]:
    """A current that does not change, (samples,)."""
    return np.full(samples, value)
