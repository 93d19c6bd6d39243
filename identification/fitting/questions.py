"""Questions that a result raises about its input: parameters that moved far, and a simulation worse than none."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from identification.physical.model import Model
from rigctl.runfile import Run

__all__ = ["far_from_force", "moved_far"]

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


def far_from_force(gap_n: float, runs: Sequence[Run]) -> list[str]:
    """A question where a simulation differs from the measured force by more than no simulation at all would."""
    force = np.concatenate([run.channels["force"] for run in runs if "force" in run.channels] or [np.zeros(1)])
    size = float(np.std(force))
    if size == 0.0 or gap_n <= size:
        return []
    return [
        f"as given, the simulation is {gap_n:.4g} N rms from the measured force, which itself varies by only "
        f"{size:.4g} N rms: are the units and signs of both the same?"
    ]
