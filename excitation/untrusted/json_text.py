"""JSON from elsewhere: only values that every part of this program can use."""

from __future__ import annotations

import json
from math import isfinite
from typing import Any, Final, NoReturn

__all__ = ["parse_json"]

MOST_DEPTH: Final = 100  # lists in lists; a report, our deepest, has 9. Python itself ends at some 1 000
MOST_DIGITS: Final = 300  # of a whole number: a float64 holds 308, and Python takes time with the square of them


def parse_json(text: str | bytes) -> Any:
    """The value of a JSON text. Any: JSON.

    Raises ValueError, one line: no JSON, NaN or Infinity, a number beyond float64, too deep, or a lone surrogate.
    """
    try:
        value = json.loads(text, parse_constant=_no_constant, parse_float=_finite, parse_int=_whole)
    except RecursionError:
        raise ValueError(f"nested deeper than {MOST_DEPTH} levels: JSON of this program never is") from None
    _check(value)
    return value


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON: give a finite one, or null")


def _finite(text: str) -> float:
    value = float(text)
    if not isfinite(value):
        raise ValueError(f"the number {text:.20} is beyond 1.8e308: give a smaller one")
    return value


def _whole(text: str) -> int:
    if len(text) > MOST_DIGITS:
        raise ValueError(f"the number {text:.20}… has {len(text)} digits: at most {MOST_DIGITS} are read")
    return int(text)


def _check(value: Any) -> None:
    level, depth = [value], 0
    while level:
        if depth > MOST_DEPTH:
            raise ValueError(f"nested deeper than {MOST_DEPTH} levels: JSON of this program never is")
        for text in level:
            if isinstance(text, str) and not text.isascii():
                _check_text(text)
        depth += 1
        level = [inner for outer in level if isinstance(outer, dict | list) for inner in _inner(outer)]


def _inner(outer: dict[str, Any] | list[Any]) -> list[Any]:
    return [*outer.keys(), *outer.values()] if isinstance(outer, dict) else outer


def _check_text(text: str) -> None:
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ValueError(f"the text {text!a:.60} has half a character (a lone surrogate): remove it") from error
