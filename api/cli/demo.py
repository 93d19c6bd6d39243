"""``damper-rig demo``: the main job end to end on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["demo"]


def demo(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="Folder of everything it makes.")
    ] = Path("demo-output"),
    seed: Annotated[
        int | None, typer.Option(help="Draws the hidden effect; without it one is drawn and printed.")
    ] = None,
    effect: Annotated[str | None, typer.Option(help="Hide this effect instead of a drawn one.")] = None,
) -> None:
    """A simulated rig, the service, a campaign, run files, a model, and what the simulation is missing.

    Example: damper-rig demo -o demo-output --seed 7
    """
    raise typer.Exit(1)
