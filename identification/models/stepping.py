"""A model from sample to sample, where the motion ahead is not known: in a vehicle, in a loop with hardware."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

from identification.errors import DataError
from identification.models.inputs import ROOM_TEMPERATURE_DEGC
from identification.models.motion import LARGEST_INPUT
from identification.models.protocol import SimulationModel


class Moment(NamedTuple):
    """Inputs of a damper at one sample, SI: extension, its derivatives, current and temperature (°C)."""

    x: float = 0.0
    v: float = 0.0
    a: float = 0.0
    i: float = 0.0
    temperature: float = ROOM_TEMPERATURE_DEGC

    def held(self, before: Moment) -> Moment:
        """The moment with the value `before` wherever an input is no number, infinite or beyond any machine."""
        return Moment(*(now if abs(now) <= LARGEST_INPUT else last for now, last in zip(self, before, strict=True)))


class Stepper(Protocol):
    """One damper at a fixed step. Forces in N, extension and tension positive."""

    @property
    def dt(self) -> float:
        """The step, s."""
        ...

    def start(self, at: Moment) -> float:
        """Begin at a moment that has lasted; the force there."""
        ...

    def force(self, at: Moment) -> float:
        """The force if `at` were the next sample: nothing is kept of the question."""
        ...

    def advance(self, at: Moment) -> float:
        """Go on to the next sample `at`; the force there."""
        ...


@runtime_checkable
class Steppable(Protocol):
    """A model that can be taken from sample to sample."""

    def stepper(self, dt: float) -> Stepper:
        """A damper of its own at the step `dt`, s; raises SimulationError where the model has no such step."""
        ...


def steppable(model: SimulationModel) -> Steppable:
    """The model, which can be taken from sample to sample; raises DataError, one line, where it can't."""
    if not isinstance(model, Steppable):
        raise DataError(f"'{model.name}', of the kind {model.kind}, can't be taken from sample to sample")
    return model


def foresees(one: object) -> bool:
    """Whether `force` of a stepper, or of a model's steppers, is its answer; where it is a guess, `advance` is."""
    return bool(getattr(one, "foresees", True))
