"""The channels of a rig of several axes: displacements and angles in, forces and torques out, as in run files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.models.simulation import name_of
from rigctl.runfile import Run

Floats = NDArray[np.float64]

MOTIONS = ("displacement", "displacement_y", "displacement_z", "displacement_rx", "displacement_ry", "displacement_rz")
LOADS = ("force", "force_y", "force_z", "torque_x", "torque_y", "torque_z")
UNITS = {name: "N·m" if name.startswith("torque") else "N" for name in LOADS}
_STILL = 1e-3  # of the largest travel of an axis over all runs: a run that moves it by less leaves it still


def channels_in(run: Run, names: Sequence[str]) -> list[str]:
    """Those of some channels that a run holds, in their order."""
    return [name for name in names if name in run.channels]


def largest_of(runs: Sequence[Run]) -> dict[str, float]:
    """The greatest span of each axis over all runs, m or rad."""
    names = dict.fromkeys(name for one in runs for name in channels_in(one, MOTIONS))
    return {name: max(float(np.ptp(one.channels[name])) for one in runs if name in one.channels) for name in names}


def axes_moved(run: Run, largest: Mapping[str, float]) -> list[str]:
    """The axes that a run moves; `largest` is the greatest span of each axis over all runs."""
    return [name for name in channels_in(run, MOTIONS) if np.ptp(run.channels[name]) > _STILL * largest[name] > 0.0]


def moved_axis(run: Run, largest: Mapping[str, float]) -> str:
    """The one axis that a run moves; `largest` is the greatest span of each axis over all runs.

    Raises DataError, one line, where it moves none or several.
    """
    moving = axes_moved(run, largest)
    if len(moving) != 1:
        found = "none" if not moving else " and ".join(moving)
        raise DataError(f"{name_of(run)} moves {found}: a test of a single axis moves one")
    return moving[0]


def check_axes(runs: Sequence[Run]) -> tuple[list[str], list[str]]:
    """Motions and loads that all runs hold; raises DataError where rates differ or one lacks a channel of another."""
    if not runs:
        raise DataError("no run was given: at least one measured run is needed")
    first = runs[0]
    motions, loads = channels_in(first, MOTIONS), channels_in(first, LOADS)
    for one in runs:
        lacking = [name for name in (*motions, *loads) if name not in one.channels]
        if lacking:
            raise DataError(f"{name_of(one)} has no {lacking[0]}, {name_of(first)} has: give runs that all have it")
        if abs(one.sample_rate_hz / first.sample_rate_hz - 1.0) > 1e-6:
            raise DataError(
                f"{name_of(one)} has {one.sample_rate_hz:.6g} Hz, {name_of(first)} {first.sample_rate_hz:.6g} Hz: "
                "give runs of one rate"
            )
    if len(motions) < 2 or not loads:
        raise DataError(
            f"{name_of(first)} holds {len(motions)} axis and {len(loads)} load: a model of several axes needs two "
            "axes or more, such as displacement and displacement_y"
        )
    return motions, loads
