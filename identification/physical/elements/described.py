"""The catalogue in words and as JSON: what a person or another program reads of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite
from typing import Any

from identification.physical.elements.catalogue import CATALOGUE
from identification.physical.elements.spec import ElementSpec, ParameterSpec

__all__ = ["catalogue_text", "element_data", "element_text"]


def catalogue_text(specs: Iterable[ElementSpec] = CATALOGUE.values()) -> str:
    """A line for each element: name, path and title."""
    return _table([(spec.name, spec.path, spec.title) for spec in specs])


def _range(parameter: ParameterSpec) -> str:
    low = f"{parameter.low:g}" if isfinite(parameter.low) else "−∞"
    high = f"{parameter.high:g}" if isfinite(parameter.high) else "∞"
    return f"{low} … {high}"


def _said(parameter: ParameterSpec) -> str:
    """What shows a parameter, or what it means."""
    if parameter.switch:
        return f"1: {parameter.switch}"
    return "of each run" if parameter.of_run else f"shown by {parameter.remedy.value}"


def element_text(spec: ElementSpec) -> str:
    """Equation, parameters with unit, range and the test that shows each, what it needs, and how it is written."""
    rows = [(f"  {p.name}", p.unit or "1", "0 or 1" if p.switch else _range(p), _said(p)) for p in spec.parameters]
    needs = [
        *(["a control current"] if spec.needs_current else []),
        *(["a temperature that varies"] if spec.needs_temperature else []),
    ]
    return "\n".join(
        [
            f"{spec.name}: {spec.title}, on the {spec.path} path",
            f"  {spec.equation}",
            *_table(rows).splitlines(),
            *([f"  needs {' and '.join(needs)}"] if needs else []),
            *([] if spec.nameable else ["  is not named by explain: for a base, fit and simulate, by choice"]),
            *([] if spec.alias is None else [f"  looks like {spec.alias.cause}: {spec.alias.test}"]),
            f'  in a model file: {{"element": "{spec.name}", "parameters": {{'
            + ", ".join(f'"{p.name}": …' for p in spec.parameters if p.default is None and p.constant is None)
            + "}}",
        ]
    )


def element_data(spec: ElementSpec) -> dict[str, Any]:
    """JSON of an element, any values; a bound that is not finite is null."""
    return {
        "element": spec.name,
        "path": spec.path,
        "title": spec.title,
        "equation": spec.equation,
        "needs_current": spec.needs_current,
        "needs_temperature": spec.needs_temperature,
        "named_by_explain": spec.nameable,
        "parameters": [
            {
                "name": p.name,
                "unit": p.unit,
                "low": p.low if isfinite(p.low) else None,
                "high": p.high if isfinite(p.high) else None,
                "default": p.constant if p.constant is not None else p.default,
                "shown_by": p.remedy.value,
            }
            for p in spec.parameters
        ],
    }


def _table(rows: Sequence[tuple[str, ...]]) -> str:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in rows)
