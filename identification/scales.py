"""The scales of a set of records: everything that a first guess of a parameter needs, so that no guess knows a unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.record import Record


@dataclass(frozen=True, slots=True, kw_only=True)
class Scales:
    """Typical magnitudes over all records, SI."""

    force: float  # rms
    gap: float  # rms of what is missing
    x_rms: float
    x_max: float
    v_rms: float
    v_max: float
    speeds: tuple[float, float, float, float]  # quantiles 15, 40, 65, 85 % of |v|
    a_rms: float
    motion_time: float  # rms v / rms a: how long a motion takes
    current_low: float
    current_high: float
    current_time: float  # rms of the current's swing / rms of its rate
    warmth: float  # span of temperature over the records, K
    duration: float


def scales_of(records: Sequence[Record], gap: float) -> Scales:
    """Scales of the windows of `records`; `gap` is the rms of the residual, N."""
    join = {
        name: np.concatenate([getattr(r.motion, name)[r.window] for r in records])
        for name in ("x", "v", "a", "i", "temperature")
    }
    centred = np.concatenate([r.motion.x[r.window] - np.mean(r.motion.x[r.window]) for r in records])
    swing = np.concatenate([r.motion.i[r.window] - np.mean(r.motion.i[r.window]) for r in records])
    rates = np.concatenate([np.diff(r.motion.i[r.window]) / r.dt for r in records])
    force = np.concatenate([r.measured for r in records])
    size = {name: rms(values) for name, values in join.items()}
    speeds = np.quantile(np.abs(join["v"]), (0.15, 0.40, 0.65, 0.85))
    return Scales(
        force=rms(force),
        gap=gap,
        x_rms=rms(centred),
        x_max=float(np.max(np.abs(join["x"]))),
        v_rms=size["v"],
        v_max=float(np.max(np.abs(join["v"]))),
        speeds=(float(speeds[0]), float(speeds[1]), float(speeds[2]), float(speeds[3])),
        a_rms=size["a"],
        motion_time=size["v"] / max(size["a"], 1e-300),
        current_low=float(np.min(join["i"])),
        current_high=float(np.max(join["i"])),
        current_time=max(rms(swing) / max(rms(rates), 1e-300), records[0].dt),
        warmth=float(np.ptp(join["temperature"])),
        duration=float(max(r.force.size * r.dt for r in records)),
    )


def rms(values: np.ndarray) -> float:
    """Root mean square of any number of values, as they are."""
    return float(np.sqrt(np.mean(values**2)))
