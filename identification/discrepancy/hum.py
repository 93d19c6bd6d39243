"""Mains hum: a tone of one frequency and amplitude in every run, of any phase, between the lines of the excitation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.physical.model import Element, element
from identification.record import Record

Floats = NDArray[np.float64]

_SUPPLIES_HZ = (50.0, 60.0, 50.0 / 3.0, 400.0)  # mains, railway and aircraft supplies
_STANDS_OUT = 30.0  # power over the local level: by chance less than one line in 10^12
_MATERIAL = 0.003  # of rms force: less matters to nobody
_CYCLES = 5.0  # in the shortest run: slower, a tone is an offset or a drift
_SAME_AMPLITUDE = 0.35  # scatter over the runs beyond which it is no property of the channel


@dataclass(frozen=True, slots=True)
class Hum:
    """A tone common to all records."""

    frequency_hz: float
    amplitude: float  # N
    scatter: float  # of the amplitude from record to record, relative

    def element(self) -> Element:
        """The catalogue's element; its phase belongs to a run."""
        return element("mains_hum", {"amplitude": self.amplitude, "frequency": self.frequency_hz, "phase": 0.0})


def find_hum(residuals: Sequence[Floats], records: Sequence[Record]) -> Hum | None:
    """The strongest common tone in the residuals (one (M,) array per record, N), or None."""
    nyquist = min(0.5 / r.dt for r in records)
    wanted = {f for r in records for f in r.tones_hz} | {f for f in _SUPPLIES_HZ if f < 0.95 * nyquist}
    residuals = [e - np.mean(e) for e in residuals]
    slowest = _CYCLES / min(e.size * r.dt for e, r in zip(residuals, records, strict=True))
    force = np.concatenate([r.measured for r in records])
    least = _MATERIAL * float(np.sqrt(2.0 * np.mean(force**2)))
    best: Hum | None = None
    for coarse in wanted:
        frequency = _refine(coarse, residuals, records)
        if frequency < slowest:
            continue
        amplitudes, ratios = zip(
            *(_tone(e, r.dt, frequency) for e, r in zip(residuals, records, strict=True)), strict=True
        )
        middle = float(np.median(amplitudes))
        scatter = float(np.std(amplitudes)) / max(middle, 1e-300)
        seen = np.mean(np.array(ratios) > _STANDS_OUT)
        if middle > least and seen >= 0.75 and scatter < _SAME_AMPLITUDE and (best is None or middle > best.amplitude):
            best = Hum(frequency, middle, scatter)
    return best


def hum_in(record: Record, residual: Floats, hum: Hum) -> Floats:
    """The tone as it is in one record, (N,), N, fitted to the residual of its window."""
    turn = 2.0 * np.pi * hum.frequency_hz * record.motion.t
    inside = turn[record.window]
    basis = np.column_stack([np.sin(inside), np.cos(inside)])
    sine, cosine = np.linalg.lstsq(basis, residual, rcond=None)[0]
    tone: Floats = sine * np.sin(turn) + cosine * np.cos(turn)
    return tone


def _refine(coarse: float, residuals: Sequence[Floats], records: Sequence[Record]) -> float:
    """Frequency of the largest common power within a line's width of `coarse`, Hz."""
    width = 1.0 / min(r.size * q.dt for r, q in zip(residuals, records, strict=True))
    frequency = coarse
    for span in (width, 0.2 * width, 0.04 * width):
        grid = frequency + np.linspace(-span, span, 11)
        power = [
            sum(_amplitude(e, r.dt, f) ** 2 * e.size / r.sigma**2 for e, r in zip(residuals, records, strict=True))
            for f in grid
        ]
        frequency = float(grid[int(np.argmax(power))])
    return frequency


def _amplitude(residual: Floats, dt: float, frequency: float) -> float:
    turn = np.exp(-2j * np.pi * frequency * dt * np.arange(residual.size))
    return float(2.0 * np.abs(np.dot(residual, turn)) / residual.size)


def _tone(residual: Floats, dt: float, frequency: float) -> tuple[float, float]:
    """Amplitude at a frequency, and its power over the level of the lines beside it."""
    amplitude = _amplitude(residual, dt, frequency)
    width = 1.0 / (residual.size * dt)
    beside = [_amplitude(residual, dt, frequency + k * width) for k in (*range(-14, -2), *range(3, 15))]
    return amplitude, amplitude**2 / max(float(np.median(np.square(beside))) / np.log(2.0), 1e-300)
