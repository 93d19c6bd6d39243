"""The force of the main axis from a model of several axes, beside models of one axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError, SimulationError
from identification.models.modelfile import Json, Kind
from identification.models.motion import Motion
from identification.models.protocol import TrainingRange
from identification.multiaxis.axes import LOADS
from identification.multiaxis.model import MultiAxis
from identification.multiaxis.modelfile import MULTIAXIS, multiaxis_from_json
from rigctl.runfile import Run

Floats = NDArray[np.float64]

MAIN = LOADS[0]
MAIN_FORCE: Final = Kind(name=MULTIAXIS.name, reader="identification.multiaxis.compared:main_force_from_json")


@dataclass(frozen=True, slots=True)
class MainForce:
    """The force of the main axis, driven by the axes of a run: a motion of one axis does not hold them."""

    model: MultiAxis  # of this load alone

    @property
    def name(self) -> str:
        """The name of the model."""
        return self.model.name

    @property
    def kind(self) -> str:
        """The word in its file."""
        return self.model.kind

    @property
    def inputs(self) -> Mapping[str, str]:
        """Channels that a run must have to drive it, and what in the model needs each."""
        return dict.fromkeys(self.model.axes, f"'{self.name}'")

    @property
    def training_range(self) -> TrainingRange | None:
        """Stated for every axis, and known along a run."""
        return TrainingRange({})

    def names(self) -> Sequence[str]:
        """A name for each weight of the network of this load."""
        return [f"{MAIN}.weight{k}" for k in range(self.values().size)]

    def values(self) -> Floats:
        """All weights, (P,), scaled signals in and out."""
        return self.model.loads[MAIN].weights

    def free(self) -> NDArray[np.bool_]:
        """All are free."""
        return np.ones(self.values().size, dtype=np.bool_)

    def bounds(self) -> tuple[Floats, Floats]:
        """None has a bound."""
        return np.full(self.values().size, -np.inf), np.full(self.values().size, np.inf)

    def force(self, motion: Motion) -> Floats:
        """Raises SimulationError: a motion of one axis is not enough."""
        raise SimulationError(f"'{self.name}' is driven by {', '.join(self.model.axes)} of a run: see `bound_to`")

    def bound_to(self, run: Run) -> MainForceOnRun:
        """The same along one run."""
        return MainForceOnRun(self.model, run)


@dataclass(frozen=True, slots=True)
class MainForceOnRun(MainForce):
    """The force of the main axis along one run, of which every axis drives it."""

    run: Run

    @property
    def training_range(self) -> TrainingRange | None:
        """What of the run lies outside, by axis."""
        return _Outside({}, None, self.model.outside(self.run))

    def force(self, motion: Motion) -> Floats:
        """Force along the run, (N,), N; raises SimulationError where its rate is not that of the training."""
        return self.model.simulate(self.run)[MAIN]


@dataclass(frozen=True, slots=True)
class _Outside(TrainingRange):
    """The share of the samples of a run outside of the training, by axis, whatever the motion of its main axis."""

    shares: Mapping[str, float] = field(default_factory=dict)

    def left(self, motion: Motion) -> Mapping[str, float]:
        return self.shares


def main_force_from_json(data: Json) -> MainForce:
    """The force of the main axis of a parsed file; raises ModelError, also where the model gives none."""
    model = multiaxis_from_json(data)
    if MAIN not in model.loads:
        raise ModelError(f"loads has no {MAIN}: models are compared by the force of the main axis")
    return MainForce(replace(model, loads={MAIN: model.loads[MAIN]}))
