"""A table of named columns, whatever file it is in: the headings first, values of chosen columns when wanted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rigctl.foreign_files.headings import Head

__all__ = ["Progress", "Table", "Values"]

Progress = Callable[[float], None]  # told the share that is done


@dataclass(frozen=True, slots=True, kw_only=True)
class Values:
    """Chosen columns, (N,) float64 each in the unit of the file; times of day are seconds since the first.

    ``told``: what reading them showed, a line each. ``cut``: the last row was not whole and is left out.
    """

    columns: tuple[NDArray[np.float64], ...]
    told: tuple[str, ...] = ()
    cut: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """One part of a file: a sheet, a group, a structure, or the whole of it (``part`` is "" then).

    ``take`` reads the columns with these indices; it raises ForeignFileError. ``row`` says where sample n stands.
    """

    heads: tuple[Head, ...]
    take: Callable[[Sequence[int], Progress], Values]
    part: str = ""
    sample_rate_hz: float | None = None  # that the file states
    layout: str = ""  # how the file was read, in words
    told: tuple[str, ...] = ()
    row: Callable[[int], str] = field(default=lambda n: f"sample {n}")
