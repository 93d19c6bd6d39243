"""Which DFT lines of a period are excited, and which are left out to detect nonlinearity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_within
from excitation.configuration import STRICT
from excitation.errors import DesignError
from excitation.portable_math import uniform

__all__ = ["LineChoice", "Lines", "LogLines", "band_lines", "chosen_lines", "excited_lines"]

Lines = Literal["all", "odd", "odd-random"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LogLines:
    """``count`` frequencies evenly spaced by their logarithm over the band, each moved to the nearest DFT line.

    Where lines are wider apart than these, several fall together: there are then fewer. ``odd``: odd lines only;
    without it the nearest lines, where a low crest factor is sought odd ones if they are as many.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    count: int
    odd: bool | None = None

    def __post_init__(self) -> None:
        check_within("count", self.count, 2, 100_000)


LineChoice = Lines | LogLines | tuple[float, ...]
"""A rule, lines spaced by their logarithm, or the frequencies themselves, Hz."""


def chosen_lines(
    band: NDArray[np.int64], choice: LineChoice, group: int, seed: int, spacing_hz: float, *, flat: bool = False
) -> NDArray[np.int64]:
    """The lines of the band, (B,), that carry power, (K,); lines are ``spacing_hz`` apart. ``flat``: a low crest factor
    is sought.

    Raises DesignError where no line is left, or a frequency is on no line of the band.
    """
    match choice:
        case LogLines():
            return _log_lines(band, choice.count, odd=choice.odd, flat=flat)
        case tuple():
            return _given_lines(band, choice, spacing_hz)
    return excited_lines(band, choice, group, seed)[0]


def _log_lines(band: NDArray[np.int64], count: int, *, odd: bool | None, flat: bool) -> NDArray[np.int64]:
    """The second half of a motion on odd lines is the first with the opposite sign: half as many peaks to keep down."""
    every, only = band, band[band % 2 == 1]
    if odd and only.size == 0:
        raise DesignError("lines: no odd line of the band is left; widen the band or raise period_samples")
    if odd:
        return _nearest(only, count)
    nearest = _nearest(every, count)
    if odd is None and flat and only.size >= nearest.size:
        odd_ones = _nearest(only, count)
        return odd_ones if odd_ones.size == nearest.size else nearest
    return nearest


def _nearest(allowed: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Those of equally spaced lines that are nearest to ``count`` values spaced by their logarithm."""
    first, last = float(allowed[0]), float(allowed[-1])
    # nine digits: powers differ in the last bit between machines
    wanted = np.array([float(f"{first * (last / first) ** (n / (count - 1)):.9g}") for n in range(count)])
    step = float(allowed[1] - allowed[0]) if allowed.size > 1 else 1.0
    nearest = np.rint((wanted - first) / step).astype(np.int64)
    return np.asarray(allowed[np.unique(np.clip(nearest, 0, allowed.size - 1))])


def _given_lines(band: NDArray[np.int64], frequency_hz: tuple[float, ...], spacing_hz: float) -> NDArray[np.int64]:
    if not frequency_hz:
        raise DesignError('lines is an empty list: give the frequencies, or "all"')
    beyond = (float(band[-1]) + 1.0) * spacing_hz  # clipped before the division, which may overflow
    numbers = np.rint(np.clip(np.asarray(frequency_hz), 0.0, beyond) / spacing_hz).astype(np.int64)
    for given, number in zip(frequency_hz, numbers.tolist(), strict=True):
        if abs(given - number * spacing_hz) > 1e-6 * spacing_hz or not band[0] <= number <= band[-1]:
            raise DesignError(
                f"lines: {given:g} Hz is no line of the band {band[0] * spacing_hz:g} … {band[-1] * spacing_hz:g} Hz: "
                f"lines are {spacing_hz:g} Hz apart, the nearest is {number * spacing_hz:g} Hz"
            )
    if np.unique(numbers).size != numbers.size:
        raise DesignError("lines names a frequency twice: each may be given once")
    return np.sort(numbers)


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
