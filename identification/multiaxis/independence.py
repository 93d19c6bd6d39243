"""Whether axes move independently: else nothing tells which of them makes a load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.multiaxis.axes import MOTIONS, ONE_COMMAND, channels_in, check_axes, largest_of, moved_axis
from identification.multiaxis.superposition import superposed
from rigctl.runfile import Run

Floats = NDArray[np.float64]


def following(runs: Sequence[Run]) -> tuple[str, tuple[str, ...]] | None:
    """An axis whose travel is a sum of those of other axes over all runs, and these axes; None where there is none.

    What least squares leave of its travel is then less than two actuators that play one command differ by.
    """
    motions, _ = check_axes(runs)
    travels = {axis: np.concatenate([one.channels[axis] for one in runs]) for axis in motions}
    units = {axis: (one - one.mean()) / max(float(np.std(one)), 1e-300) for axis, one in travels.items()}
    for axis, own in units.items():
        others = [name for name in motions if name != axis]
        terms = np.column_stack([units[name] for name in others])
        shares = np.linalg.lstsq(terms, own, rcond=None)[0]
        if float(np.std(own - terms @ shares)) < ONE_COMMAND:
            return axis, tuple(name for name, share in zip(others, shares, strict=True) if abs(share) > ONE_COMMAND)
    return None


def check_independent(runs: Sequence[Run]) -> None:
    """Raise DataError, one line, where an axis follows others in all runs."""
    found = following(runs)
    if found is not None:
        axis, others = found
        raise DataError(
            f"{axis} follows {' and '.join(others)} in all runs: nothing tells which of them makes a load; "
            "add a run that moves them independently, or give tests of single axes"
        )


def learned_from(singles: Sequence[Run]) -> list[Run]:
    """The sum of single tests; and each of them alone where they play motions of which one follows the others.

    In the sum of one sine on every axis no load has an axis of its own, in a single test it has.
    """
    summed = superposed(singles)
    if following([summed]) is None:
        return [summed]
    largest = largest_of(singles)
    return [summed, *(_alone(one, moved_axis(one, largest)) for one in singles)]


def _alone(single: Run, moved: str) -> Run:
    """A single test whose other axes are held without their noise, as in the sum."""
    still = {axis: np.zeros(single.samples) for axis in channels_in(single, MOTIONS) if axis != moved}
    return replace(single, channels={**single.channels, **still}, period_samples=0)
