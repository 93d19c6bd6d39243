"""``damper-rig run``: play excitation files or plans on a rig, without the service."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from api.cli.options import Envelopes, Interlocks, Operator, RigOption, Specimen, Yes
from api.cli.places import to_folder

if TYPE_CHECKING:
    from collections.abc import Callable

    from excitation import Test, TestPlan
    from rigctl.progress import Progress
    from rigctl.sequence import Played
    from rigctl.setup import Setup

__all__ = ["run"]


def run(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE ...", help="Excitation files (.h5, .csv) or plans (.toml, .csv, .h5).")
    ],
    rig: RigOption,
    output: Annotated[Path, typer.Option("-o", "--output", callback=to_folder, help="Folder of the run files.")],
    specimen: Specimen = "",
    operator: Operator = "",
    serial: Annotated[str, typer.Option(help="Serial number of the specimen, for the run files.")] = "",
    fixture: Annotated[str, typer.Option(help="Fixture, for the run files.")] = "",
    oil: Annotated[str, typer.Option(help="Oil of the specimen, for the run files.")] = "",
    calibration: Annotated[
        Path | None, typer.Option(help="Calibration records of the sensors (.toml, .json): checked, applied, recorded.")
    ] = None,
    tare: Annotated[Path | None, typer.Option(help="Tare of the load cell, from 'damper-rig rig tare'.")] = None,
    ramp: Annotated[float, typer.Option(help="Duration of fade-in and fade-out, s.")] = 1.0,
    settle: Annotated[
        float, typer.Option(help="Time at full amplitude before a periodic excitation is recorded, s.")
    ] = 0.0,
    interlock: Interlocks = None,
    envelope: Envelopes = None,
    yes: Yes = False,
    instrument: Annotated[
        Path | None,
        typer.Option(metavar="MAP.toml", help="A second acquisition, recorded beside each test (see --take, --pulse)."),
    ] = None,
    take: Annotated[
        list[str] | None,
        typer.Option(
            metavar="THEIRS[=OURS]", help="A channel of the instrument, and its name in the aligned run file."
        ),
    ] = None,
    pulse: Annotated[
        str, typer.Option(metavar="THEIRS=OURS", help="Channels in which both see the same pulses, e.g. Coil=current.")
    ] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print the run files as JSON.")] = False,
) -> None:
    """Stream excitation files or plans to the rig and capture one run file for each test.

    Ctrl-C stops the rig within its limits, closes the run file as 'aborted', and ends. Ctrl-Z holds: the rig comes to
    rest under power. Ctrl-Z again resumes; no sample is lost or repeated. The warm-up of a plan is played, and not
    recorded, while the damper is too cold for the next test; where it states an energy or a temperature, also before
    the first test. A rig that is not simulated moves only after you have said yes. Steps before a test (prompt, gate)
    are asked on the terminal. Exit status 1: a test was skipped.

    Example: damper-rig run multisine.h5 plan.toml --rig modbus://127.0.0.1:5020 -o runs
    """
    from functools import partial

    from api.cli.beside import recorded_beside
    from api.cli.envelopes import envelopes_for
    from api.cli.interrupt import take_hold
    from api.cli.person import Terminal, asked_on_a_terminal
    from api.cli.preparation import setup_from
    from api.cli.start import ask_to_start
    from api.cli.terminal import answer, progress_display
    from rigctl.clock import SystemClock
    from rigctl.interlocks import interlock as interlock_from
    from rigctl.player import PlayerSettings, connect, play
    from rigctl.sequence import Sequence

    plans = [plan_of(file) for file in files]
    settings = PlayerSettings(
        ramp_s=ramp,
        settle_s=settle,
        interlocks=tuple(interlock_from(text) for text in interlock or ()),
        envelopes=envelopes_for(envelope or (), plans),
    )
    asked_on_a_terminal(any(test.asks for plan in plans for test in plan.tests))
    transport = connect(rig)
    made: list[dict[str, Any]] = []
    try:
        ask_to_start(transport, Terminal(), f"{sum(len(plan.tests) for plan in plans)} tests", yes=yes)
        setup = setup_from(
            Terminal(), transport, serial=serial, fixture=fixture, oil=oil, calibration=calibration, tare=tare
        )
        with progress_display() as display, take_hold() as should_hold:
            one: Callable[..., Path] = partial(
                play, transport, should_hold=should_hold, specimen=specimen, operator=operator, settings=settings
            )
            if instrument is not None:
                one = recorded_beside(one, instrument, take or (), pulse)
            sequence = partial(
                Sequence,
                transport=transport,
                out_dir=output,
                operator=Terminal(pause=display.stop, resume=display.start),
                clock=SystemClock(),
                gate_s=settings.gate_s,
            )
            for plan in plans:
                setup = _play_plan(plan, one, sequence, setup, display, made)
    finally:
        transport.close()
        answer("\n".join(str(one["file"]) for one in made if one["file"]), made, as_json=as_json)
    if skipped := [one for one in made if "skipped" in one]:
        for left in skipped:
            print(f"damper-rig: test {left['test']!r} was skipped: {left['skipped']}", file=sys.stderr)
        raise typer.Exit(1)


def _play_plan(
    plan: TestPlan, play: Any, sequence: Any, setup: Setup, display: Any, made: list[dict[str, Any]]
) -> Setup:
    """Play the tests of one plan and append what was made; return the setup for the next plan.

    Any: rigctl and rich are imported only when the command runs.
    """
    from dataclasses import replace

    bar: Any = None

    def tell(progress: Progress) -> None:
        text = f"{progress.test}: {progress.phase} {progress.text}".rstrip()
        display.update(bar, completed=progress.samples, description=text)

    def one(test: Test, out_dir: Path, setup: Setup) -> Path:
        path: Path = play(test, out_dir, setup=setup, on_progress=tell)
        return path

    playing = sequence(
        play=one, setup=setup, warm_up=plan.warm_up, tell=lambda text: display.update(bar, description=text)
    )
    for test in plan.tests:
        bar = display.add_task(test.name, total=test.excitation.samples)
        made.append(_as_made(playing.run(test)))
    prepared: Setup = replace(playing.setup, warm_up=None)  # the next plan has a warm-up of its own
    return prepared


def _as_made(played: Played) -> dict[str, Any]:
    made: dict[str, Any] = {"test": played.test.name, "file": str(played.path) if played.path else None}
    return {**made, "skipped": played.skipped} if played.skipped else made


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
