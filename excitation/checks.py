"""Range checks whose message names the key, the value and what would be right."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from excitation.errors import DesignError

__all__ = ["check_above", "check_at_least", "check_one_of", "check_within"]


def check_above(name: str, value: float, low: float, unit: str = "") -> None:
    _check_number(name, value)
    if not value > low:
        raise DesignError(f"{name} is {value:g}{_unit(unit)}: it must be above {low:g}{_unit(unit)}")


def check_at_least(name: str, value: float, low: float, unit: str = "") -> None:
    _check_number(name, value)
    if not value >= low:
        raise DesignError(f"{name} is {value:g}{_unit(unit)}: it must be at least {low:g}{_unit(unit)}")


def check_within(name: str, value: float, low: float, high: float, unit: str = "") -> None:
    _check_number(name, value)
    if not low <= value <= high:
        raise DesignError(f"{name} is {value:g}{_unit(unit)}: it must lie in {low:g} … {high:g}{_unit(unit)}")


def check_one_of(name: str, value: object, known: Sequence[str]) -> None:
    if value not in known:
        raise DesignError(f"{name} is {value!r:.60}: it must be one of {', '.join(known)}")


def _check_number(name: str, value: object) -> None:
    """Specifications that are made in Python have whatever stands in their fields."""
    if not isinstance(value, int | float | np.integer | np.floating):
        raise DesignError(f"{name} is {value!r:.60}: it must be a number")


def _unit(unit: str) -> str:
    return f" {unit}" if unit else ""
