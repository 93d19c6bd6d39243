"""The discrepancy workflow with a model of any kind, and what its result asks about the input."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from identification.discrepancy.explain import explain
from identification.discrepancy.explanation import Explanation
from identification.discrepancy.notes import far_as_given
from identification.fitting.questions import moved_far
from identification.models.protocol import SimulationModel
from identification.models.simulation import with_simulation
from identification.physical.model import Model
from rigctl.runfile import Run


def as_base(
    model: SimulationModel, runs: Sequence[Run], *, on_progress: Callable[[float, str], None] | None = None
) -> tuple[Model | None, list[Run]]:
    """What `explain` is given: a physical model and the runs, or None and the runs with what another kind simulates.

    Effects are then named on top of the simulation, as on that of any other program. Raises as `simulate_run` does.
    """
    if isinstance(model, Model):
        return model, list(runs)
    return None, with_simulation(model, runs, on_progress=on_progress)


def explain_any(
    model: SimulationModel | None,
    runs: Sequence[Run],
    held_out: Sequence[Run] | None = None,
    *,
    on_progress: Callable[[float, str], None] | None = None,
) -> Explanation:
    """As `explain`, with a model of any kind. `on_progress` is told the share that is done and at what the work is.

    Raises as `as_base` and `explain` do.
    """
    tell = on_progress or (lambda done, text: None)
    every = [*runs, *(held_out or ())]
    base, driven = (None, every) if model is None else as_base(model, every, on_progress=tell)
    measured, kept = driven[: len(runs)], driven[len(runs) :]
    return explain(base, measured, kept or None, on_progress=lambda text, done: tell(done, text))


def questions(found: Explanation) -> list[str]:
    """Questions about the input that the result raises."""
    return [*far_as_given(found.traces), *moved_far(found.given, found.base.model)]
