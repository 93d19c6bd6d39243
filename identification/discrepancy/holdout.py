"""Choice of the held-out runs, where the user names none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.criteria import FORM, TEXT
from identification.record import Record, Window


def hold_out(records: Sequence[Record]) -> tuple[list[Record], list[Record]]:
    """Training and held-out records: about a quarter is kept back, spread over the list; of one run its last part.

    Runs whose kind stands alone (the only one with current steps, say) and runs that reach farthest (the only one as
    fast, say) stay in training, so that nothing that only they can show is lost.
    """
    if len(records) == 1:
        return _split(records[0])
    kinds, ends = [r.kind for r in records], _ends_reached(records)
    common = [k for k, kind in enumerate(kinds) if kinds.count(kind) > 1] or list(range(1, len(records)))
    fewest = min(ends[k] for k in common)
    common = [k for k in common if ends[k] == fewest]
    count = max(1, round(FORM.held_out * len(records)))
    count = min(count, len(common) - 1) if len(common) > 1 else 1
    step = len(common) / count
    chosen = {common[int((k + 0.5) * step)] for k in range(count)}
    train = [r for k, r in enumerate(records) if k not in chosen]
    return train, [r for k, r in enumerate(records) if k in chosen]


def _ends_reached(records: Sequence[Record]) -> list[int]:
    """Of how many ranges (displacement, velocity, current, temperature) each record alone reaches an end."""
    alone = [0] * len(records)
    for name in ("x", "v", "i", "temperature"):
        signals = [getattr(r.motion, name)[r.window] for r in records]
        for highest in (np.array([np.max(s) for s in signals]), -np.array([np.min(s) for s in signals])):
            first, second = np.argsort(-highest)[:2]
            span = max(float(np.ptp(np.concatenate(signals))), 1e-300)
            alone[first] += bool(highest[first] - highest[second] > TEXT.same_motion * span)
    return alone


def _split(record: Record) -> tuple[list[Record], list[Record]]:
    """The last quarter of the only run, in whole periods where it has some; with one period both see it."""
    if not isinstance(record.window, slice):
        cut = round(record.window.size * (1.0 - FORM.held_out))
        return _parts(record, record.window[:cut], record.window[cut:])
    start, stop = record.window.start, record.window.stop
    if record.period and (stop - start) // record.period < 2:
        return [record], [replace(record, name=f"{record.name} (seen)")]
    unit = record.period or 1
    cut = start + max(unit, round((stop - start) * (1.0 - FORM.held_out) / unit) * unit)
    cut = min(cut, stop - unit)
    return _parts(record, slice(start, cut), slice(cut, stop))


def _parts(record: Record, first: Window, last: Window) -> tuple[list[Record], list[Record]]:
    return (
        [replace(record, name=f"{record.name} (first part)", window=first)],
        [replace(record, name=f"{record.name} (last part)", window=last)],
    )
