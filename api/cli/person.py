"""The person at the terminal, asked with the rig without power."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from contextlib import suppress

__all__ = ["Terminal", "asked_on_a_terminal"]


class Terminal:
    """Asks on standard error and reads standard input; `pause` takes a progress display away meanwhile."""

    def __init__(self, *, pause: Callable[[], None] = lambda: None, resume: Callable[[], None] = lambda: None) -> None:
        self._pause, self._resume = pause, resume

    @property
    def is_there(self) -> bool:
        """Whether somebody can be asked."""
        return sys.stdin.isatty()

    def confirm(self, text: str) -> None:
        """Return when the person answers yes; Declined otherwise."""
        if self._answer(f"{text} [y/N] ").strip().lower() not in ("y", "yes"):
            from rigctl.errors import Declined

            raise Declined(f"not confirmed: {text}")

    def number(self, text: str, unit: str) -> float:
        """Return the number that the person gives; ask again where it is none, Declined for an empty answer."""
        while True:
            answer = self._answer(f"{text}, {unit}: ").strip()
            try:
                value = float(answer.replace(",", "."))
            except ValueError:
                value = math.nan
            if math.isfinite(value):
                return value
            if not answer:
                from rigctl.errors import Declined

                raise Declined(f"no answer: {text}")

    def _answer(self, question: str) -> str:
        from rigctl.errors import Declined

        if not self.is_there:
            raise Declined(f"nobody can be asked, standard input is no terminal: {question.strip()}")
        self._pause()
        try:
            _forget_what_was_typed()
            print(question, end="", file=sys.stderr, flush=True)
            return sys.stdin.readline()
        finally:
            self._resume()


def _forget_what_was_typed() -> None:
    """Discard what was typed before a question is shown: an answer belongs to a question that somebody has read."""
    try:
        import termios
    except ImportError:  # Windows
        return
    with suppress(termios.error):
        termios.tcflush(sys.stdin, termios.TCIFLUSH)


def asked_on_a_terminal(questions: bool) -> None:
    """Raise InputError where somebody would have to be asked and nobody can be: before anything moves."""
    if questions and not sys.stdin.isatty():
        from api.errors import InputError

        raise InputError("the plan asks the operator, and standard input is no terminal: run it on one")
