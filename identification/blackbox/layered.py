"""A layered NARX network as a member of the family of models: one network of one to three hidden layers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.activations import ACTIVATIONS
from identification.blackbox.band import Band
from identification.blackbox.layers import Layers, span_of
from identification.blackbox.memory import remembered
from identification.blackbox.model import check_rate
from identification.blackbox.outside import half_width_along
from identification.blackbox.samples import Course, course_along, samples_of
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import FORCE, MODEL, Structure
from identification.errors import ModelError
from identification.models.inputs import MEASURED
from identification.models.motion import Motion
from identification.models.protocol import TrainingRange
from identification.models.visited import Visited

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class LayeredNarx:
    """F(t) of a feed-forward network of past forces and inputs, all scaled, fed back in free run, cut at its edges.

    `structure` holds the regressors only; without a past force the network is static. `measured` are those signals
    that were measured in its training.
    """

    name: str
    dt: float
    scales: Scales
    structure: Structure
    layers: Layers
    weights: Floats = field(compare=False)
    measured: tuple[str, ...] = ()
    facts: Mapping[str, float] = field(default_factory=dict)
    band: Band | None = None
    visited: Visited | None = None

    def __post_init__(self) -> None:
        size = self.layers.size(len(self.structure.regressors))
        if self.weights.shape != (size,):
            raise ModelError(f"weights are of the shape {self.weights.shape}: {self.layers} have {size}")
        if not np.all(np.isfinite(self.weights)):
            raise ModelError("weights must be finite numbers")
        foreign = set(self.measured) - set(MEASURED)
        if foreign:
            raise ModelError(
                f"measured names {min(foreign)!r}: only {' and '.join(MEASURED)} may be measured or derived"
            )
        missing = {FORCE, *self.structure.signals} - set(self.scales)
        if missing or MODEL in self.structure.signals:
            raise ModelError(f"signals.{min(missing, default=MODEL)} is missing, or not for a layered network")

    @property
    def kind(self) -> str:
        """The word in its file."""
        return "layered"

    @property
    def inputs(self) -> Mapping[str, str]:
        """Channels that a run must have to drive it, and what in the model needs each."""
        needed = [name for name in self.structure.signals if name in ("current", "temperature", *self.measured)]
        return {"displacement": "the model"} | dict.fromkeys(needed, f"the network '{self.name}'")

    @property
    def training_range(self) -> TrainingRange | None:
        """The range of each signal that it sees, and where they went together."""
        limits = {name: (self.scales[name].low, self.scales[name].high) for name in self.structure.signals}
        return TrainingRange(limits, self.visited)

    def names(self) -> Sequence[str]:
        """A name for each weight."""
        return [f"weight{k}" for k in range(self.weights.size)]

    def values(self) -> Floats:
        """All weights, scaled signals in and out."""
        return self.weights

    def free(self) -> NDArray[np.bool_]:
        """All are free."""
        return np.ones(self.weights.size, dtype=np.bool_)

    def bounds(self) -> tuple[Floats, Floats]:
        """None has a bound."""
        return np.full(self.weights.size, -np.inf), np.full(self.weights.size, np.inf)

    def force(self, motion: Motion) -> Floats:
        """Force along a motion from its inputs alone, (N,), N: finite and bounded; raises SimulationError."""
        return self.along(course_along(motion))

    def half_width(self, motion: Motion, level: float) -> Floats | None:
        """Half of the width of its band, (N,), N; None where it was not calibrated; raises SimulationError."""
        if self.band is None:
            return None
        return half_width_along(self, self.band, motion, level, self.force(motion))

    def memory(self, course: Course) -> float:
        """How long it remembers its start along a course, s, from the lowest to the highest force; may be infinite."""
        return remembered(lambda before: self._from_lead(course, before), self.scales[FORCE]) * self.dt

    def along(self, course: Course) -> Floats:
        """The same along a course, of which the force is not used."""
        return self._from_lead(course)[-course.motion.x.size :]

    def _from_lead(self, course: Course, before: float = 0.0) -> Floats:
        """Force of its lead and of the course, N, from a scaled force `before`."""
        from identification.blackbox.layered_loop import simulate  # compiled where it is used

        check_rate(self.name, self.dt, course.motion.dt)
        samples, scale = samples_of([course.whole()], self.structure, self.scales), self.scales[FORCE]
        samples.force[: self.structure.longest] = before
        widest = max(len(self.structure.regressors), *self.layers.nodes)
        scaled = np.empty(samples.force.size)
        simulate(
            self.weights, np.array(self.layers.nodes, dtype=np.int64),
            np.array([ACTIVATIONS[self.layers.hidden].code, ACTIVATIONS[self.layers.output].code], dtype=np.int64),
            np.array(span_of(scale)), np.array(self.structure.fed_back, dtype=np.int64), samples.inputs, samples.begin,
            samples.force, np.array(scale.edges), np.empty(widest), np.empty(widest), scaled,
        )  # fmt: skip
        return np.asarray(scaled[self.structure.longest :] * scale.size + scale.centre)
