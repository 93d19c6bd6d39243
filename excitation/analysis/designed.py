"""The lines that a stored design states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import to_spec
from excitation.errors import DesignError
from excitation.kinds import HOMOGENISED, Kind
from excitation.multisine import current_tones, displacement_tones
from excitation.multisine_spec import MultisineSpec

__all__ = ["designed_lines"]


def designed_lines(design: Mapping[str, Any] | None, period_s: float) -> dict[str, NDArray[np.int64]]:
    """The excited lines of each channel of a multisine's configuration, if its period lasts ``period_s``.

    Empty where it is no multisine, another period, or a configuration that this version cannot read: the lines are then
    those that are seen. Any: the JSON of a file.
    """
    if design is None or design.get("kind") not in (str(Kind.MULTISINE), HOMOGENISED):
        return {}
    try:
        spec = to_spec(MultisineSpec, {key: value for key, value in design.items() if key != "kind"})
        if abs(spec.period_samples / spec.sample_rate_hz - period_s) > _SAME * period_s:
            return {}
        current = current_tones(spec)
        found = {"displacement": displacement_tones(spec).lines}
        return found if current is None else {**found, "current": current.lines}
    except DesignError:
        return {}


_SAME = 1e-9  # of the period: rounding of a rate
