"""``damper-rig run``: play excitation files or plans on a rig, without the service."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from excitation import TestPlan

__all__ = ["run"]


def run(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE ...", help="Excitation files (.h5, .csv) or plans (.toml, .csv, .h5).")
    ],
    rig: Annotated[str, typer.Option(help="The rig's address, for example modbus://127.0.0.1:5020.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the run files.")],
    specimen: Annotated[str, typer.Option(help="Specimen, for the run files.")] = "",
    operator: Annotated[str, typer.Option(help="Operator, for the run files.")] = "",
    ramp: Annotated[float, typer.Option(help="Duration of fade-in and fade-out, s.")] = 1.0,
    settle: Annotated[
        float, typer.Option(help="Time at full amplitude before a periodic excitation is recorded, s.")
    ] = 0.0,
    interlock: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CHANNEL:LOW:HIGH:ACTION[:DELAY_S[:MARGIN[:RELEASE_S]]]",
            help="A channel and its limits (SI), and the action outside them: indicate, hold or stop.",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the run files as JSON.")] = False,
) -> None:
    """Stream excitation files or plans to the rig and capture one run file for each test.

    Ctrl-C stops the rig within its limits, closes the run file as 'aborted', and ends. Ctrl-Z holds: the rig comes to
    rest under power. Ctrl-Z again resumes; no sample is lost or repeated. The warm-up of a plan is played, and not
    recorded, while the damper is too cold for the next test.

    Example: damper-rig run multisine.h5 plan.toml --rig modbus://127.0.0.1:5020 -o runs
    """
    from functools import partial

    from api.cli.interrupt import take_hold
    from api.cli.terminal import answer, progress_display
    from rigctl.interlocks import interlock as interlock_from
    from rigctl.player import PlayerSettings, connect, play
    from rigctl.progress import Progress
    from rigctl.warm_up import warmed_up

    plans = [plan_of(file) for file in files]
    settings = PlayerSettings(
        ramp_s=ramp, settle_s=settle, interlocks=tuple(interlock_from(text) for text in interlock or ())
    )
    transport = connect(rig)
    made: list[dict[str, Any]] = []
    try:
        with progress_display() as display, take_hold() as should_hold:
            for test, warm_up in ((test, plan.warm_up) for plan in plans for test in plan.tests):
                bar = display.add_task(test.name, total=test.excitation.samples)

                def tell(progress: Progress, bar: Any = bar) -> None:
                    text = f"{progress.test}: {progress.phase} {progress.text}".rstrip()
                    display.update(bar, completed=progress.samples, description=text)

                one = partial(
                    play,
                    transport,
                    on_progress=tell,
                    should_hold=should_hold,
                    specimen=specimen,
                    operator=operator,
                    settings=settings,
                )
                path = warmed_up(one, test, output, warm_up, gate_s=settings.gate_s)
                made.append({"test": test.name, "file": str(path)})
    finally:
        transport.close()
        answer("\n".join(str(one["file"]) for one in made), made, as_json=as_json)


def plan_of(file: Path) -> TestPlan:
    """The plan in a file, or the one test of an excitation file, named after the file.

    Raises ExcitationFileError or DesignError.
    """
    from excitation import ExcitationFileError, Test, TestPlan, read_excitation, read_plan

    if file.suffix.lower() != ".csv":
        return read_plan(file)
    try:
        return TestPlan(tests=(Test(name=file.stem, excitation=read_excitation(file)),))
    except ExcitationFileError as as_excitation:
        try:
            return read_plan(file)
        except ExcitationFileError:
            raise as_excitation from None
