"""The command ``damper-rig``: its subcommands and their exit status."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy
from functools import cache
from itertools import pairwise
from typing import Any, NoReturn

import typer
import typer.main
from typer.models import CommandInfo

from api.cli.align import align
from api.cli.analyse import analyse
from api.cli.arguments import repeat_options
from api.cli.autopilot import autopilot
from api.cli.campaign import campaign
from api.cli.characterise import characterise
from api.cli.compare import compare
from api.cli.convert import convert
from api.cli.demo import demo
from api.cli.design import design
from api.cli.examples import examples
from api.cli.explain import explain
from api.cli.fit import fit
from api.cli.help_words import WordedGroup
from api.cli.identify import identify
from api.cli.import_files import import_files
from api.cli.interrupt import ignore_signals, take_signals
from api.cli.iterate import iterate
from api.cli.key import key
from api.cli.listings import effects, elements, faults, specimens
from api.cli.model import model
from api.cli.recover import recover
from api.cli.report import report
from api.cli.rig import rig
from api.cli.run import run as run_tests
from api.cli.score import score
from api.cli.serve import serve
from api.cli.sim import sim
from api.cli.simulate import simulate
from api.cli.store import store
from api.cli.study import study
from api.cli.terminal import quiet
from api.cli.track import track
from api.cli.worker import worker
from api.processes.lasting import collect_seldom, leave_what_is_there

__all__ = ["main", "run"]

app = typer.Typer(
    name="damper-rig",
    cls=WordedGroup,
    help="Design damper experiments, drive the rig, identify the model, name what a simulation is missing.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(demo)
app.add_typer(design)
app.command()(sim)
app.command("run")(run_tests)
app.command()(iterate)
app.command()(recover)
app.add_typer(rig)
app.command()(align)
app.command("import")(import_files)
app.add_typer(model)
app.command()(fit)
app.command()(identify)
app.command()(simulate)
app.command()(track)
app.command()(score)
app.command()(compare)
app.command()(explain)
app.add_typer(study)
app.command()(report)
app.command()(autopilot)
app.command()(analyse)
app.command()(characterise)
app.command()(convert)
app.command()(examples)
app.command()(elements)
app.command()(specimens)
app.command()(effects)
app.command()(faults)
app.command()(serve)
app.command()(worker)
app.add_typer(key)
app.add_typer(store)
app.add_typer(campaign)

# typer keeps click inside or outside of itself, depending on its version: this finds the class either way
_USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]
_TYPER_INTERRUPTED = 130  # what typer makes of KeyboardInterrupt, again depending on its version


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"damper-rig {version('damper-rig')}")
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(False, "--version", help="Print the version.", is_eager=True, callback=_print_version),
    be_quiet: bool = typer.Option(
        False, "--quiet", "-q", help="Before the command: no progress and no findings about the data; errors remain."
    ),
) -> None:
    quiet.set(be_quiet)


def run() -> NoReturn:
    """The console script. Ends with 0 done, 2 bad input or usage, 1 anything else."""
    take_signals()
    collect_seldom()
    # Before numpy is imported: on small matrices several threads take three times as long and round differently.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    status = main(sys.argv[1:], settled=ignore_signals)
    try:
        sys.stdout.flush()
    except OSError:  # the reader of our output has ended, or the terminal was closed
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = status or 1
    leave_what_is_there()
    sys.exit(status)


def main(arguments: Sequence[str], *, settled: Callable[[], None] = lambda: None) -> int:
    """Run one command line and return its exit status; errors are one line on standard error.

    ``settled`` is called as soon as the status is known, where a further signal must not change it.
    """
    try:
        status = _ended(arguments)
        settled()
    except (KeyboardInterrupt, typer.Abort):
        settled()  # here: as long as the interruption is being handled, no signal raises another
        status = _TYPER_INTERRUPTED
    if status != _TYPER_INTERRUPTED:
        return status
    _say("interrupted")
    return 1


@cache
def _commands(name: str) -> Callable[..., Any]:  # Any: what a command returns
    """The command or group of this name, or all of them where there is none, with options read from their functions.

    Reading all takes as long as the rest of a start; a program that calls a command many times pays for it once.
    """
    one = copy(app)
    one.registered_commands = [c for c in app.registered_commands if _name_of(c) == name]
    one.registered_groups = [
        g for g in app.registered_groups if g.typer_instance and g.typer_instance.info.name == name
    ]
    found = one.registered_commands or one.registered_groups
    return typer.main.get_command(one if found else app)


@cache
def _names() -> frozenset[str]:
    groups = (g.typer_instance.info.name for g in app.registered_groups if g.typer_instance)
    return frozenset([*map(_name_of, app.registered_commands), *(str(name) for name in groups)])


def _name_of(command: CommandInfo) -> str:
    return command.name or str(getattr(command.callback, "__name__", ""))


def _ended(arguments: Sequence[str]) -> int:
    """The exit status of a command that was not interrupted; _TYPER_INTERRUPTED where typer says that it was."""
    try:
        name = arguments[0] if arguments else ""
        result = _commands(name if name in _names() else "")(
            repeat_options(arguments), prog_name="damper-rig", standalone_mode=False
        )
        return result if isinstance(result, int) else 0
    except typer.Abort:
        raise
    except typer.Exit as ended:
        return ended.exit_code
    except _USAGE_ERROR as error:
        return _usage(error, arguments)
    except BrokenPipeError:
        return 1
    except Exception as error:  # noqa: BLE001 - the last handler: any error becomes one line
        return _failed(error)


def _usage(error: Exception, arguments: Sequence[str]) -> int:
    message = " ".join(error.format_message().split()) if hasattr(error, "format_message") else str(error)
    if not message:  # no arguments: typer has printed the help
        return 2
    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else "damper-rig"
    _say(f"{message}{_given(error, arguments)} (see {command} --help)")
    return 2


def _given(error: Exception, arguments: Sequence[str]) -> str:
    """The value that an option was given, which typer's message leaves out."""
    options = getattr(getattr(error, "param", None), "opts", [])
    values = [value for option, value in pairwise(arguments) if option in options]
    return f" It is {values[-1]!r:.60}." if values else ""


def _failed(error: Exception) -> int:
    from api.errors import one_line, outcome_of

    outcome = outcome_of(error)
    if outcome is not None:
        _say(one_line(error))
        return outcome.exit_status
    if os.environ.get("DAMPER_RIG_TRACEBACK"):
        raise error
    _say(
        f"a fault of this program: {type(error).__name__}: {one_line(error)} (set DAMPER_RIG_TRACEBACK=1 to see where)"
    )
    return 1


def _say(text: str) -> None:
    with suppress(OSError):  # the terminal was closed
        print(f"damper-rig: {text}", file=sys.stderr)
