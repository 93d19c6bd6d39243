"""Windows that begin and end a signal at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from excitation.portable_math import cosine_and_sine

__all__ = ["fade"]


def fade(samples: int, length: int) -> NDArray[np.float64]:
    """0 at the first and last sample, 1 in the middle, (samples,), by (1 − cos πs)/2 over ``length`` samples each.

    Its slope is zero at all four ends, so that a signal of zero mean times it has no step in velocity.
    """
    length = min(length, samples // 2)
    rise = 0.5 * (1.0 - cosine_and_sine(0.5 * np.arange(length) / length)[0])
    window = np.ones(samples)
    window[:length] = rise
    window[samples - length :] = rise[::-1]
    return window
