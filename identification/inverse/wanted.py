"""A wanted force along the motion of a run."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.models.inputs import motion_of, with_measured
from identification.models.motion import Motion
from identification.models.protocol import SimulationModel
from identification.models.simulation import check_inputs, name_of
from rigctl.runfile import Run

Floats = NDArray[np.float64]

WANTED = "force_wanted"
"""The channel of a wanted force; a run without it is asked for its measured force."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """A motion, whose current is of no account, and the force (N,), N, that is wanted along it."""

    name: str
    motion: Motion
    force: Floats

    def __post_init__(self) -> None:
        if self.force.shape != self.motion.x.shape:
            raise DataError(
                f"{self.name}: the wanted force has {self.force.size} samples and the motion {self.motion.x.size}: "
                "give as many"
            )
        bad = np.flatnonzero(~np.isfinite(self.force))
        if bad.size:
            raise DataError(
                f"{self.name}: the wanted force is {self.force[bad[0]]} at sample {bad[0]}: give finite numbers, N"
            )

    def driven(self, current: Floats | float) -> Motion:
        """The motion with a current, A, one for each sample or one for all."""
        return replace(self.motion, i=np.broadcast_to(np.asarray(current, dtype=np.float64), self.force.shape).copy())


def wanted_of(run: Run, forward: SimulationModel, channel: str = "") -> Wanted:
    """The wanted force of a run, along the motion that drives a forward model.

    `channel` holds it; where it is empty, `force_wanted`, or `force` in a run without that. A motion that repeats is
    taken as one that does not: the force that is wanted need not repeat.

    Raises
    ------
    DataError
        one line, where the run lacks that channel, or another than the current that the model needs.
    """
    chosen = channel or (WANTED if WANTED in run.channels else "force")
    if chosen not in run.channels:
        raise DataError(f"{name_of(run)}: no channel '{chosen}': the wanted force, N, stands in one")
    check_inputs(forward, run, but=("current",))
    motion = replace(with_measured(motion_of(run), run, forward.inputs), period=0, settle=0)
    return Wanted(name=name_of(run), motion=motion, force=run.channels[chosen][: motion.x.size].copy())
