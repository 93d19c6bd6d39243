"""What every command shows: progress on standard error if it is a terminal, results on standard output."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from rigctl.runfile import Run

__all__ = [
    "ProgressBar", "answer", "ask", "existing", "messages", "progress_bar", "progress_display", "quiet",
    "show_findings", "warn",
]  # fmt: skip

quiet: ContextVar[bool] = ContextVar("quiet", default=False)
"""Whether progress, findings and questions are left out; results and errors never are."""


class ProgressBar(Protocol):
    """Shows how far a command is."""

    def __call__(self, done: float, text: str = "") -> None: ...


def messages() -> Console:
    """The console on standard error, for messages."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, soft_wrap=True)


def progress_display() -> Progress:
    """Bars on standard error that are removed at the end; none if it is not a terminal."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    console = messages()
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        disable=quiet.get() or not console.is_terminal,
    )


@contextmanager
def progress_bar(text: str) -> Iterator[ProgressBar]:
    """One bar from 0 to 1."""
    with progress_display() as display:
        task = display.add_task(text, total=1.0)

        def tell(done: float, text: str = "") -> None:
            display.update(task, completed=done, description=text or None)

        yield tell


def answer(text: str, value: Any, *, as_json: bool) -> None:
    """Print the result of a command as text or as JSON. Any: JSON."""
    if as_json or text:  # a command without a result prints nothing
        print(json.dumps(value) if as_json else text, file=sys.stdout)


def existing(path: Path, what: str) -> Path:
    """The path where a file is; raises InputError."""
    if not path.is_file():
        from api.errors import InputError

        raise InputError(f"{path}: no such file: give {what}")
    return path


def ask(questions: Sequence[str]) -> None:
    """Print questions about the input on standard error, a line each."""
    for question in () if quiet.get() else questions:
        print(f"damper-rig: {question}", file=sys.stderr)


def warn(runs: Sequence[Run]) -> None:
    """Print what the data checks found in these runs on standard error."""
    from identification.datachecks import findings_in

    if not quiet.get():
        show_findings(findings_in(runs))


def show_findings(findings: Sequence[str]) -> None:
    """Print what data checks found on standard error, a line each."""
    for finding in () if quiet.get() else findings:
        print(f"damper-rig: {finding}", file=sys.stderr)
