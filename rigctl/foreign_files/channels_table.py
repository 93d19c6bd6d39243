"""Tables of formats that hold arrays: channels with a name and a unit, in groups."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigctl.foreign_files.headings import Head, split_heading
from rigctl.foreign_files.table import Progress, Table, Values

__all__ = ["Array", "table_of"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Array:
    """One channel of a file, (N,) in its unit; ``unit`` "" where the file has none."""

    name: str
    unit: str
    values: NDArray[np.float64]


def table_of(
    arrays: Sequence[Array], *, part: str = "", sample_rate_hz: float | None = None, layout: str = ""
) -> Table | None:
    """A table of the arrays that have the most usual length of two or more; None where there are none."""
    lengths = Counter(one.values.size for one in arrays if one.values.size > 1)
    if not lengths:
        return None
    length = max(lengths, key=lambda size: (lengths[size], size))
    kept = [one for one in arrays if one.values.size == length]
    left = [one.name for one in arrays if one.values.size != length]
    told = (f"of another length and not taken: {', '.join(left[:5])}{' …' if len(left) > 5 else ''}",) if left else ()

    def take(indices: Sequence[int], tell: Progress) -> Values:
        tell(1.0)
        return Values(columns=tuple(kept[k].values for k in indices))

    return Table(
        heads=tuple(_head(one) for one in kept),
        take=take,
        part=part,
        sample_rate_hz=sample_rate_hz,
        layout=layout,
        told=told,
    )


def _head(one: Array) -> Head:
    return Head(" ".join(one.name.split()), one.unit.strip()) if one.unit.strip() else split_heading(one.name)
