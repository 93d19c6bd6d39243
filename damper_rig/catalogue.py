"""What a physical model can be made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from damper_rig.html import table
from identification.errors import ModelError
from identification.physical.elements import CATALOGUE, ElementSpec, ParameterSpec
from identification.physical.elements.described import catalogue_text, element_data, element_text

__all__ = ["Elements", "elements"]


@dataclass(frozen=True, slots=True)
class Elements(Mapping[str, ElementSpec]):
    """Elements by name; one alone is shown in full."""

    specs: Mapping[str, ElementSpec]

    def __getitem__(self, name: str) -> ElementSpec:
        return self.specs[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.specs)

    def __len__(self) -> int:
        return len(self.specs)

    def rows(self) -> list[dict[str, Any]]:
        """What `damper-rig elements --json` prints."""
        return [element_data(spec) for spec in self.specs.values()]

    def __repr__(self) -> str:
        specs = list(self.specs.values())
        return element_text(specs[0]) if len(specs) == 1 else catalogue_text(specs)

    def _repr_html_(self) -> str:
        rows = [
            (
                one.name,
                one.path,
                one.title,
                one.equation,
                ", ".join(map(_parameter, one.parameters)),
            )
            for one in self.specs.values()
        ]
        return table(("element", "path", "what it is", "equation", "parameters"), rows)


def _parameter(spec: ParameterSpec) -> str:
    return f"{spec.name} [{spec.unit or '1'}]"


def elements(name: str = "") -> Elements:
    """All elements of the catalogue, or the one of this name; raises ModelError where there is none."""
    if not name:
        return Elements(CATALOGUE)
    if name not in CATALOGUE:
        near = get_close_matches(name, CATALOGUE, n=3)
        raise ModelError(f"element {name!r:.60} does not exist: {' or '.join(near) or 'dr.elements() lists all'}")
    return Elements({name: CATALOGUE[name]})
