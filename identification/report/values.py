"""The fitted values of an effect in words, for every page that tells them."""

from __future__ import annotations

from collections.abc import Mapping

from identification.criteria import TEXT
from identification.report.report_file import Value


def values_in_words(parameters: Mapping[str, Value]) -> str:
    """The parameters that say something, each with its standard deviation: all but those that are held at nothing."""
    told = {name: v for name, v in parameters.items() if v.value != 0.0 or v.std is not None}
    return ", ".join(_value(name, value) for name, value in told.items())


def _value(name: str, p: Value) -> str:
    if p.std is not None and p.std > TEXT.unknown * abs(p.value):
        return f"{name}: these runs do not determine it"
    spread = f" ± {p.std:.2g}" if p.std is not None else ""
    return f"{name} = {p.value:.4g}{spread} {p.unit}".rstrip("– ")
