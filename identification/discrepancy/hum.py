"""Mains hum: a tone of one frequency and amplitude in every run, of any phase, between the lines of the excitation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.criteria import BUDGET, CHANCE, FORM
from identification.physical.elements import TONE
from identification.physical.model import Element, element
from identification.record import Record

Floats = NDArray[np.float64]

_SUPPLIES_HZ = (50.0, 60.0, 50.0 / 3.0, 400.0)  # mains, railway and aircraft supplies


@dataclass(frozen=True, slots=True)
class Hum:
    """A tone common to all records."""

    frequency_hz: float
    amplitude: float  # N
    scatter: float  # of the amplitude from record to record, relative

    def element(self) -> Element:
        """The catalogue's element; its phase belongs to a run."""
        return element(TONE.name, {"amplitude": self.amplitude, "frequency": self.frequency_hz, "phase": 0.0})


def find_hum(residuals: Sequence[Floats], records: Sequence[Record]) -> Hum | None:
    """The strongest common tone in the residuals (one (M,) array per record, N), or None."""
    # So many lines from the mean and from the Nyquist frequency, in the shortest run and the coarsest.
    slowest = FORM.tone_lines / min(e.size * r.dt for e, r in zip(residuals, records, strict=True))
    fastest = min(0.5 / r.dt for r in records) - slowest
    wanted = {f for r in records for f in r.tones_hz} | {f for f in _SUPPLIES_HZ if f < fastest}
    residuals = [_changing(e, r) for e, r in zip(residuals, records, strict=True)]
    sights = [_sight(r) for r in records]
    force = np.concatenate([r.measured for r in records])
    least = FORM.material * float(np.sqrt(2.0) * np.std(force))
    best: Hum | None = None
    for coarse in wanted:
        near = [_Near(e, r.motion.t[r.window], coarse) for e, r in zip(residuals, records, strict=True)]
        frequency = _refine(coarse, near, sights)
        left = np.array([s.left(frequency) for s in sights])
        if frequency < slowest or not np.any(left > FORM.tone_left):
            continue
        amplitudes, ratios = (
            np.array(q)[left > FORM.tone_left] for q in zip(*(n.tone(frequency) for n in near), strict=True)
        )
        amplitudes /= left[left > FORM.tone_left]
        middle = float(np.median(amplitudes))
        scatter = float(np.std(amplitudes)) / max(middle, 1e-300)
        seen = np.mean(ratios > CHANCE.tone_power)
        if (
            middle > least
            and seen >= 1.0 - FORM.minor
            and scatter < FORM.minor
            and (best is None or middle > best.amplitude)
        ):
            best = Hum(frequency, middle, scatter)
    return best


def _changing(residual: Floats, record: Record) -> Floats:
    """The residual less its mean, and less what every period of the motion repeats: that is no tone of its own."""
    period = record.period
    if not period or residual.size < 2 * period:
        return residual - np.mean(residual)
    periods = residual.reshape(-1, period)
    return np.asarray((periods - periods.mean(axis=0)).ravel())


@dataclass(frozen=True, slots=True)
class _Sight:
    """How far a tone can be seen in a record."""

    samples: int
    period: int
    dt: float
    sigma: float
    fundamental: float | None  # Hz, of a motion that is one sine and has no two periods to compare

    def left(self, frequency: float) -> float:
        """Share of a tone's amplitude that `_changing` leaves of it; none of one that a sine's harmonics may hide.

        A tone e^{iωt} has the mean period D·e^{iωt}, D = Σ e^{iωTk}/P over the P periods T: 1 − |D|² of it is left.
        """
        if self.period:
            turn = 2.0 * np.pi * frequency * self.period * self.dt * np.arange(self.samples // self.period)
            return 1.0 - float(np.abs(np.mean(np.exp(1j * turn))) ** 2)
        if self.fundamental is None:
            return 1.0
        harmonic = round(frequency / self.fundamental)
        away = abs(frequency - harmonic * self.fundamental) * self.samples * self.dt
        return 0.0 if away < FORM.tone_lines and harmonic > 0 else 1.0

    def weight(self, frequency: float) -> float:
        """Of the power at a frequency in what is left: then a tone weighs most at its own, however little is left."""
        left = self.left(frequency)
        return self.samples / self.sigma**2 / left if left > CHANCE.rounding else 0.0


def _sight(record: Record) -> _Sight:
    samples = record.measured.size
    period = record.period if samples >= 2 * record.period else 0
    return _Sight(samples, period, record.dt, record.sigma, None if period else _fundamental(record))


def _fundamental(record: Record) -> float | None:
    """Frequency of a motion that is one sine, Hz, between the lines by the parabola through its peak, else None."""
    x = record.motion.x[record.window]
    power = np.abs(np.fft.rfft((x - np.mean(x)) * np.hanning(x.size))) ** 2
    k = int(np.argmax(power[1:-1])) + 1
    if np.sum(power[max(k - 2, 0) : k + 3]) <= (1.0 - FORM.tone_left) * np.sum(power):
        return None
    below, peak, above = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
    return float(k + 0.5 * (below - above) / (below - 2.0 * peak + above)) / (x.size * record.dt)


def hum_in(record: Record, residual: Floats, hum: Hum) -> Floats:
    """The tone as it is in one record, (N,), N, fitted to the residual of its window."""
    turn = 2.0 * np.pi * hum.frequency_hz * record.motion.t
    inside = turn[record.window]
    basis = np.column_stack([np.sin(inside), np.cos(inside)])
    sine, cosine = np.linalg.lstsq(basis, residual, rcond=None)[0]
    tone: Floats = sine * np.sin(turn) + cosine * np.cos(turn)
    return tone


class _Near:
    """A residual demodulated at one frequency and summed in blocks, so that amplitudes near it cost little."""

    def __init__(self, residual: Floats, times: Floats, centre: float) -> None:
        self.samples, self.width, self.centre = residual.size, 1.0 / float(np.ptp(times)), centre
        demodulated = residual * np.exp(-2j * np.pi * centre * times)
        starts = np.arange(0, residual.size, -(-residual.size // BUDGET.tone_blocks))
        self._sums = np.add.reduceat(demodulated, starts)
        self._times = np.add.reduceat(times, starts) / np.diff(np.append(starts, residual.size))

    def amplitudes(self, frequencies: Floats) -> Floats:
        """Amplitude at each frequency (K,) within some lines of the centre, (K,), N."""
        turns = np.exp(-2j * np.pi * np.outer(frequencies - self.centre, self._times))
        out: Floats = 2.0 * np.abs(turns @ self._sums) / self.samples
        return out

    def tone(self, frequency: float) -> tuple[float, float]:
        """Amplitude at a frequency, and its power over the level of the lines beside it."""
        beside = self.amplitudes(frequency + self.width * np.array([*range(-14, -2), *range(3, 15)]))
        amplitude = float(self.amplitudes(np.array([frequency]))[0])
        return amplitude, amplitude**2 / max(float(np.median(beside**2)) / np.log(2.0), 1e-300)


def _refine(coarse: float, near: Sequence[_Near], sights: Sequence[_Sight]) -> float:
    """Frequency of the largest common power within a line's width of `coarse`, Hz."""
    width = max(n.width for n in near)
    frequency = coarse
    for span in (width, 0.2 * width, 0.04 * width):
        grid = frequency + np.linspace(-span, span, 11)
        power = sum(
            n.amplitudes(grid) ** 2 * np.array([s.weight(f) for f in grid]) for n, s in zip(near, sights, strict=True)
        )
        frequency = float(grid[int(np.argmax(power))])
    return frequency
