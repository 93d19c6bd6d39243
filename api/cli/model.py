"""``damper-rig model``: a first model file, of a family of dampers or of a characteristic sheet."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.places import to_file

__all__ = ["model"]

model = typer.Typer(name="model", help="Make a model file to start from.", no_args_is_help=True)


@model.command()
def new(
    family: Annotated[
        str, typer.Argument(metavar="[FAMILY]", help="A family of dampers; `damper-rig model families` lists them.")
    ] = "",
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_file, metavar="MODEL.json", help="The model file.")
    ] = Path("model.json"),
    force: Annotated[float | None, typer.Option(metavar="N", help="Peak force, N.")] = None,
    velocity: Annotated[float | None, typer.Option(metavar="M/S", help="Velocity of that force, m/s.")] = None,
    current: Annotated[
        tuple[float, float] | None, typer.Option(metavar="LOW HIGH", help="Softest and firmest current, A.")
    ] = None,
    sheet: Annotated[
        Path | None,
        typer.Option(metavar="SHEET.json", help="In place of a family: what characterise --json printed."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the file and its model as JSON.")] = False,
) -> None:
    """A model with start values, for `damper-rig fit`.

    Example: damper-rig model new monotube --force 2500 --velocity 0.5 -o front.json
    """
    from api.cli.terminal import answer
    from api.errors import InputError
    from identification.physical.modelfile import model_to_json, write_model
    from identification.physical.new_model import model_of_family, model_of_sheet

    if (sheet is None) == (not family):
        raise InputError("model new: give a FAMILY or --sheet SHEET.json (`damper-rig model families` lists families)")
    if sheet is not None:
        made = model_of_sheet(_read(sheet))
    elif force is None or velocity is None:
        raise InputError(f"model new {family}: give its peak force and velocity, --force N --velocity M/S")
    else:
        made = model_of_family(family, force, velocity, current)
    write_model(output, made)
    answer(f"{output}: {made.name}", {"file": str(output), "model": model_to_json(made)}, as_json=as_json)


@model.command()
def families(as_json: Annotated[bool, typer.Option("--json", help="Print the list as JSON.")] = False) -> None:
    """The families of dampers that `damper-rig model new` knows.

    Example: damper-rig model families
    """
    from api.cli.terminal import answer
    from identification.physical.elements.families import FAMILIES

    values = [
        {"family": name, "text": one.text, "controlled_by_current": one.controlled} for name, one in FAMILIES.items()
    ]
    width = max(map(len, FAMILIES))
    answer("\n".join(f"{name:<{width}}  {one.text}" for name, one in FAMILIES.items()), values, as_json=as_json)


def _read(path: Path) -> dict[str, object]:
    import json

    from api.cli.terminal import existing
    from api.errors import InputError

    try:
        found = json.loads(existing(path, "what characterise --json printed").read_text(encoding="utf-8"))
    except (ValueError, OSError, RecursionError) as error:
        raise InputError(f"{path}: no JSON ({' '.join(str(error).split()):.120})") from error
    if not isinstance(found, dict):
        raise InputError(f"{path}: no sheet: give what `damper-rig characterise --json` prints")
    return found
