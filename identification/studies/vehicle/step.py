"""The step of a vehicle study: that of the black boxes in it, which know no other."""

from __future__ import annotations

from collections.abc import Sequence

from identification.errors import DataError
from identification.models.protocol import SimulationModel

STEP_S = 1e-3
"""Where no model has a step of its own. Half: the figures of the example models move by less than 0.5 %."""

_SAME = 1e-6  # of a step: rounding of a rate in a file


def step_for(models: Sequence[SimulationModel], asked: float | None = None) -> float:
    """The step, s, that all models can take; raises DataError, one line, where there is none."""
    own = {model.name: step for model in models if (step := trained_step(model)) is not None}
    steps = [asked, *own.values()] if asked is not None else list(own.values())
    if not steps:
        return STEP_S
    for name, step in own.items():
        if abs(step / steps[0] - 1.0) > _SAME:
            raise DataError(
                f"'{name}' was identified at {1.0 / step:.6g} Hz; the study runs at {1.0 / steps[0]:.6g} Hz"
            )
    if not 0.0 < steps[0] <= 0.01:
        raise DataError(f"step is {steps[0]:g} s: it must lie within (0, 0.01]")
    return steps[0]


def trained_step(model: SimulationModel) -> float | None:
    """The sample interval, s, of a black box or of the network of a hybrid."""
    step = getattr(getattr(model, "rest", model), "dt", None)
    return float(step) if isinstance(step, float) else None
