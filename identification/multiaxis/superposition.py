"""Superposition of tests of one axis each: training data of all axes together, and the check of where it fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.models.simulation import name_of
from identification.multiaxis.axes import MOTIONS, ONE_COMMAND, channels_in, check_axes, largest_of, moved_axis, moves
from rigctl.runfile import Run

Floats = NDArray[np.float64]

# Share of the rms of a load that the sum of the single tests may miss. Half: the noise of two load cells counts;
# double: a coupling of a tenth of the force is learned as if it were not there.
TOLERANCE = 0.05


@dataclass(frozen=True, slots=True)
class Superposed:
    """What the sum of single tests misses of a test of all axes, by load: share of its rms, and where it is worst."""

    missed: Mapping[str, float]
    worst_s: Mapping[str, float]

    @property
    def failing(self) -> tuple[str, ...]:
        """Loads of which too much is missed: learn them from tests that move the axes together."""
        return tuple(name for name, share in self.missed.items() if share > TOLERANCE)

    def described(self) -> list[str]:
        """A sentence for each load of which too much is missed."""
        return [
            f"{name}: the sum of the single tests misses {100.0 * self.missed[name]:.3g} % of its rms, most at "
            f"{self.worst_s[name]:.4g} s: superposition fails, record tests that move the axes together"
            for name in self.failing
        ]


def superposed(singles: Sequence[Run]) -> Run:
    """One run of all axes: the motion of each single test on its axis, and the sum of all loads.

    The loads are those beside rest: tare the rig before each test. Longer tests are cut to the shortest.

    Raises DataError, one line, where a run moves several axes, two move the same, or their channels or rates differ.
    """
    _, loads = check_axes(singles)
    largest = largest_of(singles)
    axes = [moved_axis(one, largest) for one in singles]
    for k, axis in enumerate(axes):
        if axis in axes[:k]:
            raise DataError(
                f"{name_of(singles[k])} moves {axis} as {name_of(singles[axes.index(axis)])} does: one an axis"
            )
    samples = min(one.samples for one in singles)
    channels = {name: np.zeros(samples) for name in (*channels_in(singles[0], MOTIONS), *loads)}
    for one, axis in zip(singles, axes, strict=True):
        channels[axis] = one.channels[axis][:samples].copy()
        for name in loads:
            channels[name] += one.channels[name][:samples]
    first = singles[0]
    units = {name: first.units[name] for name in channels}
    return replace(
        first,
        run_id="superposed",
        channels=channels,
        units=units,
        period_samples=0,
        excitation_kind="custom",
        path=None,
    )


def same_motions(together: Run, found: Run) -> str | None:
    """The first axis that a run moves otherwise than another; None where both play the same motions."""
    size = min(together.samples, found.samples)
    for name in channels_in(found, MOTIONS):
        one, other = together.channels[name][:size], found.channels[name][:size]
        if not moves(one) and not moves(other):
            continue  # held in both: their noise differs
        if np.sqrt(np.mean((one - other) ** 2)) > ONE_COMMAND * max(float(np.std(one)), 1e-12):
            return name
    return None


def check_superposition(together: Run, singles: Sequence[Run]) -> Superposed:
    """What the sum of single tests misses of a test that plays the same motions together, sample by sample.

    Raises DataError as `superposed` does, and where the motions differ.
    """
    found = superposed(singles)
    _, loads = check_axes([together, found])
    size = min(together.samples, found.samples)
    other = same_motions(together, found)
    if other is not None:
        raise DataError(f"{name_of(together)}: {other} is not that of the single test: play the same motions together")
    missed, worst = {}, {}
    for name in loads:
        load = together.channels[name][:size]
        left = load - found.channels[name][:size]
        missed[name] = float(np.sqrt(np.mean(left**2)) / max(float(np.std(load)), 1e-12))
        worst[name] = float(np.argmax(np.abs(left)) / together.sample_rate_hz)
    return Superposed(missed, worst)
