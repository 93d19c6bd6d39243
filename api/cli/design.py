"""``damper-rig design``: excitation files and test plans from a configuration or from an earlier file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from excitation import Envelope, Excitation, TestPlan

__all__ = ["design"]

design = typer.Typer(
    name="design",
    help="Design an excitation or a test plan, or repeat the design in a file.\n\n"
    "Example: damper-rig design --from multisine.h5 -o again.h5",
    no_args_is_help=True,
    invoke_without_command=True,
)

Config = Annotated[Path, typer.Argument(metavar="CONFIG.toml", help="The configuration.")]
Out = Annotated[Path, typer.Option("-o", "--output", help=".h5 holds the whole design, .csv opens in a spreadsheet.")]
Rig = Annotated[
    Path | None,
    typer.Option(
        "--envelope", metavar="RIG.toml", help="The rig's limits (TOML); a design that exceeds them is refused."
    ),
]
Fit = Annotated[bool, typer.Option("--scale-to-fit", help="Scale a design that exceeds the limits down to them.")]
Damper = Annotated[
    Path | None, typer.Option("--model", metavar="MODEL.json", help="The damper, for the predicted force and heat.")
]
Plot = Annotated[
    Path | None, typer.Option("--plot", metavar="OUT.html", help="Charts, in one page that opens offline.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the figures of the design as JSON.")]


@design.callback()
def repeat(
    context: typer.Context,
    source: Annotated[Path | None, typer.Option("--from", metavar="FILE", help="Repeat the design in FILE.")] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="With --from: the new file.")] = None,
    envelope: Rig = None,
    scale_to_fit: Fit = False,
    model: Damper = None,
    plot: Plot = None,
    explain_keys: Annotated[
        bool, typer.Option("--explain-keys", help="Print every key of the configurations: unit, default and meaning.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Without a command: repeats the design in the file of --from."""
    from api.errors import InputError

    given = source, output, envelope, model, plot
    if explain_keys:
        _explain_keys(context.invoked_subcommand, as_json)
        raise typer.Exit
    if context.invoked_subcommand is not None:
        if scale_to_fit or as_json or any(value is not None for value in given):
            raise InputError(f"design: options stand after {context.invoked_subcommand!r}, with its CONFIG.toml")
        return
    if source is None or output is None:
        raise InputError("design: give --from FILE and -o FILE, or a command (random-phase, homogenised, harmonic)")
    from api.cli.force_model import force_model
    from excitation import read_envelope
    from excitation.design import remake_file, within_envelope

    limits = None if envelope is None else read_envelope(envelope)
    if limits is None and scale_to_fit:
        raise InputError("--scale-to-fit: give the limits by --envelope RIG.toml")
    _check_plot(plot)
    made = remake_file(source)
    damper = None if model is None else force_model(model)
    if limits is not None:
        made = within_envelope(made, limits, fit=scale_to_fit, force_model=damper)
    _write(made, output, plot, limits, model, as_json)


def _explain_keys(command: str | None, as_json: bool) -> None:
    """The keys of one command, or of all."""
    from dataclasses import asdict

    from api.cli.terminal import answer
    from excitation.design_keys import COMMANDS, keys_of, keys_text

    wanted = COMMANDS if command is None else (command,)
    data = {one: [asdict(key) for key in keys_of(one)] for one in wanted}
    answer("\n\n".join(keys_text(one) for one in wanted), data, as_json=as_json)


@design.command("random-phase")
def random_phase(
    config: Config,
    output: Out,
    envelope: Rig = None,
    scale_to_fit: Fit = False,
    model: Damper = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """A random-phase multisine of displacement and, if configured, current.

    Example: damper-rig design random-phase multisine.toml -o multisine.h5 --plot multisine.html
    """
    _design("random-phase", config, output, envelope, scale_to_fit, model, plot, as_json)


@design.command("homogenised")
def homogenised(
    config: Config,
    output: Out,
    envelope: Rig = None,
    scale_to_fit: Fit = False,
    model: Damper = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """The multisine that covers the working range uniformly.

    Example: damper-rig design homogenised multisine.toml -o homogenised.h5 --envelope rig.toml
    """
    _design("homogenised", config, output, envelope, scale_to_fit, model, plot, as_json)


@design.command("harmonic")
def harmonic(
    config: Config,
    output: Out,
    envelope: Rig = None,
    scale_to_fit: Fit = False,
    model: Damper = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """A plan of sines or triangles within the rig's envelope.

    Example: damper-rig design harmonic matrix.toml -o plan.csv --envelope rig.toml --scale-to-fit
    """
    _design("harmonic", config, output, envelope, scale_to_fit, model, plot, as_json)


def _design(
    command: str,
    config: Path,
    output: Path,
    envelope: Path | None,
    fit: bool,
    model: Path | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    from api.cli.force_model import force_model
    from api.cli.terminal import progress_bar
    from api.errors import InputError
    from excitation import read_envelope
    from excitation.design import design_file, envelope_of

    _check_plot(plot)
    limits = envelope_of(config) if envelope is None else read_envelope(envelope)
    if limits is None and (fit or model is not None):
        option = "--scale-to-fit" if fit else "--model"
        raise InputError(f"{option}: no limits are given: give --envelope RIG.toml, or envelope in {config}")
    damper = None if model is None else force_model(model)
    with progress_bar(f"designing {output.name}"):
        made = design_file(command, config, envelope=limits, fit=fit, force_model=damper)
    _write(made, output, plot, limits, model, as_json)


def _check_plot(plot: Path | None) -> None:
    """Checked before the design: either both files are written or none."""
    from api.errors import InputError

    if plot is None:
        return
    if plot.suffix != ".html":
        raise InputError(f"--plot {plot}: charts are a web page: end its name in .html")
    if not plot.parent.is_dir():
        raise InputError(f"--plot {plot}: there is no folder {plot.parent}: make it first")


def _write(
    made: Excitation | TestPlan,
    output: Path,
    plot: Path | None,
    limits: Envelope | None,
    model: Path | None,
    as_json: bool,
) -> None:
    from api.cli.terminal import answer
    from excitation import Excitation, write_excitation, write_plan

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
    if plot is not None:
        from api.cli.force_model import force_model
        from excitation.plots import write_plots

        write_plots(plot, made, limits, None if model is None else force_model(model))
        facts["plot"] = str(plot)
    shown = ", ".join(f"{key} {_shown(value)}" for key, value in facts.items() if not isinstance(value, dict))
    answer(f"{output}: {shown}", {"file": str(output), **facts}, as_json=as_json)


def _shown(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
