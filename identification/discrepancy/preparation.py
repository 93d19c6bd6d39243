"""What the workflow works on: the model, the training and the held-out records, or the refusal of what it was given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.discrepancy.checks import check_model, check_runs
from identification.discrepancy.holdout import hold_out
from identification.physical.literature import no_force
from identification.physical.model import Model
from identification.record import Record, on_top_of_simulation, record_from_run, same_load_cell
from rigctl.runfile import Run


def prepared(
    model: Model | None, runs: Sequence[Run], held_out: Sequence[Run] | None = None
) -> tuple[Model, list[Record], list[Record]]:
    """The model, the training and the held-out records of what `explain` is given; raises what it refuses."""
    every = [*runs, *(held_out or ())]
    check_runs(every)
    records = _with_zero_current(same_load_cell([record_from_run(r) for r in every]), every)
    if model is None:
        records = [on_top_of_simulation(r, q) for r, q in zip(records, every, strict=True)]
        model = no_force("the given simulation")
    train, held = (records[: len(runs)], records[len(runs) :]) if held_out else hold_out(records)
    check_model(model, [*train, *held])
    return model, train, held


def _with_zero_current(records: Sequence[Record], runs: Sequence[Run]) -> list[Record]:
    """The records, those with a recorded current of zero taken as controlled where others have one that is not."""
    controlled = any(r.has_current for r in records)
    return [replace(r, has_current=controlled and "current" in q.channels) for r, q in zip(records, runs, strict=True)]
