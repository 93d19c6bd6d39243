"""Which DFT lines of a period are excited, and which are left out to detect nonlinearity."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from excitation.errors import DesignError
from excitation.portable_math import uniform

__all__ = ["Lines", "band_lines", "excited_lines"]

Lines = Literal["all", "odd", "odd-random"]


def band_lines(f_min_hz: float, f_max_hz: float, sample_rate_hz: float, period_samples: int) -> NDArray[np.int64]:
    """Every DFT line k with f_min ≤ k·fs/N ≤ f_max, without DC and the Nyquist line; (K,) int64.

    Raises DesignError where the band holds no line.
    """
    spacing_hz = sample_rate_hz / period_samples
    tiny = 1e-9  # a line that is on the edge up to rounding belongs to the band
    first = max(1, int(np.ceil(f_min_hz / spacing_hz - tiny)))
    last = min((period_samples - 1) // 2, int(np.floor(f_max_hz / spacing_hz + tiny)))
    if last < first:
        raise DesignError(
            f"f_min … f_max is {f_min_hz:g} … {f_max_hz:g} Hz: no DFT line lies there, lines are "
            f"{spacing_hz:g} Hz "
            "apart; widen the band or raise period_samples"
        )
    return np.arange(first, last + 1, dtype=np.int64)


def excited_lines(
    band: NDArray[np.int64], lines: Lines, group: int, seed: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The lines that carry power, and the detection lines inside the band that carry none.

    "odd": even lines are the detection lines. "odd-random": of each ``group`` of consecutive odd lines one,
    drawn by ``seed``, is left out as well, so that odd and even distortions are told apart.

    Raises DesignError where no line is left.

    References
    ----------
    Pintelon & Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012: random odd
    multisines.
    """
    if lines == "all":
        return band, band[:0]
    odd = band[band % 2 == 1]
    excited = odd if lines == "odd" else np.delete(odd, _one_of_each_group(odd.size, group, seed))
    if excited.size == 0:
        raise DesignError(f"lines is {lines!r}: no line of the band is left; widen the band or raise period_samples")
    return excited, np.setdiff1d(band, excited)


def _one_of_each_group(count: int, group: int, seed: int) -> NDArray[np.int64]:
    """Only whole groups lose a line: an incomplete last group keeps its lines."""
    groups = count // group
    within_group = np.floor(group * uniform((seed, 2), groups)).astype(np.int64)
    return np.arange(groups, dtype=np.int64) * group + within_group
