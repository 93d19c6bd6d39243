"""What an import says, with the arguments of Python in the place of the options of the command line."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from rigctl.errors import ForeignFileError

__all__ = ["in_python", "said_in_python"]

_VALUE: Final = r"\s(?!is\b|and\b|or\b|with\b|makes\b|interpolates\b|there\b)([^\s,;)]*[^\s,;:.)])"
_CHANNEL: Final = re.compile(
    rf"--(time|displacement|velocity|force|current|temperature|acceleration)(?:{_VALUE})?",
)
_SIGNS: Final = re.compile(rf"--(flip|centre)(?:{_VALUE})?")
_OTHERS: Final = re.compile(
    rf"--(rate|resample|part|encoding|delimiter|decimal|header-lines|kind|specimen)(?:{_VALUE})?"
)
_NAMES: Final = {"rate": "rate_hz", "resample": "resample_hz", "header-lines": "header_lines"}
_NUMBERS: Final = ("rate_hz", "resample_hz", "header_lines")


@contextmanager
def said_in_python() -> Iterator[None]:
    """An import within raises its ForeignFileError in the words of Python."""
    try:
        yield
    except ForeignFileError as error:
        raise type(error)(in_python(str(error))) from error


def in_python(text: str) -> str:
    """The text with arguments of `dr.load` for options of `damper-rig import`.

    >>> in_python("no time is found: --time NAME:UNIT, or --rate HZ")
    'no time is found: columns={"time": "NAME:UNIT"}, or choice=dr.Choice(rate_hz=HZ)'
    >>> in_python("--rate is -1: it must be above 0")
    'rate_hz is -1: it must be above 0'
    """
    text = text.replace(", or read it with --mapping", "")  # an archive is a matter of the command
    text = _CHANNEL.sub(lambda m: f'columns={{"{m[1]}": "{m[2]}"}}' if m[2] else f'columns["{m[1]}"]', text)
    text = _SIGNS.sub(lambda m: _sign(m[1], m[2]), text)
    return _OTHERS.sub(lambda m: _other(_NAMES.get(m[1], m[1]), m[2]), text).replace("--split", "split=True")


def _sign(name: str, channel: str | None) -> str:
    if not channel:
        return name
    return f'flip=["{channel}"]' if name == "flip" else f'choice=dr.Choice(centre=("{channel}",))'


def _other(name: str, value: str | None) -> str:
    if not value:
        return name
    return f"choice=dr.Choice({name}={value})" if name in _NUMBERS else f'choice=dr.Choice({name}="{value}")'
