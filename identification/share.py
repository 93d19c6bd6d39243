"""A fair share of long records: the piece of each in which a search for what a model lacks can learn most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.criteria import BUDGET
from identification.models.motion import Motion
from identification.record import Record

Floats = NDArray[np.float64]

_SERIES = ("x", "v", "a", "i", "temperature", "t")


def fair_shares(records: Sequence[Record], residuals: Sequence[Floats]) -> list[Record]:
    """The records, those without a period cut so that together they have few samples where they had many.

    Each keeps one piece: that with most energy in its residual (M,), N, of the model that is to be improved. A piece
    spans two cycles of the motion at least, and before it the simulation has gone through the whole travel.
    """
    most = BUDGET.samples / max(sum(r.measured.size for r in records), 1)
    if most >= 1.0:
        return list(records)
    return [r if r.period else _piece(r, e, most) for r, e in zip(records, residuals, strict=True)]


def _piece(record: Record, residual: Floats, share: float) -> Record:
    at = np.arange(record.force.size)[record.window]
    length = max(int(share * at.size), _two_cycles(record.motion.x[record.window]))
    if length >= at.size:
        return record
    energy = np.concatenate([[0.0], np.cumsum(residual**2)])
    start = int(np.argmax(energy[length:] - energy[:-length]))
    kept = at[start : start + length]
    begin = _ahead(record.motion.x, int(kept[0]))
    stop = int(kept[-1]) + 1
    simulated = None if record.simulated is None else record.simulated[begin:stop]
    return replace(
        record,
        motion=_between(record.motion, begin, stop),
        force=record.force[begin:stop],
        window=slice(int(kept[0]) - begin, stop - begin) if kept.size == stop - kept[0] else kept - begin,
        simulated=simulated,
        again=None,
    )


def _two_cycles(x: Floats) -> int:
    """Samples in which a motion crosses its middle four times at least, wherever they begin."""
    middle = 0.5 * (float(np.max(x)) + float(np.min(x)))
    crossings = np.flatnonzero(np.diff(np.signbit(x - middle)))
    return x.size if crossings.size < 5 else int(np.max(crossings[4:] - crossings[:-4]))


def _ahead(x: Floats, first: int) -> int:
    """Where a simulation must begin for what it does at sample `first` not to depend on where it began."""
    path = np.cumsum(np.abs(np.diff(x[: first + 1]))[::-1])
    return first - min(int(np.searchsorted(path, 2.0 * np.ptp(x))) + 1, first)


def _between(motion: Motion, begin: int, stop: int) -> Motion:
    return replace(motion, **{name: getattr(motion, name)[begin:stop] for name in _SERIES})
