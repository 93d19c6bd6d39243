"""``damper-rig demo``: the main job end to end on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.cli.places import to_folder

if TYPE_CHECKING:
    from rich.console import Console

    from api.demo.demonstration import Bar, Demonstration

__all__ = ["demo"]


def demo(
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_folder, metavar="DIR", help="Output folder.")
    ] = Path("demo-output"),
    seed: Annotated[int | None, typer.Option(help="Seed of the hidden effect; default: random, printed.")] = None,
    effect: Annotated[str | None, typer.Option(help="Effect to hide instead of a random one.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Run the main job end to end: simulated rig, service, campaign, run files, model, explained gap, report.

    Takes about two minutes. Ctrl-C stops the rig and ends every process that was started.

    Example: damper-rig demo -o demo-output --seed 7
    """
    import secrets
    import time

    from api.cli.terminal import answer, messages
    from api.demo.demonstration import Asked, demonstrate
    from api.demo.report import write_index

    started = time.monotonic()
    drawn = secrets.randbelow(1_000_000) if seed is None else seed
    console = messages()
    output = output.absolute()  # links must not depend on the working folder
    demonstration = demonstrate(Asked(output=output, seed=drawn, effect=effect or ""), _Show(console))
    report = output / "report.html"
    write_index(demonstration, report)
    console.print(f"[bold]7[/bold]  Done in {time.monotonic() - started:.0f} s")
    answer(_text(demonstration, report), _figures(demonstration, report), as_json=as_json)


class _Show:
    """Prints steps as lines, and bars only on a terminal."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def step(self, number: int, text: str) -> None:
        self._console.print(f"[bold]{number}[/bold]  {text}")

    def say(self, text: str) -> None:
        self._console.print(f"   {text}", markup=False)

    @contextmanager
    def bars(self) -> Iterator[Bar]:
        from rich.progress import TaskID

        from api.cli.terminal import progress_display

        with progress_display() as display:
            tasks: dict[str, TaskID] = {}
            said: set[str] = set()

            def tell(name: str, done: float, text: str = "") -> None:
                shown = f"   {name}: {text}" if text else f"   {name}"
                if name not in tasks:
                    tasks[name] = display.add_task(shown, total=1.0)
                display.update(tasks[name], completed=done, description=shown)
                if display.disable and shown not in said:
                    said.add(shown)
                    self._console.print(shown, markup=False)

            yield tell


def _figures(demonstration: Demonstration, report: Path) -> dict[str, object]:
    return {
        "seed": demonstration.asked.seed,
        "hidden": list(demonstration.truth),
        "named_right": demonstration.named_right,
        "rig": dict(demonstration.rig.report),
        "real": dict(demonstration.real.report),
        "report": str(report),
    }


def _text(demonstration: Demonstration, report: Path) -> str:
    from api.demo.demonstration import judged
    from api.demo.report import gap_rows, verdict_text

    lines = []
    for finding in (demonstration.rig, demonstration.real):
        gaps = ", ".join(f"{name} {value:.4g} N" for name, value in gap_rows(finding))
        closed = finding.report["gap"]["held_out"].get("closed")
        share = "" if closed is None else f" ({100 * closed:.1f} % of the reducible gap closed)"
        lines += [f"{finding.title}: {verdict_text(finding)}", f"  held-out gap: {gaps}{share}"]
    said = judged(demonstration.named, demonstration.truth)
    lines.append(f"Hidden in the rig was: {', '.join(demonstration.truth)} ({said})")
    return "\n".join([*lines, f"Report: {report}"])
