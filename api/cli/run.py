"""``damper-rig run``: play excitation files or plans on a rig, here and now, without the service."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from excitation import Test

__all__ = ["run"]


def run(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE ...", help="Excitation files (.h5, .csv) or plans (.toml, .csv, .h5).")
    ],
    rig: Annotated[str, typer.Option(help="The rig's address, for example modbus://127.0.0.1:5020.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the run files.")],
    specimen: Annotated[str, typer.Option(help="What is in the rig: goes into every run file.")] = "",
    operator: Annotated[str, typer.Option(help="Who does it: goes into every run file.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print the run files as JSON.")] = False,
) -> None:
    """Stream excitation files or plans to the rig and capture one run file for each test.

    Ctrl-C stops the rig within its own limits, closes the run file as 'aborted', and ends.

    Example: damper-rig run multisine.h5 plan.toml --rig modbus://127.0.0.1:5020 -o runs
    """
    from api.cli.terminal import answer, progress_display
    from rigctl.player import connect, play
    from rigctl.progress import Progress

    tests = [test for file in files for test in tests_of(file)]
    transport = connect(rig)
    made: list[dict[str, Any]] = []
    try:
        with progress_display() as display:
            for test in tests:
                bar = display.add_task(test.name, total=test.excitation.samples)

                def tell(progress: Progress, bar: Any = bar) -> None:
                    display.update(bar, completed=progress.samples)

                path = play(transport, test, output, on_progress=tell, specimen=specimen, operator=operator)
                made.append({"test": test.name, "file": str(path)})
    finally:
        transport.close()
        answer("\n".join(str(one["file"]) for one in made), made, as_json=as_json)


def tests_of(file: Path) -> tuple[Test, ...]:
    """The tests in a plan, or the one of an excitation file, named after the file.

    Raises ExcitationFileError or DesignError.
    """
    from excitation import ExcitationFileError, Test, read_excitation, read_plan

    if file.suffix.lower() != ".csv":
        return read_plan(file).tests
    try:
        return (Test(name=file.stem, excitation=read_excitation(file)),)
    except ExcitationFileError as as_excitation:
        try:
            return read_plan(file).tests
        except ExcitationFileError:
            raise as_excitation from None
