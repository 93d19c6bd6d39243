"""Questions that a fit raises about its input: parameters that moved far."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from identification.physical.model import Model

__all__ = ["moved_far"]

# Times: values are known better than that. Half: fits from guessed starts are asked about; double: 25.4 is still seen.
FAR: Final = 10.0
_UNIT: Final = ((900.0, 1100.0), (23.0, 28.0))  # millimetres or kilonewtons, and inches, taken for SI units


def moved_far(start: Model, found: Model) -> list[str]:
    """A question for each free parameter that a fit has moved tenfold or more, or one for all of them together."""
    before = {f"{e.id}.{e.spec.parameters[k].name}": e.parameters[k].value for e, k in start.slots()}
    said, ratios = [], []
    for element, k in found.slots():
        name, value = f"{element.id}.{element.spec.parameters[k].name}", element.parameters[k].value
        old = before.get(name, 0.0)
        if element.parameters[k].fixed or old == 0.0 or value == 0.0:
            continue
        ratio = abs(value / old)
        if not 1.0 / FAR < ratio < FAR:
            ratios.append(ratio)
            said.append(f"{name} moved from {old:.4g} to {value:.4g}")
    if not said:
        return []
    more = f" and {len(said) - 1} more as far" if len(said) > 1 else ""
    return [f"{said[0]}{more}: is the start value right, and the units of the runs?{_unit_words(ratios)}"]


def _unit_words(ratios: Sequence[float]) -> str:
    folds = [max(ratio, 1.0 / ratio) for ratio in ratios]
    if any(low < fold < high for fold in folds for low, high in _UNIT[:1]):
        return " A factor of 1000 is millimetres stored as metres, or newtons as kilonewtons"
    return " A factor of 25.4 is inches" if any(low < fold < high for fold in folds for low, high in _UNIT[1:]) else ""
