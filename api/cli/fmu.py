"""The options of a command that connect an FMU."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from identification.models import Choice

__all__ = ["FmuInput", "FmuOutput", "FmuSet", "fmu_choice"]

FmuInput = Annotated[
    list[str] | None,
    typer.Option(
        "--fmu-input",
        metavar="CHANNEL=VARIABLE",
        help="Input of the FMU that a channel drives; can be repeated.",
    ),
]
FmuOutput = Annotated[
    str,
    typer.Option(
        "--fmu-output",
        metavar="VARIABLE",
        help="Output of the FMU that is the damper's force; -VARIABLE reverses its sign.",
    ),
]
FmuSet = Annotated[
    list[str] | None,
    typer.Option("--fmu-set", metavar="VARIABLE=VALUE", help="Parameter of the FMU; can be repeated."),
]


def fmu_choice(
    models: Sequence[Path], inputs: Sequence[str] | None, output: str, parameters: Sequence[str] | None
) -> Choice | None:
    """The user's choice, None without any of the options; raises InputError or ModelError."""
    from api.errors import InputError
    from identification.models import Choice

    if not (inputs or output or parameters):
        return None
    if not any(model.suffix.lower() == ".fmu" for model in models):
        named = ", ".join(map(str, models)) or "no model"
        raise InputError(f"{named}: --fmu-input, --fmu-output and --fmu-set go with a model that ends in .fmu")
    return Choice(
        inputs=_pairs("--fmu-input", inputs or ()), force=output, parameters=_pairs("--fmu-set", parameters or ())
    )


def _pairs(option: str, texts: Sequence[str]) -> dict[str, str]:
    from api.errors import InputError

    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals and value):
            raise InputError(f"{option} is {text!r}: write NAME=VALUE")
    return dict(text.split("=", 1) for text in texts)
