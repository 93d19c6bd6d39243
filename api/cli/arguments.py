"""Options that take several values: ``--held-out A.h5 B.h5`` is read as ``--held-out A.h5 --held-out B.h5``."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["repeat_options"]

SEVERAL = ("--held-out", "--runs", "--hide", "--fault", "--interlock", "--trained", "--beside")


def repeat_options(arguments: Sequence[str]) -> list[str]:
    """The arguments with such an option repeated before each of its values, up to the next option.

    >>> repeat_options(["explain", "m.json", "a.h5", "--held-out", "b.h5", "c.h5", "-o", "out"])
    ['explain', 'm.json', 'a.h5', '--held-out', 'b.h5', '--held-out', 'c.h5', '-o', 'out']
    """
    out: list[str] = []
    option: str | None = None
    for k, argument in enumerate(arguments):
        if argument.startswith("-"):
            option = argument if argument in SEVERAL else None
        elif option is not None and arguments[k - 1] != option:
            out.append(option)
        out.append(argument)
    return out
