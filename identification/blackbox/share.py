"""A fair share of long courses: the stretches that together visit most of what the whole visits."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.folds import stretch_after
from identification.blackbox.samples import Course

Floats = NDArray[np.float64]

# Samples of a stretch. Half: the start of its free run, which is not learned, takes a larger part; double: few
# stretches to choose from.
STRETCH = 500
_CELLS = 5  # of each signal, between its lowest and highest value
_SIGNALS = ("x", "v", "i")


def fair_share(courses: Sequence[Course], most: int) -> list[Course]:
    """Courses of about `most` counted samples in all; the given ones where they have no more.

    Stretches are taken one by one, each the one that adds most to Σ log(1 + n) over the cells of displacement, velocity
    and current, n the samples in a cell: a cell that is rarely visited weighs more than one more visit to a common one.
    Their order is that of the courses.
    """
    if sum(int(one.counted.sum()) for one in courses) <= most:
        return list(courses)
    parts = [part for course in courses for part in _stretches(course) if part.counted.any()]
    counts = _visits(parts)
    kept: list[int] = []
    seen, samples = np.zeros(counts.shape[1]), 0
    while samples < most and len(kept) < len(parts):
        gains = np.log1p(seen + counts).sum(axis=1)
        gains[kept] = -np.inf
        kept.append(int(np.argmax(gains)))
        seen += counts[kept[-1]]
        samples += int(parts[kept[-1]].counted.sum())
    return [parts[k] for k in sorted(kept)]


def _stretches(course: Course) -> list[Course]:
    """The course in stretches of `STRETCH` samples or a little more; what comes before each does not count."""
    size = course.force.size
    count = max(1, size // STRETCH)
    if count == 1:
        return [course]
    ends = np.linspace(0, size, count + 1).astype(np.int64)
    return [stretch_after(course, int(first), int(last)) for first, last in pairwise(ends)]


def _visits(parts: Sequence[Course]) -> Floats:
    """How many counted samples of each part lie in each cell, (parts, cells)."""
    cell = [np.zeros(part.force.size, dtype=np.int64) for part in parts]
    for name in _SIGNALS:
        series = [getattr(part.motion, name) for part in parts]
        low, high = min(map(np.min, series)), max(map(np.max, series))
        width = (high - low) / _CELLS or 1.0
        cell = [
            _CELLS * index + np.minimum((values - low) / width, _CELLS - 1).astype(np.int64)
            for index, values in zip(cell, series, strict=True)
        ]
    every = _CELLS ** len(_SIGNALS)
    counts = [np.bincount(index[part.counted], minlength=every) for index, part in zip(cell, parts, strict=True)]
    return np.array(counts, dtype=np.float64)
