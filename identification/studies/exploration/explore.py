"""The exploration itself: every sample over every test, in groups on the executor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identification.models.simulation import check_inputs
from identification.physical.model import Model
from identification.studies.exploration import lanes
from identification.studies.exploration.asked import Exploration, sampled, varied
from identification.studies.exploration.result import Explored
from identification.studies.exploration.simulating import figures_over
from identification.studies.exploration.sine_tests import SineTest, sine_tests
from identification.studies.journal import carry_on
from identification.studies.pace import Tell, silent
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_GROUP = lanes.LANES  # samples of a task: the answer of a lane depends on those beside it, so this never changes


@dataclass(frozen=True, slots=True)
class _OverTests:
    """A task: a group of parameter sets (L, P) over all tests."""

    model: Model
    tests: tuple[SineTest, ...]

    def identity(self) -> bytes:
        """The same for the same task."""
        texts = [*self.model.names(), *(test.name for test in self.tests)]
        arrays = [a for t in self.tests for a in (t.x, t.v, np.array([t.dt, t.current, t.order]))]
        return "\0".join(texts).encode() + b"".join(a.tobytes() for a in arrays)

    def __call__(self, values: Floats) -> Floats:
        return figures_over(self.model, values, self.tests)


def explore(
    model: Model,
    runs: Sequence[Run],
    asked: Exploration,
    *,
    tell: Tell = silent,
    journal: Path | None = None,
) -> Explored:
    """Which samples of the model's parameters behave like every measured sine test.

    Dynamic stiffness, loss angle and loop shape of each sample are compared with those measured; a sample is feasible
    when it stays within the limits on every test. A `journal` keeps what is done, see `carry_on`. Samples, groups and
    seeds are the same on every executor, so the answer is the same to the bit.

    Raises
    ------
    ModelError, DataError
        Before anything is simulated: a name that is not a parameter, a range out of bounds, a run that lacks an input,
        no steady sine.

    References
    ----------
    Complexity of a yaw damper's model in a bogie (ISMA 2024), section 3.1: the procedure; there the shape has no
    stated criterion, here it is `identification.steady.loop_shape`.
    """
    places, tests, others = check_explorable(model, runs, asked)
    values = sampled(model, asked)
    groups = [values[k : k + _GROUP] for k in range(0, len(values), _GROUP)]
    over = _OverTests(model, tuple(tests))
    figures = np.concatenate(
        carry_on(over, groups, identity=over.identity(), journal=journal, what="exploring", tell=tell)
    )
    return Explored(
        model=model.name, asked=asked, names=tuple(model.names()[k] for k in places), start=model.values()[places],
        samples=values[:, places], figures=figures, tests=tuple(tests), left_out=tuple(others),
    )  # fmt: skip


def check_explorable(
    model: Model, runs: Sequence[Run], asked: Exploration
) -> tuple[list[int], list[SineTest], list[str]]:
    """Places of what varies, the tests, and the names of runs that are none; raises as `explore` does."""
    places = list(varied(model, asked))
    for run in runs:
        check_inputs(model, run)
    return places, *sine_tests(runs, asked.points)
