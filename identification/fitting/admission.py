"""Checks before a fit: free parameters, and enough conditions to determine them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.errors import DataError
from identification.fitting.leastsquares import free_parameters
from identification.physical.model import Model
from identification.record import Record, is_off, is_steady

_OF_A_SINE = 8  # parameters: two from the first harmonic, the others from its few upper harmonics
_SAME = 0.05  # two sines closer than this in frequency, amplitude and current are one condition
_PURE = 0.9  # share of the displacement's power in one line


def admit(model: Model, records: Sequence[Record]) -> None:
    """Raise DataError, one line that names the parameters and their count, where they cannot be determined."""
    free = free_parameters(model, records)
    if not free.any():
        raise DataError(f"'{model.name}' has no free parameter: set \"fixed\" to false for the parameters to fit")
    sines = [_sine(r) for r in records]
    conditions = _distinct([s for s in sines if s is not None])
    if all(s is not None for s in sines) and int(free.sum()) > _OF_A_SINE * conditions:
        named = ", ".join(name for name, f in zip(model.names(), free, strict=True) if f)
        raise DataError(
            f"{int(free.sum())} free parameters ({named}) on {conditions} sine{'s' * (conditions > 1)}: one sine "
            f"determines at most {_OF_A_SINE}; add tests of other amplitudes, frequencies or currents, or fix some"
        )


def _sine(record: Record) -> tuple[float, float, float] | None:
    """Frequency, amplitude and mean current of a record that holds one frequency; None for any other."""
    x = record.motion.x[record.window]
    x = x - x.mean()
    power = np.abs(np.fft.rfft(x * np.hanning(x.size))) ** 2
    k = int(np.argmax(power))
    if power[max(k - 2, 0) : k + 3].sum() < _PURE * power.sum():
        return None
    i = record.motion.i[record.window]
    if not is_steady(i, 0.1):
        return None  # a varying current gives more than one condition
    return k / (x.size * record.dt), float(np.sqrt(2.0) * x.std()), 0.0 if is_off(i) else float(i.mean())


def _distinct(sines: Sequence[tuple[float, float, float]]) -> int:
    kept: list[tuple[float, float, float]] = []
    for s in sines:
        if not any(np.allclose(s, other, rtol=_SAME, atol=1e-9) for other in kept):
            kept.append(s)
    return len(kept)
