"""The damper models of the literature, as compositions of the catalogue's elements.

Each is a function from its own parameters, named as in its source, SI, to a `Model` that the solver, the fit and the
model file treat like any other. Signs: extension and tension positive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from identification.physical.elements import CATALOGUE
from identification.physical.elements.compositions import HELD, LITERATURE, NO_FORCE
from identification.physical.model import Element, Model, element

__all__ = ["LITERATURE", "literature", "no_force"]


def literature(name: str, values: Mapping[str, float] | None = None) -> Model:
    """A model of the literature with its start values, or with others, `element.parameter` to value.

    >>> [e.name for e in literature("Bingham", {"coulomb_friction.f_c": 80.0}).elements]
    ['viscous_damping', 'coulomb_friction', 'force_offset']
    """
    given = dict(values or {})
    elements = tuple(
        _element(row, {**start, **_own(given, row)}, HELD.get(name, ())) for row, start in LITERATURE[name]
    )
    if given:
        raise KeyError(f"'{name}' has no {min(given)}")
    return Model(name=name, elements=elements)


def _own(given: dict[str, float], row: str) -> dict[str, float]:
    names = [name for name in given if name.startswith(f"{row}.")]
    return {name.removeprefix(f"{row}."): given.pop(name) for name in names}


def _element(name: str, values: Mapping[str, float], held: Sequence[str]) -> Element:
    own = [h.removeprefix(f"{name}.") for h in held if h.startswith(f"{name}.")]
    return element(name, values, [*CATALOGUE[name].held, *own])


def no_force(name: str) -> Model:
    """A model without a force and without a free parameter, to stand on another program's simulation."""
    return Model(name=name, elements=tuple(element(row, values, tuple(values)) for row, values in NO_FORCE))
