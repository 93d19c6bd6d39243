"""A hybrid: a model whose parts have names, and a network for what that leaves, which ends where its training ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.model import BlackBox
from identification.blackbox.modelfile import blackbox_from_json, blackbox_to_json
from identification.blackbox.outside import half_width_along
from identification.blackbox.samples import course_along
from identification.blackbox.scaling import LARGEST, MARGIN
from identification.errors import ModelError, SimulationError
from identification.models.modelfile import FORMAT, FORMAT_VERSION, Json, model_from_json
from identification.models.motion import Motion
from identification.models.protocol import SimulationModel, TrainingRange
from identification.models.stepping import Moment, Steppable
from identification.signals import SIGNALS

if TYPE_CHECKING:
    from identification.blackbox.stepping import HybridStepper

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hybrid:
    """F = F_base + w·F_rest: w is 1 within the training range and falls to 0 at half of its span beyond.

    So far outside the training the base alone remains, cut at a force that no machine has, 10¹² N: a coefficient of its
    file may be of any size. `base_file` is the content of the model file of the base.
    """

    name: str
    base: SimulationModel
    base_file: Mapping[str, Json]
    rest: BlackBox

    @property
    def kind(self) -> str:
        """The word in its file."""
        return "hybrid"

    @property
    def facts(self) -> Mapping[str, float]:
        """Figures of its identification."""
        return self.rest.facts

    @property
    def inputs(self) -> Mapping[str, str]:
        """Channels that a run must have to drive it, and what in the model needs each."""
        return {**self.rest.inputs, **self.base.inputs}

    @property
    def training_range(self) -> TrainingRange | None:
        """Where the network holds; beyond, the base remains."""
        return self.rest.training_range

    def names(self) -> Sequence[str]:
        """The parameters of the base, then the weights."""
        return [*self.base.names(), *self.rest.names()]

    def values(self) -> Floats:
        """The parameters of the base, SI, then the weights."""
        return np.concatenate([self.base.values(), self.rest.values()])

    def free(self) -> NDArray[np.bool_]:
        """Which of them a fit may move."""
        return np.concatenate([self.base.free(), self.rest.free()])

    def bounds(self) -> tuple[Floats, Floats]:
        """Their bounds."""
        (low, high), (lowest, highest) = self.base.bounds(), self.rest.bounds()
        return np.concatenate([low, lowest]), np.concatenate([high, highest])

    def force(self, motion: Motion) -> Floats:
        """Force along a motion from its inputs alone, (N,), N; raises SimulationError as its base does."""
        base, rest = self.parts(motion)
        return base + rest

    def parts(self, motion: Motion) -> tuple[Floats, Floats]:
        """The force of the base and that of the network, each (N,), N; an input that is no number is held for both."""
        motion = motion.held()
        base = self._of_base(motion)
        return base, self.share(motion) * self.rest.along(course_along(motion, base))

    def _of_base(self, motion: Motion) -> Floats:
        return np.clip(self.base.force(motion), -LARGEST, LARGEST)

    def half_width(self, motion: Motion, level: float) -> Floats | None:
        """Half of the width of its band, (N,), N; None where its network was not calibrated; raises SimulationError."""
        if self.rest.band is None:
            return None
        motion = motion.held()
        base = self._of_base(motion)
        rest, spread = self.rest.with_spread(course_along(motion, base))
        return half_width_along(self, self.rest.band, motion, level, base + self.share(motion) * rest, spread)

    def share(self, motion: Motion) -> Floats:
        """The weight w of the network, (N,)."""
        weight = np.ones(motion.x.size)
        for low, high, series in self._limits(motion):
            beyond = np.maximum(np.maximum(low - series, series - high), 0.0)
            weight = np.minimum(weight, np.maximum(1.0 - beyond / (MARGIN * (high - low)), 0.0))
        return weight

    def weight(self, at: Moment) -> float:
        """The weight w of the network at one moment."""
        weight = 1.0
        for low, high, value in self._limits(at):
            beyond = max(low - value, value - high, 0.0)
            weight = min(weight, max(1.0 - beyond / (MARGIN * (high - low)), 0.0))
        return weight

    def _limits(self, given: Motion | Moment) -> list[tuple[float, float, Any]]:
        """Lowest and highest value of each signal in training, and the signal. Any: an array or a number."""
        known = self.training_range
        limits = known.limits.items() if known else ()
        return [(low, high, getattr(given, SIGNALS[signal])) for signal, (low, high) in limits]

    def stepper(self, dt: float) -> HybridStepper:
        """The damper from sample to sample; raises SimulationError where `dt` is not the interval of its training."""
        from identification.blackbox.stepping import HybridStepper, blackbox_stepper  # which is built on this module

        if not isinstance(self.base, Steppable):
            raise SimulationError(f"'{self.name}': its base, of the kind {self.base.kind}, cannot be stepped")
        return HybridStepper(self, self.base.stepper(dt), blackbox_stepper(self.rest, dt))


def hybrid_to_json(model: Hybrid) -> dict[str, Json]:
    """The model as JSON data."""
    head = {"format": FORMAT, "format_version": FORMAT_VERSION, "name": model.name, "kind": model.kind}
    return head | {"base": dict(model.base_file), "rest": blackbox_to_json(model.rest)}


def hybrid_from_json(data: Json) -> Hybrid:
    """A hybrid from parsed JSON; raises ModelError with the place and the cure."""
    parts: dict[str, SimulationModel] = {}
    readers = {"base": lambda part: model_from_json(part, only=("physical",)), "rest": blackbox_from_json}
    for name, reader in readers.items():
        try:
            parts[name] = reader(data.get(name))
        except ModelError as error:
            raise ModelError(f"{name}: {error}") from error
    rest = parts["rest"]
    assert isinstance(rest, BlackBox)  # by its reader
    return Hybrid(name=data.get("name", ""), base=parts["base"], base_file=data["base"], rest=rest)
