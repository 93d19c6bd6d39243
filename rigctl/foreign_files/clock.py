"""The sample rate from a column of times: its order, gaps and jitter are checked, and nothing is resampled unasked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import ForeignFileError

__all__ = ["Clock", "read_clock", "resampled"]

Floats = NDArray[np.float64]

_SILENT: Final = 0.02  # of a sample: rounding of the written times; half and double: more or fewer lines are printed
_GAP: Final = 1.5  # sample intervals between two rows: one row is missing. Half a sample of jitter is no gap yet
_UNEVEN: Final = 0.5  # of a sample: a sample that is nearer to its neighbour's time is not where it is counted
_AGREE: Final = 5e-3  # of the rate: a stated rate and that of the times may differ by a clock, not by a factor
_BLOCK: Final = 1 << 18  # samples
_LEAST_DOUBLES: Final = 8  # times that stand twice; of fewer nobody can tell whether they are even
_LARGEST_HOLE: Final = 10  # sample intervals that are interpolated: beyond that the motion within is not known


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """The rate of even samples, Hz, and what there is to tell of the times."""

    rate_hz: float
    told: tuple[str, ...] = ()


def read_clock(time_s: Floats, row: Callable[[int], str], stated_hz: float | None = None) -> Clock:
    """The rate of samples at these times, (N,), s.

    Raises
    ------
    ForeignFileError
        Where a time is missing, repeated or goes back, where rows are missing, where the samples are uneven, or where
        the stated rate is another one: what, where, and what can be done.
    """
    coarse = _coarse(time_s)
    if coarse is not None:
        return coarse
    steps = _checked_steps(time_s, row)
    interval = _usual(steps)
    rate = _tidy((time_s.size - 1) / float(time_s[-1] - time_s[0]))
    gaps = np.flatnonzero(steps > _GAP * interval)
    if gaps.size:
        raise ForeignFileError(_gap_text(time_s, steps, gaps, interval, row))
    stray = _stray(time_s, rate)
    if stray > _UNEVEN:
        raise ForeignFileError(
            f"the samples are uneven: times stray by {stray:.3g} samples from an even {rate:.6g} Hz: "
            f"--resample {_round_rate(rate):g} interpolates them to even times"
        )
    if stated_hz is not None and abs(stated_hz - rate) > _AGREE * rate:
        raise ForeignFileError(
            f"the times are those of {rate:.6g} Hz and {stated_hz:g} Hz is stated: one of the two is wrong; "
            "correct --rate, or leave the times out with --time none"
        )
    if stray <= _SILENT:
        return Clock(rate_hz=rate)
    return Clock(
        rate_hz=rate, told=(f"the times jitter by up to {stray:.2g} of a sample: taken as even, {rate:.6g} Hz",)
    )


def _coarse(time_s: Floats) -> Clock | None:
    """The clock of times that are written with fewer digits than the samples need, so that some stand twice."""
    if time_s.size < 16 or not np.all(np.isfinite(time_s)):
        return None
    if not np.any(time_s[1:] == time_s[:-1]):  # soon known, and nearly always so
        return None
    steps = np.diff(time_s)
    if not _even_doubles(np.flatnonzero(steps == 0.0)):
        return None
    if not (np.all(steps >= 0.0) and time_s[-1] > time_s[0]):
        return None
    digit = float(np.min(steps[steps > 0.0]))
    rate = (time_s.size - 1) / float(time_s[-1] - time_s[0])
    if _stray(time_s, rate) > digit * rate:
        return None
    rate = _round_rate(rate) if abs(_round_rate(rate) / rate - 1.0) * time_s.size < digit * rate else rate
    return Clock(
        rate_hz=rate,
        told=(f"the times are written to {digit:.3g} s, so some stand twice: taken as even, {rate:.6g} Hz",),
    )


def _even_doubles(at: NDArray[np.intp]) -> bool:
    """Whether times stand twice as rounding makes them: often, and at even distances. A row that was written twice is
    neither.
    """
    if at.size < _LEAST_DOUBLES:
        return False
    apart = np.diff(at)
    return bool(np.ptp(apart) <= 1 + 0.5 * np.median(apart))


def resampled(
    time_s: Floats, channels: dict[str, Floats], rate_hz: float, row: Callable[[int], str]
) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """The channels, (N,) each, at even times by linear interpolation, and what to tell.

    Raises ForeignFileError where times go back or repeat, or where a hole is too large to be filled.
    """
    steps = _checked_steps(time_s, row)
    interval = _usual(steps)
    hole = int(np.argmax(steps))
    if steps[hole] > _LARGEST_HOLE * interval:
        raise ForeignFileError(
            f"{row(hole)}: {steps[hole]:.4g} s without a sample, {steps[hole] / interval:.0f} intervals: "
            "too long to interpolate; cut the file there"
        )
    even = time_s[0] + np.arange(int((time_s[-1] - time_s[0]) * rate_hz + 1e-6) + 1) / rate_hz
    gaps = int(np.sum(steps > _GAP * interval))
    told = f"resampled from about {1.0 / interval:.5g} Hz to {rate_hz:g} Hz by linear interpolation, {gaps} gaps filled"
    more = (f"{rate_hz:g} Hz is below the recorded rate: what lies above {rate_hz / 2:g} Hz is folded back",)
    return {name: np.interp(even, time_s, values) for name, values in channels.items()}, (
        told,
        *(more if rate_hz < 0.9 / interval else ()),
    )


def _checked_steps(time_s: Floats, row: Callable[[int], str]) -> Floats:
    """The differences of the times; raises where one is missing, or does not grow."""
    if time_s.size < 2:
        raise ForeignFileError(f"{time_s.size} sample{'s' * (time_s.size != 1)}: a run needs two or more")
    missing = np.flatnonzero(~np.isfinite(time_s))
    if missing.size:
        raise ForeignFileError(
            f"{row(int(missing[0]))}: the time is missing: correct the line, or --time none --rate HZ"
        )
    steps = np.diff(time_s)
    bad = np.flatnonzero(steps <= 0.0)
    if bad.size:
        n = int(bad[0])
        how = "stands twice" if steps[n] == 0.0 else f"goes back by {-steps[n]:.4g} s"
        more = f" ({bad.size} such rows)" if bad.size > 1 else ""
        raise ForeignFileError(
            f"{row(n + 1)}: the time {how}{more}: correct the file, cut it there, or state --time none --rate HZ"
        )
    return steps


def _gap_text(time_s: Floats, steps: Floats, gaps: NDArray[np.intp], interval: float, row: Callable[[int], str]) -> str:
    n = int(gaps[0])
    lost = sum(max(1, round(step / interval) - 1) for step in steps[gaps].tolist())
    return (
        f"{row(n + 1)}: {round(steps[n] / interval) - 1 or 1} rows are missing at {time_s[n] - time_s[0]:.4g} s "
        f"({gaps.size} gaps, {lost} rows in all): --resample {_round_rate(1.0 / interval):g} interpolates"
    )


def _usual(steps: Floats) -> float:
    """The median interval, of no more than 10⁵ of them."""
    return float(np.median(steps[:: max(1, steps.size // 100_000)]))


def _stray(time_s: Floats, rate_hz: float) -> float:
    """The largest distance of a time from an even one, in samples; in blocks, which take little memory."""
    worst = 0.0
    for start in range(0, time_s.size, _BLOCK):
        block = time_s[start : start + _BLOCK] - time_s[0]
        block *= rate_hz
        block -= np.arange(start, start + block.size)
        worst = max(worst, float(block.max()), -float(block.min()))
    return worst


def _tidy(rate_hz: float) -> float:
    """A rate within a millionth of a whole number is that number."""
    return float(round(rate_hz)) if rate_hz > 0.5 and abs(rate_hz - round(rate_hz)) < 1e-6 * rate_hz else rate_hz


def _round_rate(rate_hz: float) -> float:
    return float(f"{rate_hz:.4g}")
