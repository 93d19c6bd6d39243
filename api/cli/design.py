"""``damper-rig design``: excitation files and test plans from a configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["design"]

design = typer.Typer(name="design", help="Design an excitation or a test plan.", no_args_is_help=True)

Config = Annotated[Path, typer.Argument(metavar="CONFIG.toml", help="What is wanted.")]
Out = Annotated[Path, typer.Option("-o", "--output", help=".h5 holds the whole design, .csv opens in a spreadsheet.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print what was made as JSON.")]


@design.command("random-phase")
def random_phase(config: Config, output: Out, as_json: AsJson = False) -> None:
    """A random-phase multisine, displacement and, where asked, current.

    Example: damper-rig design random-phase multisine.toml -o multisine.h5
    """
    _design("random-phase", config, output, as_json)


@design.command("homogenised")
def homogenised(config: Config, output: Out, as_json: AsJson = False) -> None:
    """The multisine that covers the working range uniformly.

    Example: damper-rig design homogenised multisine.toml -o homogenised.h5
    """
    _design("homogenised", config, output, as_json)


@design.command("harmonic")
def harmonic(config: Config, output: Out, as_json: AsJson = False) -> None:
    """A plan of sines or triangles within the rig's envelope.

    Example: damper-rig design harmonic matrix.toml -o plan.csv
    """
    _design("harmonic", config, output, as_json)


def _design(command: str, config: Path, output: Path, as_json: bool) -> None:
    from api.cli.terminal import answer, progress_bar
    from excitation import Excitation, write_excitation, write_plan
    from excitation.design import design_file

    with progress_bar(f"designing {output.name}"):
        made = design_file(command, config)
    if isinstance(made, Excitation):
        write_excitation(output, made)
        facts: dict[str, object] = {
            "kind": str(made.kind),
            "samples": made.samples,
            "duration_s": made.duration_s,
            **made.figures,
        }
    else:
        write_plan(output, made)
        facts = {"tests": len(made.tests), "duration_s": made.duration_s}
    shown = ", ".join(f"{key} {_shown(value)}" for key, value in facts.items())
    answer(f"{output}: {shown}", {"file": str(output), **facts}, as_json=as_json)


def _shown(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
