"""How far a force swings about its mean, sample by sample: the errors of a model often grow with it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from identification.models.motion import Motion

Floats = NDArray[np.float64]


def swing_of(force: Floats, motion: Motion) -> Floats:
    """The rms of a force (N,) about its mean within half a mean cycle of the motion before and after each sample, N.

    A mean cycle lasts 2π·rms(x)/rms(v); of a motion without speed all samples count.
    """
    speed = float(np.std(motion.v))
    cycle = 2.0 * np.pi * float(np.std(motion.x)) / max(speed, np.finfo(np.float64).tiny) / motion.dt
    width = int(np.clip(cycle, 1.0, force.size)) if speed > 0.0 else force.size
    squares = uniform_filter1d((force - np.mean(force)) ** 2, width, mode="nearest")
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))
