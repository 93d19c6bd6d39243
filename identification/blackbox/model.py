"""A black box as a member of the family of models: a committee of recurrent networks, or a linear model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.band import Band
from identification.blackbox.memory import remembered
from identification.blackbox.network import network
from identification.blackbox.outside import half_width_along
from identification.blackbox.samples import Course, course_along, samples_of
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import FORCE, MODEL, Structure
from identification.errors import ModelError, SimulationError
from identification.models.inputs import MEASURED
from identification.models.motion import Motion
from identification.models.protocol import TrainingRange
from identification.models.visited import Visited

if TYPE_CHECKING:
    from identification.blackbox.stepping import BlackBoxStepper

Floats = NDArray[np.float64]

_SAME_RATE = 1e-6  # of the sample interval: rounding of a rate in a file


@dataclass(frozen=True, slots=True)
class Member:
    """One network: its structure, and its weights as the loops take them, (structure.size,)."""

    structure: Structure
    weights: Floats = field(compare=False)

    def __post_init__(self) -> None:
        if self.weights.shape != (self.structure.size,):
            raise ModelError(
                f"weights are of the shape {self.weights.shape}: {self.structure} has {self.structure.size}"
            )
        if not np.all(np.isfinite(self.weights)):
            raise ModelError("weights must be finite numbers")

    def used(self) -> NDArray[np.bool_]:
        """Which entries are weights of nodes that there are, (structure.size,)."""
        nodes = np.arange(self.structure.lanes) < self.structure.nodes
        width = len(self.structure.regressors) + 1
        return np.concatenate([np.tile(nodes, width + 1), np.ones(width, dtype=np.bool_)])


@dataclass(frozen=True, slots=True, kw_only=True)
class BlackBox:
    """A force from a motion at one sample interval: the median of what its members simulate, each on its own.

    `scales` holds a scale for the force and for every signal that a member sees. `measured` are those signals that were
    measured in its training, although they could be derived from the displacement. `facts` are figures of its
    identification, for the reader of its file. `band` is None where it was not calibrated, `visited` where nothing
    states which combinations of signals the training had.
    """

    name: str
    kind: str
    dt: float
    scales: Scales
    members: tuple[Member, ...]
    measured: tuple[str, ...] = ()
    facts: Mapping[str, float] = field(default_factory=dict)
    band: Band | None = None
    visited: Visited | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.dt) and self.dt > 0.0):
            raise ModelError(f"sample interval is {self.dt:g} s: it must be above 0")
        if not self.members:
            raise ModelError("members is empty: a model has at least one")
        foreign = set(self.measured) - set(MEASURED)
        if foreign:
            raise ModelError(
                f"measured names {min(foreign)!r}: only {' and '.join(MEASURED)} may be measured or derived"
            )
        missing = {FORCE, *self.signals} - set(self.scales)
        if missing:
            raise ModelError(f"signals.{min(missing)} is missing: a member sees it")

    @property
    def signals(self) -> tuple[str, ...]:
        """The signals that drive it."""
        return tuple(dict.fromkeys(name for member in self.members for name in member.structure.signals))

    @property
    def inputs(self) -> Mapping[str, str]:
        """Channels that a run must have to drive it, and what in the model needs each."""
        needed = [name for name in self.signals if name in ("current", "temperature", *self.measured)]
        return {"displacement": "the model"} | dict.fromkeys(needed, f"the black box '{self.name}'")

    @property
    def training_range(self) -> TrainingRange | None:
        """The range of each signal that it sees, and where they went together."""
        known = [name for name in self.signals if name != MODEL]
        limits = {name: (self.scales[name].low, self.scales[name].high) for name in known}
        return TrainingRange(limits, self.visited)

    def names(self) -> Sequence[str]:
        """A name for each weight."""
        return [f"member{m}.weight{k}" for m, one in enumerate(self.members) for k in range(one.structure.weights)]

    def values(self) -> Floats:
        """All weights, scaled signals in and out."""
        return np.concatenate([one.weights[one.used()] for one in self.members])

    def free(self) -> NDArray[np.bool_]:
        """All are free."""
        return np.ones(self.values().size, dtype=np.bool_)

    def bounds(self) -> tuple[Floats, Floats]:
        """None has a bound."""
        count = self.values().size
        return np.full(count, -np.inf), np.full(count, np.inf)

    def force(self, motion: Motion) -> Floats:
        """Force along a motion from its inputs alone, (N,), N.

        It is always finite, and within half of the trained span beyond the trained forces: inputs that are not finite
        are held, and those far outside their range are cut.

        Raises
        ------
        SimulationError
            when the sample rate is not that of the training.
        """
        return self.along(course_along(motion))

    def stepper(self, dt: float) -> BlackBoxStepper:
        """The damper from sample to sample; raises SimulationError where `dt` is not the interval of its training."""
        from identification.blackbox.stepping import blackbox_stepper  # which is built on this module

        return blackbox_stepper(self, dt)

    def along(self, course: Course) -> Floats:
        """The same along a course, of which the force is not used."""
        check_rate(self.name, self.dt, course.motion.dt)
        return np.asarray(np.median(self.each(course), axis=0))

    def each(self, course: Course) -> Floats:
        """The force of every member, (M, N), N."""
        size = course.motion.x.size
        return np.array([self._from_lead(member, course)[-size:] for member in self.members])

    def with_spread(self, course: Course) -> tuple[Floats, Floats]:
        """Force and spread of the members along a course, each (N,), N."""
        each = self.each(course)
        return np.asarray(np.median(each, axis=0)), np.asarray(np.std(each, axis=0))

    def half_width(self, motion: Motion, level: float) -> Floats | None:
        """Half of the width of its band, (N,), N; None where it was not calibrated; raises SimulationError."""
        if self.band is None:
            return None
        check_rate(self.name, self.dt, motion.dt)
        return half_width_along(self, self.band, motion, level, *self.with_spread(course_along(motion)))

    def _from_lead(self, member: Member, course: Course, before: float = 0.0) -> Floats:
        """Force of one member over the lead and the course, N, from a scaled force `before`."""
        structure = member.structure
        samples = samples_of([course.whole()], structure, self.scales)
        samples.force[: structure.longest] = before
        with np.errstate(all="raise"):
            scaled = network(structure, self.scales).simulate(member.weights, samples)
        force = self.scales[FORCE]
        return np.asarray(scaled[structure.longest :] * force.size + force.centre)

    def memory(self, course: Course) -> float:
        """How long it remembers its start along a course, s: infinite where its starts never come together.

        Each member is started from the lowest, the mean and the highest force that it can give, before the lead.
        """
        each = (partial(self._from_lead, member, course) for member in self.members)
        return max(remembered(run, self.scales[FORCE]) for run in each) * self.dt

    def renamed(self, name: str) -> BlackBox:
        """The model under another name."""
        return replace(self, name=name)


def check_rate(name: str, trained: float, given: float) -> None:
    """Raise SimulationError where the sample interval of a run, s, is not that of the training."""
    if abs(given / trained - 1.0) > _SAME_RATE:
        raise SimulationError(
            f"'{name}' was identified at {1.0 / trained:.6g} Hz and the run has {1.0 / given:.6g} Hz: "
            f"identify the model again with --rate {1.0 / given:.6g}, "
            f"or resample the run with --rate {1.0 / trained:.6g}"
        )
