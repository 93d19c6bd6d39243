"""``damper-rig iterate``: the drive with which the measured motion and current equal the target."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from api.cli.options import Envelopes, Interlocks, Operator, RigOption, Specimen, Yes
from api.cli.places import to_folder

if TYPE_CHECKING:
    from excitation import TestPlan
    from rigctl.drive_file import StoredDrive
    from rigctl.iterate import Iterated

__all__ = ["iterate"]


def iterate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The target: an excitation file or a plan.")],
    rig: RigOption,
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_folder, help="Folder of drives, charts and run files.")
    ],
    tolerance: Annotated[
        float, typer.Option(help="Tolerance of the error of each channel, % rms of its target.")
    ] = 1.0,
    iterations: Annotated[int, typer.Option(help="Largest number of iterations after the first round.")] = 5,
    gain: Annotated[float, typer.Option(help="Share of the correction that one iteration makes.")] = 1.0,
    bandwidth: Annotated[
        float | None, typer.Option(help="No correction above this frequency, Hz; default: the band of each target.")
    ] = None,
    motion_only: Annotated[
        bool, typer.Option("--motion-only", help="Iterate the displacement; play the current as commanded.")
    ] = False,
    start: Annotated[
        Path | None,
        typer.Option("--from", metavar="FILE", help="Start from this stored drive (.drive.h5) of the same target."),
    ] = None,
    cool_to: Annotated[
        float | None, typer.Option(help="Wait before each run until the damper is at or below this temperature, °C.")
    ] = None,
    interlock: Interlocks = None,
    envelope: Envelopes = None,
    specimen: Specimen = "",
    operator: Operator = "",
    yes: Yes = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Iterate the drive of each test until measured displacement and current equal the target.

    Writes NAME.drive.h5 (play it with 'damper-rig run'), NAME.convergence.html and a run file of each round; drive and
    chart after every round, so that an iteration that was interrupted continues with --from.
    Ctrl-Z holds: the rig comes to rest under power. Ctrl-Z again resumes; no sample is lost or repeated.
    Exit status 1: the tolerance was not reached.

    Example: damper-rig iterate road.h5 --rig modbus://127.0.0.1:5020 -o iterated
    """
    from functools import partial

    from api.cli.envelopes import envelopes_for
    from api.cli.interrupt import take_hold
    from api.cli.person import Terminal
    from api.cli.run import plan_of
    from api.cli.start import ask_to_start
    from api.cli.terminal import answer, progress_display
    from rigctl.drive import IterationSettings
    from rigctl.interlocks import interlock as interlock_from
    from rigctl.iterate import Outcome
    from rigctl.iterate import iterate as iterated_by
    from rigctl.limits_together import limits_together
    from rigctl.player import PlayerSettings, connect, play
    from rigctl.recording import rig_text
    from rigctl.warm_up import warmed_up

    settings = IterationSettings(
        gain=gain, bandwidth_hz=bandwidth, tolerance=tolerance / 100, most=iterations, motion_only=motion_only
    )
    plan = _plan_to_cool(plan_of(file), cool_to)
    player = PlayerSettings(
        interlocks=tuple(interlock_from(text) for text in interlock or ()),
        envelopes=envelopes_for(envelope or (), [plan]),
    )
    stored = _stored_drive(start, plan, motion_only)
    found: dict[str, Iterated] = {}
    transport = connect(rig)
    try:
        identity = ask_to_start(
            transport, Terminal(), f"{len(plan.tests)} tests, up to {iterations + 1} rounds each", yes=yes
        )
        if stored is not None:
            stored.check_rig(rig_text(identity))
        with progress_display() as display, take_hold() as should_hold:
            one = partial(
                play, transport, should_hold=should_hold, specimen=specimen, operator=operator, settings=player
            )
            for test in plan.tests:
                bar = display.add_task(test.name, total=iterations + 1)

                def keep(so_far: Iterated, bar: Any = bar, name: str = test.name) -> None:
                    _store(output, name, so_far)
                    display.advance(bar)

                found[test.name] = iterated_by(
                    partial(warmed_up, one, out_dir=output, warm_up=plan.warm_up),
                    test,
                    settings=settings,
                    start=None if stored is None else stored.drive,
                    limits=limits_together(identity.limits, None, player.envelopes, test),
                    on_step=keep,
                )
                _store(output, test.name, found[test.name])
    finally:
        transport.close()
    made = [_made(output, name, iterated) for name, iterated in found.items()]
    answer("\n".join(_line(output, name, iterated) for name, iterated in found.items()), made, as_json=as_json)
    if any(iterated.outcome is not Outcome.CONVERGED for iterated in found.values()):
        raise typer.Exit(1)


def _plan_to_cool(plan: TestPlan, cool_to: float | None) -> TestPlan:
    from dataclasses import replace

    if cool_to is None:
        return plan
    return replace(plan, tests=tuple(replace(test, max_temperature_degc=cool_to) for test in plan.tests))


def _stored_drive(start: Path | None, plan: TestPlan, motion_only: bool) -> StoredDrive | None:
    """The drive to start from, checked against the target; None where there is none."""
    from rigctl.drive_file import read_drive
    from rigctl.errors import IterationError

    if start is None:
        return None
    if len(plan.tests) > 1:
        raise IterationError(f"--from {start}: a stored drive is for one test, the plan has {len(plan.tests)}")
    stored = read_drive(start)
    stored.check_target(plan.tests[0].excitation, motion_only=motion_only)
    return stored


def _paths(output: Path, name: str) -> tuple[Path, Path]:
    from rigctl.player import file_stem

    return output / f"{file_stem(name)}.drive.h5", output / f"{file_stem(name)}.convergence.html"


def _store(output: Path, name: str, iterated: Iterated) -> None:
    from rigctl.drive_file import write_drive
    from rigctl.iterate_plot import write_convergence

    drive, chart = _paths(output, name)
    write_drive(drive, iterated)
    write_convergence(chart, name, iterated)


def _made(output: Path, name: str, iterated: Iterated) -> dict[str, Any]:
    drive, chart = _paths(output, name)
    errors = {str(channel): [step.errors[k] for step in iterated.steps] for k, channel in enumerate(iterated.channels)}
    return {
        "test": name,
        "outcome": str(iterated.outcome),
        "errors": errors.get("displacement", []),
        "current_errors": errors.get("current", []),
        "drive": str(drive),
        "chart": str(chart),
        "runs": [str(step.run) for step in iterated.steps],
    }


def _line(output: Path, name: str, iterated: Iterated) -> str:
    errors = ", ".join(
        f"{channel} {' → '.join(f'{100 * step.errors[k]:.2f}' for step in iterated.steps)}"
        for k, channel in enumerate(iterated.channels)
    )
    return f"{_paths(output, name)[0]}: {name}: {iterated.outcome}, error {errors} % rms"
