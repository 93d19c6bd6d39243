"""A tone in a record: what can be seen of it beside the motion, and its frequency by the clock of that record."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.criteria import BUDGET, CHANCE, FORM
from identification.record import Record

Floats = NDArray[np.float64]

_FEWEST = 8  # samples whose spectrum has a line with one on each side
# Lines by which the parabola through the peak of a motion is off, at its k-th harmonic k times as many: the largest of
# 193 triangles with rests, of 3 to 10 periods, was 0.0175. From the hundredth harmonic on nobody knows their lines:
# a tone is then told by the harmonics beside it. Half: only from the two hundredth; double: from the fiftieth.
_OFF = 0.02
_HARMONICS = 2.5  # of a sine on each side of a tone: two in any case. Half: one; double: two tones may hide each other


def frequency_in(record: Record, residual: Floats, common_hz: float) -> float:
    """Frequency of a tone in the residual (M,), N, of one record, Hz: clocks and supplies differ by `FORM.clocks`.

    The common one, where a record has fewer than two samples of its cycle, or hardly any.
    """
    if not common_hz < 0.5 / record.dt or residual.size < _FEWEST:
        return common_hz
    near = Near(changing(residual, record), record.motion.t[record.window], common_hz)
    return by_own_clock(common_hz, near, sight_of(record))


def by_own_clock(common_hz: float, near: Near, sight: Sight) -> float:
    """Frequency of a tone by the clock of one record, Hz; the common one where the record hides it, as one in step
    with its motion: beside that frequency it would tell of nothing."""
    if sight.left(common_hz) <= FORM.tone_left:
        return common_hz
    return refined(common_hz, [near], [sight], FORM.clocks * common_hz)


def changing(residual: Floats, record: Record) -> Floats:
    """The residual less its mean, and less what every period of the motion repeats: that is no tone of its own."""
    period = _repeating(record, residual.size)
    if not period:
        return residual - np.mean(residual)
    periods = residual.reshape(-1, period)
    return np.asarray((periods - periods.mean(axis=0)).ravel())


def _repeating(record: Record, samples: int) -> int:
    """The period of a record of which so many samples are two whole ones or more, else 0."""
    period = record.period
    return period if period and samples >= 2 * period and samples % period == 0 else 0


@dataclass(frozen=True, slots=True)
class Sight:
    """How far a tone can be seen in a record."""

    samples: int
    period: int
    dt: float
    sigma: float
    fundamental: float | None  # Hz, of a motion that is one sine and has no two periods to compare

    def left(self, frequency: float) -> float:
        """Share of a tone's amplitude that `changing` leaves of it; none of one that a sine's harmonics may hide, as
        far as it is known where they are.

        A tone e^{iωt} has the mean period D·e^{iωt}, D = Σ e^{iωTk}/P over the P periods T: 1 − |D|² of it is left.
        """
        if self.period:
            turn = 2.0 * np.pi * frequency * self.period * self.dt * np.arange(self.samples // self.period)
            return 1.0 - float(np.abs(np.mean(np.exp(1j * turn))) ** 2)
        if self.fundamental is None or not self.knows_harmonics(frequency):
            return 1.0
        harmonic = round(frequency / self.fundamental)
        away = abs(frequency - harmonic * self.fundamental) * self.samples * self.dt
        return 0.0 if away < FORM.tone_lines and harmonic > 0 else 1.0

    def knows_harmonics(self, frequency: float) -> bool:
        """Whether it is known on which lines near a frequency a sine's harmonics are."""
        return self.fundamental is None or _OFF * frequency / self.fundamental <= FORM.tone_lines

    @property
    def weight(self) -> float:
        """Of what this record tells among others."""
        return self.samples / self.sigma**2


def sight_of(record: Record) -> Sight:
    samples = record.measured.size
    period = _repeating(record, samples)
    return Sight(samples, period, record.dt, record.sigma, None if period else _fundamental(record))


def _fundamental(record: Record) -> float | None:
    """Frequency of a motion that is one sine, Hz, between the lines by the parabola through its peak, else None."""
    at = np.arange(record.motion.x.size)[record.window]
    x = record.motion.x[at[0] : at[-1] + 1]  # with what of it is left out: an even row in time
    power = np.abs(np.fft.rfft((x - np.mean(x)) * np.hanning(x.size))) ** 2
    k = int(np.argmax(power[1:-1])) + 1
    if np.sum(power[max(k - 2, 0) : k + 3]) <= (1.0 - FORM.tone_left) * np.sum(power):
        return None
    below, peak, above = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
    return float(k + 0.5 * (below - above) / (below - 2.0 * peak + above)) / (x.size * record.dt)


class Near:
    """A residual demodulated at one frequency and summed in blocks, so that amplitudes near it cost little."""

    def __init__(self, residual: Floats, times: Floats, centre: float) -> None:
        self.samples, self.width, self.centre = residual.size, 1.0 / float(np.ptp(times)), centre
        self._residual, self._at = residual, times
        demodulated = residual * np.exp(-2j * np.pi * centre * times)
        starts = np.arange(0, residual.size, -(-residual.size // BUDGET.tone_blocks))
        self._sums = np.add.reduceat(demodulated, starts)
        self._times = np.add.reduceat(times, starts) / np.diff(np.append(starts, residual.size))

    def amplitudes(self, frequencies: Floats) -> Floats:
        """Amplitude at each frequency (K,) within some lines of the centre, (K,), N."""
        turns = np.exp(-2j * np.pi * np.outer(frequencies - self.centre, self._times))
        out: Floats = 2.0 * np.abs(turns @ self._sums) / self.samples
        return out

    def tone(self, frequency: float, sine: float | None = None, *, known: bool = True) -> tuple[float, float]:
        """Amplitude at a frequency, and its power over the level of the lines beside it; beside a motion that is one
        `sine`, Hz, also over the strongest line of its neighbourhood. Where it is `known` on which lines the harmonics
        are, they are none of these."""
        beside = self.amplitudes(frequency + self.width * np.array([*range(-14, -2), *range(3, 15)]))
        amplitude = float(self.amplitudes(np.array([frequency]))[0])
        level = max(float(np.median(beside**2)) / np.log(2.0), 1e-300)
        if sine is not None:
            level = max(level, self._strongest_beside(frequency, sine, known=known))
        return amplitude, amplitude**2 / level

    def _strongest_beside(self, frequency: float, sine: float, *, known: bool) -> float:
        """Largest squared amplitude within some harmonics of a tone, N², without what gaps in time make of it.

        A friction's jumps fall between two samples, now nearer to one, now to the other: lines of that, about as strong
        as the harmonics, lie anywhere between these.
        """
        rest = self._residual - tone_in(self._residual, self._at, frequency)(self._at)
        dt = float(np.min(np.diff(self._at)))
        row = np.zeros(round(float(np.ptp(self._at)) / dt) + 1)
        row[np.rint((self._at - self._at[0]) / dt).astype(int)] = rest
        f: Floats = np.fft.rfftfreq(2 * row.size, dt).astype(np.float64)
        lines, away = FORM.tone_lines * self.width, np.abs(f - frequency)
        near = (away < _HARMONICS * sine) & (away > lines) & (f > lines)
        if known:
            near &= np.abs(f - np.rint(f / sine) * sine) > lines
        power = np.abs(2.0 * np.fft.rfft(row, 2 * row.size) / self.samples) ** 2
        return float(np.max(power[near], initial=0.0))


def tone_in(residual: Floats, times: Floats, frequency: float) -> Callable[[Floats], Floats]:
    """The tone of a frequency that fits a residual (M,), N, best at its times (M,), s, as a function of time."""

    def waves(t: Floats) -> Floats:
        turn = 2.0 * np.pi * frequency * t
        return np.column_stack([np.sin(turn), np.cos(turn)])

    strengths, *_ = np.linalg.lstsq(waves(times), residual, rcond=None)
    return lambda t: np.asarray(waves(t) @ strengths)


def refined(coarse: float, near: Sequence[Near], sights: Sequence[Sight], reach: float) -> float:
    """Frequency of the largest common power within `reach` of `coarse`, Hz, to a hundredth of a line.

    Common is the mean power of the records in which a frequency can be seen. Their sum would be largest beside the
    tone, just where one more record comes into sight.
    """
    line = min(n.width for n in near)
    frequency, span = coarse, reach
    while True:
        steps = max(5, int(np.ceil(5.0 * min(span, reach) / line)))
        grid = frequency + np.linspace(-span, span, 2 * steps + 1)
        power = _common_power(grid, near, sights)
        frequency = float(grid[int(np.argmax(power))])
        if span <= 0.05 * line:
            return frequency
        span = span / steps


def _common_power(grid: Floats, near: Sequence[Near], sights: Sequence[Sight]) -> Floats:
    """Mean power of a tone at each frequency (K,), by what is left of it, (K,), N²; of the records whose sine hides
    none there. One that its periods take away tells that it is not larger, and counts."""
    power, weight = np.zeros(grid.size), np.zeros(grid.size)
    for n, s in zip(near, sights, strict=True):
        left = np.array([s.left(f) for f in grid])
        seen = left > CHANCE.rounding
        power[seen] += s.weight * n.amplitudes(grid[seen]) ** 2 / left[seen]
        weight[seen | bool(s.period)] += s.weight
    return np.asarray(power / np.maximum(weight, 1e-300))
