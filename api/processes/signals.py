"""The signals that end a process of this program."""

from __future__ import annotations

import signal

__all__ = ["ending_signals"]

# SIGHUP: the terminal was closed or its connection lost. SIGQUIT: Ctrl-\.
_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT")


def ending_signals() -> tuple[signal.Signals, ...]:
    """The signals that end a process, of those that this system has.

    SIGHUP is left out where it was ignored from the start, as under ``nohup``: the user wants the process to go on
    without its terminal.
    """
    exists = [signal.Signals[name] for name in _NAMES if hasattr(signal, name)]
    return tuple(
        number for number in exists if number.name != "SIGHUP" or signal.getsignal(number) is not signal.SIG_IGN
    )
