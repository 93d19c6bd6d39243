"""A learned inverse: a network whose output is the current, and the forward model that checks it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.model import BlackBox
from identification.blackbox.samples import Course, course_along
from identification.errors import ModelError
from identification.inverse.reach import Limits
from identification.inverse.wanted import Wanted
from identification.models.modelfile import Json
from identification.models.motion import Motion
from identification.models.protocol import SimulationModel

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Inverse:
    """A current from a motion and a wanted force, at one sample rate and within limits.

    The network is a black box in which current and force have changed places: what it gives is the current, and what
    it sees as the current is the wanted force. `forward_file` is the content of the model file of the forward model.
    """

    name: str
    network: BlackBox
    limits: Limits
    forward: SimulationModel
    forward_file: Mapping[str, Json]
    facts: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if "current" not in self.network.signals:
            raise ModelError("network: no regressor of the wanted force F: an inverse needs one")
        if "current" not in self.forward.inputs:
            raise ModelError("forward: it has no current among its inputs, so that no current can be checked with it")

    def current(self, wanted: Wanted) -> Floats:
        """The current (N,), A, from motion and wanted force up to each sample; raises SimulationError for a rate."""
        found = self.network.along(course_along(changed(wanted.driven(0.0), wanted.force)))
        return np.clip(found, self.limits.low, self.limits.high)


def changed(motion: Motion, force: Floats) -> Motion:
    """The motion with a force in the place of its current."""
    return replace(motion, i=force)


def changed_course(course: Course) -> Course:
    """The course with force and current in each other's place."""
    return replace(course, motion=changed(course.motion, course.force), force=course.motion.i)


def forward_of(inverse: Inverse | SimulationModel) -> SimulationModel:
    """The forward model in an inverse; a forward model as it is."""
    return inverse.forward if isinstance(inverse, Inverse) else inverse
