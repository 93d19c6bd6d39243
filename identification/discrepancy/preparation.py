"""What the workflow works on: the model, the training and the held-out records, or the refusal of what it was given."""

from __future__ import annotations

from collections.abc import Sequence

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
    check_runs([*runs, *(held_out or ())])
    records = same_load_cell([record_from_run(r) for r in (*runs, *(held_out or ()))])
    if model is None:
        records = [on_top_of_simulation(r, q) for r, q in zip(records, (*runs, *(held_out or ())), strict=True)]
        model = no_force("the given simulation")
    train, held = (records[: len(runs)], records[len(runs) :]) if held_out else hold_out(records)
    check_model(model, [*train, *held])
    return model, train, held
