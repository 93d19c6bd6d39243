"""What a complexity study found: the indicator of every element at every step, the ladder, the simplified model."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from identification.physical.model import Model
from identification.studies.complexity.designed import Designed


class Verdict(Enum):
    """What a step of the plan says about a characteristic."""

    MEASURE = "measure more"
    KEEP = "keep"
    SIMPLIFY = "simplify"


@dataclass(frozen=True, slots=True, kw_only=True)
class Indicator:
    """One element of the model at one step; shares of the step's output.

    `uncertain`: change of the output by one standard deviation of the parameter that changes it most. `without`: change
    when the element is left out and the others are fitted again; None where nothing would be left.
    """

    step: str
    element: str
    uncertain: float
    parameter: str  # that one; empty where the tests leave none uncertain
    without: float | None
    verdict: Verdict
    test: str  # that would tell more, for a verdict of MEASURE


@dataclass(frozen=True, slots=True, kw_only=True)
class Rung:
    """One model on the ladder, simulated along the tests and in the vehicle."""

    label: str
    kind: str
    free: int | None
    rrmsse: float | None  # %, over all tests; None where it fails on one
    cost: float | None  # s for a simulated second
    outputs: tuple[float | None, ...]  # of each step; None where the model cannot take it
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Complexity:
    """The whole study. `model` is the full model as fitted, `simplified` what is left of it."""

    model: Model
    simplified: Model
    dropped: tuple[str, ...]
    steps: tuple[str, ...]
    matters: float
    spread: str  # what stated the uncertainty
    indicators: tuple[Indicator, ...]
    ladder: tuple[Rung, ...]  # from the simplest to the full model
    beside: tuple[Rung, ...]
    designed: tuple[Designed, ...] = ()  # tests for what is to be measured more

    @property
    def knee(self) -> Rung | None:
        """The rung beyond which more parameters bring little: farthest below the chord of log error over parameters.

        None with fewer than three rungs that ran, or where none lies below the chord.
        """
        rungs = [r for r in self.ladder if r.rrmsse and r.free is not None]
        if len(rungs) < 3:
            return None
        x = np.array([float(r.free or 0) for r in rungs])
        y = np.log10([r.rrmsse or np.nan for r in rungs])
        if x[-1] <= x[0] or y[-1] >= y[0]:
            return None
        below = y[0] + (y[-1] - y[0]) * (x - x[0]) / (x[-1] - x[0]) - y
        best = int(np.argmax(below))
        return rungs[best] if below[best] > 0.0 else None
