"""``damper-rig design``: excitation files and test plans from a configuration or from an earlier file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from api.cli.places import to_file

if TYPE_CHECKING:
    from excitation import Envelope, Excitation, TestPlan

__all__ = ["design"]

OnExcess = Literal["refuse", "drop", "shorten", "scale"]  # as excitation has it, which --help does not load

design = typer.Typer(
    name="design",
    help="Design an excitation or a test plan, or repeat the design in a file.\n\n"
    "Example: damper-rig design --from multisine.h5 -o again.h5",
    no_args_is_help=True,
    invoke_without_command=True,
)

Config = Annotated[Path, typer.Argument(metavar="CONFIG.toml", help="The configuration.")]
Out = Annotated[
    Path,
    typer.Option("-o", "--output", callback=to_file, help=".h5 holds the whole design, .csv opens in a spreadsheet."),
]
Rig = Annotated[
    Path | None,
    typer.Option(
        "--envelope", metavar="RIG.toml", help="The rig's limits (TOML); a design that exceeds them is refused."
    ),
]
Fit = Annotated[bool, typer.Option("--scale-to-fit", help="Scale a design that exceeds the limits down to them.")]
Excess = Annotated[
    OnExcess | None,
    typer.Option("--on-excess", help="What becomes of a test that exceeds the limits; the command lists them."),
]
Damper = Annotated[
    Path | None, typer.Option("--model", metavar="MODEL.json", help="The damper, for the predicted force and heat.")
]
Plot = Annotated[
    Path | None,
    typer.Option("--plot", metavar="OUT.html", callback=to_file, help="Charts, in one page that opens offline."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the figures of the design as JSON.")]


@design.callback()
def repeat(
    context: typer.Context,
    source: Annotated[Path | None, typer.Option("--from", metavar="FILE", help="Repeat the design in FILE.")] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", callback=to_file, help="With --from: the new file.")
    ] = None,
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
        names = ", ".join((*_COMMANDS, "multi-axis"))
        raise InputError(f"design: give --from FILE and -o FILE, or a command ({names})")
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


_COMMANDS: Mapping[str, str] = {
    "random-phase": """A random-phase multisine of displacement and, if configured, current.

    Example: damper-rig design random-phase multisine.toml -o multisine.h5 --plot multisine.html
    """,
    "homogenised": """The multisine that covers the working range uniformly.

    Example: damper-rig design homogenised multisine.toml -o homogenised.h5 --envelope rig.toml
    """,
    "harmonic": """A plan of sines or triangles within the rig's envelope.

    Example: damper-rig design harmonic matrix.toml -o plan.csv --envelope rig.toml --scale-to-fit
    """,
    "steps": """Steps of the current between levels, or a pseudo-random binary sequence, while a sine runs.

    Example: damper-rig design steps steps.toml -o steps.h5 --envelope rig.toml
    """,
    "sweep": """A swept sine, linear or logarithmic, as large as its bounds allow at each frequency.

    Example: damper-rig design sweep sweep.toml -o sweep.h5 --plot sweep.html
    """,
    "noise": """Periodic noise of a given power density.

    Example: damper-rig design noise noise.toml -o noise.h5
    """,
    "road": """The stroke of a car's suspension on a road of ISO 8608 at a speed.

    Example: damper-rig design road road.toml -o road.h5 --envelope rig.toml
    """,
    "replay": """A measured record, cut, filtered, faded at both ends and scaled.

    Example: damper-rig design replay replay.toml -o replay.h5 --envelope rig.toml
    """,
    "preset": """A sequence of laboratories as a plan: PVP, CVP, gas force, friction, shock dyno, EN 13802.

    Example: damper-rig design preset dyno.toml -o plan.csv --envelope rig.toml --on-excess drop
    """,
    "plan": """One plan of several files, configurations and tests.

    Example: damper-rig design plan all.toml -o plan.h5 --envelope rig.toml --on-excess scale
    """,
}


def _add(command: str, told: str) -> None:
    """One command for each kind of design: they differ in their configuration."""

    def run(
        config: Config,
        output: Out,
        envelope: Rig = None,
        scale_to_fit: Fit = False,
        on_excess: Excess = None,
        model: Damper = None,
        plot: Plot = None,
        as_json: AsJson = False,
    ) -> None:
        how = "scale" if scale_to_fit and on_excess is None else on_excess
        _design(command, config, output, envelope, how, model, plot, as_json)

    run.__doc__ = told
    design.command(command)(run)


for _name, _told in _COMMANDS.items():
    _add(_name, _told)


@design.command("multi-axis")
def multi_axis(config: Config, output: Out, as_json: AsJson = False) -> None:
    """Multisines of up to six axes, in realisations from which the response to each axis can be found.

    Example: damper-rig design multi-axis examples/multi_axis.toml -o axes.h5
    """
    from api.cli.terminal import answer
    from excitation.configuration import read_config, to_spec
    from excitation.multi_axis import MultiAxisSpec
    from excitation.multi_axis import multi_axis as design_of
    from excitation.multi_axis_file import multi_axis_facts, write_multi_axis

    spec = to_spec(MultiAxisSpec, read_config(config), str(config))
    write_multi_axis(output, design_of(spec))
    facts = multi_axis_facts(spec)
    shown = ", ".join(f"{key} {_shown(value)}" for key, value in facts.items())
    answer(f"{output}: {shown}", {"file": str(output), **facts}, as_json=as_json)


def _design(
    command: str,
    config: Path,
    output: Path,
    envelope: Path | None,
    on_excess: OnExcess | None,
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
    if limits is None and (on_excess is not None or model is not None):
        option = "--scale-to-fit and --on-excess" if on_excess is not None else "--model"
        raise InputError(f"{option}: no limits are given: give --envelope RIG.toml, or envelope in {config}")
    damper = None if model is None else force_model(model)
    with progress_bar(f"designing {output.name}"):
        made = design_file(command, config, envelope=limits, on_excess=on_excess, force_model=damper)
    _write(made, output, plot, limits, model, as_json)


def _check_plot(plot: Path | None) -> None:
    """Checked before the design: either both files are written or none."""
    from api.errors import InputError

    if plot is None:
        return
    if plot.suffix != ".html":
        raise InputError(f"--plot {plot}: charts are a web page: end its name in .html")


def _write(
    made: Excitation | TestPlan,
    output: Path,
    plot: Path | None,
    limits: Envelope | None,
    model: Path | None,
    as_json: bool,
) -> None:
    from api.cli.terminal import answer, ask
    from excitation import Excitation, write_excitation, write_plan
    from excitation.analysis import spoiled_in

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
        if made.changes:
            facts["changes"] = list(made.changes)
    if plot is not None:
        from api.cli.force_model import force_model
        from excitation.plots import write_plots

        write_plots(plot, made, limits, None if model is None else force_model(model))
        facts["plot"] = str(plot)
    told = spoiled_in(made)
    ask(told)
    facts |= {"warnings": list(told)} if told else {}
    told_apart = ("warnings", "changes")
    shown = ", ".join(
        f"{key} {_shown(value)}"
        for key, value in facts.items()
        if key not in told_apart and not isinstance(value, dict)
    )
    changes = facts.get("changes", [])
    lines = [f"{output}: {shown}", *(changes if isinstance(changes, list) else [])]
    answer("\n".join(lines), {"file": str(output), **facts}, as_json=as_json)


def _shown(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
