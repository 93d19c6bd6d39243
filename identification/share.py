"""A fair share of long records: as many samples as their motion needs, and the piece in which a search learns most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.criteria import BUDGET
from identification.models.motion import Motion
from identification.record import Record, Window, is_steady

Floats = NDArray[np.float64]

# Samples that a thinned motion keeps in a cycle as quick as its fastest turn: a sine then moves by 0.05 % of its stroke
# in the sample at its turn, below the travel in which a friction builds up. Every further one costs time alone.
_A_CYCLE = 100.0
_SERIES = ("x", "v", "a", "i", "temperature", "t")


def fair_shares(records: Sequence[Record], residuals: Sequence[Floats]) -> list[Record]:
    """The records, those without a period cut so that together they have few samples where they had many.

    A motion that is sampled far more finely than it turns is thinned, by no more than it takes. Of what is then too
    long each keeps one piece: that with most energy in its residual (M,), N, of the model that is to be improved. A
    piece spans two cycles of the motion at least, and before it the simulation has gone through the whole travel.
    """
    if (share := _share(records)) >= 1.0:
        return list(records)
    thin = [_thinned(r, e, int(1.0 / share)) for r, e in zip(records, residuals, strict=True)]
    most = _share([r for r, _ in thin])
    return [r if r.period or most >= 1.0 else _piece(r, e, most) for r, e in thin]


def _share(records: Sequence[Record]) -> float:
    """The share of the samples of all records that a search uses; 1 and more: all."""
    return BUDGET.samples / max(sum(r.measured.size for r in records), 1)


def _thinned(record: Record, residual: Floats, most: int) -> tuple[Record, Floats]:
    """Every k-th sample of a record and of its residual, k ≤ `most`, with 100 in a cycle of the motion still.

    A current that varies needs every sample: a step between two of them would be a lag.
    """
    k = 1 if record.period or not is_steady(record.motion.i) else min(_stride(record), most)
    if k == 1:
        return record, residual
    at = np.arange(record.force.size)[record.window]
    kept = at % k == 0
    motion = replace(record.motion, dt=k * record.dt, **{n: getattr(record.motion, n)[::k] for n in _SERIES})
    simulated = None if record.simulated is None else record.simulated[::k]
    thin = replace(
        record, motion=motion, force=record.force[::k], window=_as_slice(at[kept] // k), simulated=simulated, again=None
    )
    return thin, residual[kept]


def _stride(record: Record) -> int:
    """Samples of a motion for one that it needs: a cycle as quick as its fastest turn is 2π·max abs(v)/max abs(a)."""
    v, a = (float(np.max(np.abs(s[record.window]))) for s in (record.motion.v, record.motion.a))
    return max(1, int(2.0 * np.pi * v / max(a, 1e-300) / record.dt / _A_CYCLE))


def _as_slice(at: NDArray[np.int64]) -> Window:
    return slice(int(at[0]), int(at[-1]) + 1) if at.size == at[-1] - at[0] + 1 else at


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
        window=_as_slice(kept - begin),
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
