"""``damper-rig study worth``: what a named effect is worth in a vehicle."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice
from api.cli.options import AsJson
from api.cli.places import part_of
from api.cli.study_vehicle import Config, Current, Page, Step, check_page, models_of, settings

if TYPE_CHECKING:
    from identification.models import SimulationModel

__all__ = ["worth"]


def worth(
    model: Annotated[
        Path,
        typer.Argument(metavar="MODEL.json", help="With the effect: the model.json of an explanation, or another."),
    ],
    *,
    output: Page,
    base: Annotated[Path | None, typer.Option(metavar="BASE.json", help="The model without the effect.")] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(metavar="ELEMENT", help="In place of --base: an element to leave out; can be repeated."),
    ] = None,
    vehicle: Annotated[str, typer.Option("--in", metavar="car|seat|bogie", help="The vehicle.")] = "car",
    config: Config = None,
    current: Current = None,
    step: Step = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    as_json: AsJson = False,
) -> None:
    """The vehicle's answer with an effect and without it: comfort, transmissibility, or the critical speed.

    Example: damper-rig study worth explanation/model.json --base base.json --in bogie -o worth.html
    """
    from api.cli.terminal import answer, progress_bar
    from api.errors import InputError
    from identification.compute import chosen
    from identification.studies.journal import kept
    from identification.studies.vehicle import study_data, study_text, vehicle_study, write_study
    from identification.studies.vehicle import without as left
    from identification.studies.vehicle import worth as worth_of

    if (base is None) == (not without):
        raise InputError("study worth: give --base BASE.json, or --without ELEMENT")
    check_page(output)
    setting = settings(vehicle, config, {"step_s": step} | ({} if vehicle == "seat" else {"current": current}))
    paths = [model, *([base] if base else [])]
    found, *others = models_of(paths, fmu_choice(paths, fmu_input, fmu_output, fmu_set))
    bare = others[0] if others else left(found, without or [])
    effect = " and ".join(without) if without else _named(found, bare)
    with chosen(os.environ), kept(part_of(output)), progress_bar("study") as tell:
        # Of a controlled seat the damper has the effect; what differs is the model in which its current is looked up.
        answered = worth_of(
            found, bare, lambda both: vehicle_study(both, setting, specimen=found, on_progress=tell), effect
        )
    write_study(output, answered.study, answered.sentence)
    data = study_data(answered.study) | {
        "effect": effect,
        "changes": answered.changes,
        "matters": answered.matters,
        "file": str(output),
    }
    answer(f"{study_text(answered.study)}\n{answered.sentence}\n{output}", data, as_json=as_json)


def _named(found: SimulationModel, bare: SimulationModel) -> str:
    """Ids of the elements that only the first model has, else what the user gave."""
    ids = [set(getattr(model, "ids", ())) for model in (found, bare)]
    only = sorted(ids[0] - ids[1])
    return " and ".join(only) if only else "what the base lacks"
