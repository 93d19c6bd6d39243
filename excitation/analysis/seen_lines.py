"""Which lines the inputs excite, seen in their spectra, and which are left to detect distortion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.criteria import LOCAL, REACH, SEEN, SMALL, TOGETHER
from excitation.sliding import running_maximum

__all__ = ["SeenLines", "excited_in", "seen_lines"]

Floats = NDArray[np.float64]
Lines = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenLines:
    """The lines of a measurement, sorted by what they can tell. All are numbers of DFT lines, from 1."""

    excited: tuple[Lines, ...]  # of each input
    driven: Lines  # excited by any input
    even: Lines  # not driven: even distortion alone; empty where an even line is driven
    odd: Lines  # not driven: odd distortion alone; empty where an even line is driven
    mixed: Lines  # not driven, where even lines are driven: distortion of any order

    @property
    def band(self) -> tuple[int, int]:
        """The lowest and the highest driven line."""
        return int(self.driven[0]), int(self.driven[-1])

    @property
    def splits(self) -> bool:
        """Whether odd and even distortion are told apart: only odd lines are driven."""
        return bool(np.all(self.driven % 2 == 1))

    def inside(self, lines: Lines) -> Lines:
        """Those of some lines that lie between driven ones."""
        low, high = self.band
        return lines[(lines >= low) & (lines <= high)]


def excited_in(power: Floats, noise: Floats) -> Lines:
    """The lines that a spectrum of mean squares (L,) excites, without DC and the Nyquist line.

    A line counts where it stands ``SEEN`` standard deviations above its ``noise`` (L,), the variance of its mean, and
    has a share of ``LOCAL`` of the amplitude of the highest line near it. A group of lines with nothing near it counts
    where it has that share of the nearest group on the side of the highest line of all: harmonics of a rig have not.
    """
    inner = power[1:-1].copy()
    if inner.size == 0 or not np.any(inner > 0.0):
        return np.zeros(0, dtype=np.int64)
    highest = _highest_near(inner)
    found = (inner > LOCAL**2 * highest) & (inner > SEEN**2 * noise[1:-1]) & (inner > SMALL * np.sum(inner))
    return _without_harmonics(np.flatnonzero(found).astype(np.int64) + 1, power)


def _without_harmonics(lines: Lines, power: Floats) -> Lines:
    """The lines without groups that are far below the nearest group towards the highest line."""
    if not lines.size:
        return lines
    apart = np.diff(lines) > np.maximum(_NEAR, TOGETHER * lines[:-1])
    groups = np.split(lines, np.flatnonzero(apart) + 1)
    main = int(np.argmax([power[group].max() for group in groups]))
    kept = [groups[main]]
    for side in (groups[main + 1 :], groups[:main][::-1]):
        last = groups[main]
        for group in side:
            if power[group].max() > LOCAL**2 * _at_the_edge(last, group, power):
                kept.append(group)
                last = group
    return np.sort(np.concatenate(kept))


def _at_the_edge(group: Lines, towards: Lines, power: Floats) -> float:
    """The highest power of a group near its end towards another group."""
    end = int(group[-1] if towards[0] > group[-1] else group[0])
    return float(power[group[np.abs(group - end) <= max(_NEAR, TOGETHER * end)]].max())


_NEAR = 8  # lines that are near one another, however low


def _highest_near(power: Floats) -> Floats:
    """The highest power within ``TOGETHER`` of a line's number, on both sides, (L,)."""
    out = running_maximum(power, _NEAR)
    low = _NEAR / TOGETHER
    number = np.arange(1, power.size + 1)
    while low < power.size:  # octave by octave, with the width of its end
        reach = int(2.0 * low * TOGETHER)
        octave = (number > low) & (number <= 2.0 * low)
        out[octave] = running_maximum(power, reach)[octave]
        low *= 2.0
    return out


def seen_lines(excited: Sequence[Lines], samples: int) -> SeenLines:
    """All lines up to ``REACH`` times the highest driven one, by what they tell. One input or more must excite a line.

    Odd distortion of an excitation on odd lines alone falls on odd lines, even distortion on even ones; with an even
    line driven, by whichever input, both fall on all lines (Pintelon & Schoukens, 2012).
    """
    driven = np.unique(np.concatenate(list(excited)))
    last = min(int(REACH * driven[-1]), (samples - 1) // 2)
    rest = np.setdiff1d(np.arange(1, last + 1, dtype=np.int64), driven)
    nothing = np.zeros(0, dtype=np.int64)
    splits = bool(np.all(driven % 2 == 1))
    return SeenLines(
        excited=tuple(excited),
        driven=driven,
        even=rest[rest % 2 == 0] if splits else nothing,
        odd=rest[rest % 2 == 1] if splits else nothing,
        mixed=nothing if splits else rest,
    )
