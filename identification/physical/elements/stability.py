"""What would grow without end: parameters that a simulation refuses for the stroke of its motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from identification.physical.elements.spec import Values

_EXPONENTIAL = 1.2  # a Bouc–Wen exponent below it grows e⁵-fold at most where this one would be infinite


def may_grow(name: str) -> bool:
    """Whether an element has values with which it grows without end."""
    return name in _CHECKS


def unbounded(name: str, values: Values, stroke: float) -> str | None:
    """Why an element has no bound within a stroke, m; None where it has one."""
    check = _CHECKS.get(name)
    return None if check is None else check(values, stroke)


def _bouc_wen(values: Values, stroke: float) -> str | None:
    """With c = −(beta + gamma) > 0 it grows as it is loaded, dh/dx = A + c·hⁿ, and is infinite after a travel of
    (π/n)/sin(π/n)·A^(1/n − 1)·c^(−1/n); what a reversal unloads is no less, so no travel is longer than the stroke.
    """
    growth = -values["beta"] - values["gamma"]
    n, a = values["n"], values["A"]
    least = max(n, _EXPONENTIAL)
    if growth <= 0.0 or growth * float(a * stroke / (np.pi / least / np.sin(np.pi / least))) ** n < a:
        return None
    return (
        f"bouc_wen.beta + bouc_wen.gamma is {-growth:.4g}: below zero the hysteresis grows, here without end within "
        f"the stroke of {stroke:.3g} m"
    )


_CHECKS: Final[Mapping[str, Callable[[Values, float], str | None]]] = {"bouc_wen": _bouc_wen}
