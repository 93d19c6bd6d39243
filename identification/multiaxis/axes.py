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

# An axis that is held has noise, and steps of its recorder. Third differences of a motion below a tenth of the sample
# rate are 0.05 of it, those of white noise √20 of it. Half: a motion at a fifth of the sample rate is called noise;
# double: noise is called motion. Some steps: a held axis that lies between two values of its recorder.
_ORDER, _OF_NOISE, _NOISY = 3, 20.0, 0.5
_STEPS = 3  # values
_LEAST_AXES = 2
ONE_COMMAND = 0.05
"""Of the rms of a motion: two actuators that play one command differ by less."""
_ROUNDING = 1e-12  # of the place: no motion


def unit_of(axis: str) -> str:
    """The unit of the travel of an axis."""
    return "rad" if axis.startswith("displacement_r") else "m"


def channels_in(run: Run, names: Sequence[str]) -> list[str]:
    """Those of some channels that a run holds, in their order."""
    return [name for name in names if name in run.channels]


def noise_of(travel: Floats) -> float:
    """The noise of a travel (N,), in its unit: the rms of its third differences, √20 times that of white noise."""
    if travel.size <= _ORDER:
        return 0.0
    return float(np.sqrt(np.mean(np.diff(travel, _ORDER) ** 2) / _OF_NOISE))


def moves(travel: Floats) -> bool:
    """Whether a travel (N,) is more than noise about one place, and more than a few steps of its recorder."""
    size = float(np.std(travel))
    if not size > _ROUNDING * float(np.max(np.abs(travel))) or noise_of(travel) > _NOISY * size:
        return False
    values = np.unique(travel)
    return bool(values.size > _STEPS)


def held_in(runs: Sequence[Run]) -> dict[str, float]:
    """The axes that none of some runs moves, and the noise of each, m or rad: the largest of its runs."""
    names = dict.fromkeys(name for one in runs for name in channels_in(one, MOTIONS))
    travels = {name: [one.channels[name] for one in runs if name in one.channels] for name in names}
    return {name: max(map(noise_of, every)) for name, every in travels.items() if not any(map(moves, every))}


def largest_of(runs: Sequence[Run]) -> dict[str, float]:
    """The greatest span of each axis over all runs that move it, m or rad; 0 where none does."""
    names = dict.fromkeys(name for one in runs for name in channels_in(one, MOTIONS))
    travels = {name: [one.channels[name] for one in runs if name in one.channels] for name in names}
    return {
        name: max((float(np.ptp(one)) for one in every if moves(one)), default=0.0) for name, every in travels.items()
    }


def axes_moved(run: Run, largest: Mapping[str, float]) -> list[str]:
    """The axes that a run moves; `largest` is the greatest span of each axis over all runs."""
    return [
        name
        for name in channels_in(run, MOTIONS)
        if np.ptp(run.channels[name]) > _STILL * largest[name] > 0.0 and moves(run.channels[name])
    ]


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
    """Motions that a run moves, and loads; raises DataError where rates differ or a run lacks a channel of another.

    An axis that all runs hold still, but for its noise, is no motion.
    """
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
    if len(motions) < _LEAST_AXES or not loads:
        raise DataError(
            f"{name_of(first)} holds {len(motions)} axis and {len(loads)} load: a model of several axes needs two "
            "axes or more, such as displacement and displacement_y"
        )
    still = held_in(runs)
    return [name for name in motions if name not in still], loads


def check_moved(runs: Sequence[Run]) -> None:
    """Raise DataError where some runs together move fewer than two axes."""
    moving, _ = check_axes(runs)
    if len(moving) < _LEAST_AXES:
        found = " and ".join(moving) or "no axis"
        raise DataError(
            f"the runs move {found}; {', '.join(held_in(runs))} are held, but for noise: a model of several axes needs "
            "runs that move two axes or more"
        )
