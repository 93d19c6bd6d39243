"""Mains hum: a tone of one frequency and amplitude in every run, of any phase, between the lines of the excitation.

The frequency is one by the clock of the supply: by that of each run it may differ a little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.criteria import CHANCE, FORM
from identification.physical.elements import TONE
from identification.physical.model import Element, element
from identification.record import Record
from identification.tone import Near, by_own_clock, changing, frequency_in, refined, sight_of, tone_in

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
    residuals = [changing(e, r) for e, r in zip(residuals, records, strict=True)]
    sights = [sight_of(r) for r in records]
    force = np.concatenate([r.measured for r in records])
    least = FORM.material * float(np.sqrt(2.0) * np.std(force))
    best: Hum | None = None
    for coarse in wanted:
        near = [Near(e, r.motion.t[r.window], coarse) for e, r in zip(residuals, records, strict=True)]
        common = refined(coarse, near, sights, max(n.width for n in near))
        own = [by_own_clock(common, n, s) for n, s in zip(near, sights, strict=True)]
        frequency = float(np.median(own))
        left = np.array([s.left(f) for s, f in zip(sights, own, strict=True)])
        if frequency < slowest or not np.any(left > FORM.tone_left):
            continue
        tones = [
            n.tone(f, s.fundamental, known=s.knows_harmonics(f)) for n, s, f in zip(near, sights, own, strict=True)
        ]
        amplitudes, ratios = (np.array(q)[left > FORM.tone_left] for q in zip(*tones, strict=True))
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


def hum_in(record: Record, residual: Floats, hum: Hum) -> Floats:
    """The tone as it is in one record, (N,), N, fitted to the residual of its window."""
    frequency = frequency_in(record, residual, hum.frequency_hz)
    return tone_in(residual, record.motion.t[record.window], frequency)(record.motion.t)
