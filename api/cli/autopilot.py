"""``damper-rig autopilot``: explain, run the most informative test, explain again."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.cli.options import Envelopes, RigOption, Yes
from api.cli.places import to_folder

if TYPE_CHECKING:
    from api.campaigns.autopilot import Round
    from excitation.plan import Test
    from identification.discrepancy import Explanation
    from rigctl.runfile import Run

__all__ = ["autopilot"]


def autopilot(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="Your present simulation: .json.")],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Runs measured so far.")],
    rig: RigOption,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", callback=to_folder, metavar="DIR", help="Folder of the runs and the report."),
    ],
    budget: Annotated[float, typer.Option(min=1.0, help="Rig time that may be used, seconds of motion.")] = 120.0,
    envelope: Envelopes = None,
    yes: Yes = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Find what the simulation is missing, and run the tests on the rig that make the names sure.

    A rig that is not simulated moves only after you have said yes, before each test. The tests stay within the
    stroke, speed and current of the given runs.

    Example: damper-rig autopilot model.json first.h5 --rig modbus://127.0.0.1:5020 -o found --budget 60
    """
    from api.campaigns.autopilot import autopilot as run_autopilot
    from api.cli.envelopes import envelopes_for
    from api.cli.person import Terminal
    from api.cli.start import ask_to_start
    from api.cli.terminal import answer, progress_bar
    from identification.compute import chosen
    from identification.discrepancy import explain, report_data, write_report
    from identification.physical.modelfile import read_model
    from identification.report import report_lines
    from rigctl.player import PlayerSettings, connect, play
    from rigctl.runfile import read_run

    settings = PlayerSettings(envelopes=envelopes_for(envelope or (), ()))
    base = read_model(model)
    measured = [read_run(path) for path in runs]
    specimen = measured[0].specimen
    seen: list[Run] = []  # by the explanation so far
    transport = connect(rig)
    try:

        def explain_runs(so_far: Sequence[Run]) -> Explanation:
            seen[:] = so_far
            with progress_bar("explaining") as tell:
                return explain(base, so_far, on_progress=lambda text, done: tell(done, text))

        def play_test(test: Test) -> Run:
            ask_to_start(transport, Terminal(), f"test {test.name}", yes=yes)
            with progress_bar(test.name) as tell:
                path = play(
                    transport,
                    test,
                    output / "runs",
                    specimen=specimen,
                    settings=settings,
                    on_progress=lambda p: tell(p.samples / max(p.total_samples, 1), f"{p.test}: {p.phase}"),
                )
            return read_run(path)

        def report_round(made: Round) -> None:
            write_report(made.found, output, runs=seen)  # kept even if the next test fails
            typer.echo(_round_line(made), err=True)

        with chosen(os.environ):
            rounds = run_autopilot(
                measured, explain=explain_runs, play=play_test, budget_s=budget, on_round=report_round
            )
    finally:
        transport.close()
    report = report_data(rounds[-1].found)
    last = f"{len(rounds) - 1} tests, {rounds[-1].rig_seconds:.0f} s of motion; ended: {rounds[-1].ended}"
    answer("\n".join([*report_lines(report), last, str(output / "report.html")]), report, as_json=as_json)


def _round_line(made: Round) -> str:
    names = ", ".join(f"{e.element} {e.confidence:.2f}" for e in made.found.effects) or "no name"
    ahead = made.ended or made.found.next_test.text
    return f"{made.runs} runs: {made.found.verdict.replace('_', ' ')}, {names}; {ahead}"
