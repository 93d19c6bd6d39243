"""What acts between the ends of a damper, beside what is in series with its core: a model in two parts.

A rod seal slides as the rig moves, and a buffer is met as it moves, also where the oil or the gas of the chambers gives
way. Without a mount there is one part: all moves as the rig does.
"""

from __future__ import annotations

from dataclasses import replace

from identification.physical.elements import ElementSpec
from identification.physical.model import Element, Model


def is_beside(e: Element) -> bool:
    """Whether an element acts beside the mount."""
    return any(p.value == 1.0 for p, spec in zip(e.parameters, e.spec.parameters, strict=True) if spec.beside)


def switches(spec: ElementSpec, *, beside: bool) -> list[int]:
    """Places of the parameters that are 0 or 1, of those that tell what is `beside` the mount or of the others."""
    return [k for k, p in enumerate(spec.parameters) if p.switch and p.beside == beside]


def switched(e: Element, place: int) -> Element:
    """The element with one of its switches the other way."""
    other = replace(e.parameters[place], value=1.0 - e.parameters[place].value)
    return replace(e, parameters=(*e.parameters[:place], other, *e.parameters[place + 1 :]))


def within(e: Element) -> Element:
    """The element where the others of the core are, and not beside the mount."""
    pairs = zip(e.parameters, e.spec.parameters, strict=True)
    return replace(e, parameters=tuple(replace(p, value=0.0) if spec.beside else p for p, spec in pairs))


def parts(model: Model) -> tuple[Model, ...]:
    """The model without what acts beside its mount, and that alone; the model itself where nothing does.

    A core of which nothing is left passes no force on: its mount carries none, and what acts beside it is all.
    """
    beside = tuple(e for e in model.on("core") if is_beside(e)) if model.on("mount") else ()
    if not beside:
        return (model,)
    alone = replace(model, elements=beside)
    rest = tuple(e for e in model.elements if e not in beside)
    return (replace(model, elements=rest), alone) if any(e.spec.path == "core" for e in rest) else (alone,)
