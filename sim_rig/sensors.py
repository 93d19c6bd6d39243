"""The sensors: noise, resolution and range; the anti-alias filter is part of the plant's kernel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigctl import scaling

RANGE = np.array([50e3, 0.125, 3.0, 200.0, 35e6])  # ± full scale: N, m, A, degC, Pa
RESOLUTION = np.array(scaling.CAPTURE)  # of the converters; the wire's counts are the same
LIVE_ZERO = -1.05  # of full scale: reading with a broken cable


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Standard deviations of white noise, channel by channel; a magnetostrictive sensor has about a micrometre."""

    force_n: float
    displacement_m: float = 1e-6
    current_a: float = 5e-4
    temperature_degc: float = 0.03
    pressure_pa: float = 2e4

    @property
    def row(self) -> NDArray[np.float64]:
        return np.array([self.force_n, self.displacement_m, self.current_a, self.temperature_degc, self.pressure_pa])


def read(truth: NDArray[np.float64], noise: Noise, random: np.random.Generator) -> NDArray[np.float64]:
    """Measured for true values, (n, 5): white noise added, rounded to the resolution, clipped to the range."""
    measured = truth + random.standard_normal(truth.shape) * noise.row
    quantised: NDArray[np.float64] = np.clip(np.round(measured / RESOLUTION) * RESOLUTION, -RANGE, RANGE)
    return quantised
