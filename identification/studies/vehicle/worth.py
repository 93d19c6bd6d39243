"""What a named effect is worth: the vehicle's answer with it and without it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from identification.errors import ModelError
from identification.models.protocol import SimulationModel
from identification.physical.elements.equations.sensor import ACTS
from identification.physical.model import Model
from identification.studies.vehicle.answer import Study

# Change of a figure, %, from which an effect matters to the vehicle. Of comfort people begin to feel about 10 %
# (difference thresholds of 5 … 15 % of vertical seat vibration: Mansfield & Griffin 2000; Morioka & Griffin 2000). At
# 5 % nearly every friction of the examples matters, at 20 % nearly none.
MATTERS_PERCENT = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Worth:
    """A study whose first damper has the effect, and whose second has not."""

    study: Study
    effect: str

    @property
    def changes(self) -> dict[str, float]:
        """By how many percent each figure differs without the effect; only figures that both have."""
        first, other = self.study.answers
        names = [f.name for f in first.figures if any(f.name == g.name for g in other.figures)]
        changes = {name: self.study.change(other.label, name) for name in names}
        return {name: change for name, change in changes.items() if math.isfinite(change)}

    @property
    def matters(self) -> bool:
        """Whether any figure changes by `MATTERS_PERCENT` or more."""
        return any(abs(change) >= MATTERS_PERCENT for change in self.changes.values())

    @property
    def sentence(self) -> str:
        """What a user learns."""
        if not self.changes:
            return f"Without {self.effect} no figure of the vehicle can be compared."
        name, change = max(self.changes.items(), key=lambda item: abs(item[1]))
        verdict = "matters" if self.matters else "does not matter"
        return (
            f"{self.effect} {verdict} in this vehicle: without it, {name} changes by {change:+.1f} %, the most of all "
            f"figures (a change of {MATTERS_PERCENT:g} % counts)."
        )


def without(model: SimulationModel, effects: Sequence[str]) -> Model:
    """The model less some of its elements, by their ids.

    Raises ModelError, one line, where it is not physical, has no such element, or where an element belongs to the rig:
    that is worth nothing in a vehicle.
    """
    if not isinstance(model, Model):
        raise ModelError(f"'{model.name}' is of the kind {model.kind}: only a physical model has elements to leave out")
    left = model
    for effect in effects:
        element = model.element(effect)
        if element.spec.path == "sensor" and element.name not in ACTS:
            raise ModelError(f"'{effect}' belongs to the rig and its load cell: it is worth nothing in a vehicle")
        left = left.without(effect)
    return replace(left, name=f"{model.name}, without {', '.join(effects)}")


def worth(
    found: SimulationModel,
    base: SimulationModel,
    study_of: Callable[[Sequence[SimulationModel]], Study],
    effect: str = "what the base lacks",
) -> Worth:
    """The study of a model with an effect and of a base without it; raises what the study raises.

    Of a study that puts a reference before its models, the last two answers are taken.
    """
    study = study_of([found, base])
    return Worth(study=replace(study, title=f"What it is worth: {effect}", answers=study.answers[-2:]), effect=effect)
