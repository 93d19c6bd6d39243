"""What the body of a request must be before anything reads it: JSON of RFC 8259, in UTF-8, of usual size and depth."""

from __future__ import annotations

import json
from collections import Counter
from math import isfinite

from api.errors import InputError
from api.findings import Finding, Place, Refused, pointer_to

__all__ = ["NotJson", "check_json"]

MOST_DEPTH = 64  # levels: a plan with limits, bands and spectra has 8
_MOST_WHOLE = 2**63 - 1  # an integer of the database and of numpy


class NotJson(InputError):
    """The bytes are not JSON."""


def check_json(body: bytes) -> None:
    """Raises NotJson, or Refused where the JSON has doubled keys, too many levels, or a value that nothing can keep."""
    try:
        text = body.decode("utf-8")
    except UnicodeDecodeError as error:
        raise NotJson(f"body: byte {error.start} is not UTF-8: send JSON in UTF-8") from error
    if text.startswith("\ufeff"):
        raise NotJson("body: begins with a byte order mark: send JSON in UTF-8 without one")
    try:
        value = json.loads(text, object_pairs_hook=_without_doubles)
    except json.JSONDecodeError as error:
        raise NotJson(f"body.{error.pos}: not JSON: {error.msg}") from error
    except RecursionError as error:
        raise NotJson(f"body: not JSON that can be read: more than {MOST_DEPTH} levels") from error
    except _Double as error:
        raise NotJson(f"body: the key {_shown(error.key)} stands twice in one object: give it once") from error
    except ValueError as error:  # a whole number of more than 4300 digits
        raise NotJson("body: not JSON that can be read: a number has too many digits") from error
    found = _faults(value)
    if found:
        raise Refused(found)


class _Double(Exception):
    def __init__(self, key: str) -> None:
        self.key = key


def _without_doubles(pairs: list[tuple[str, object]]) -> dict[str, object]:
    made = dict(pairs)
    if len(made) != len(pairs):
        raise _Double(next(key for key, count in Counter(key for key, _ in pairs).items() if count > 1))
    return made


def _faults(value: object) -> list[Finding]:
    """Every value that no route can use, by a walk without recursion."""
    found: list[Finding] = []
    stack: list[tuple[Place, object]] = [((), value)]
    while stack:
        place, one = stack.pop()
        why = _fault(one)
        if why:
            found.append(_finding(place, why))
        elif isinstance(one, (dict, list)) and len(place) >= MOST_DEPTH:
            return [_finding(place[:4], f"has more than {MOST_DEPTH} levels")]
        elif isinstance(one, dict):
            found += [_finding(place, f"has a key {why}") for key in one if (why := _fault(key))]
            stack.extend(((*place, key), inner) for key, inner in reversed(one.items()))
        elif isinstance(one, list):
            stack.extend(
                ((*place, k), inner) for k, inner in zip(range(len(one) - 1, -1, -1), reversed(one), strict=True)
            )
    return found


def _fault(value: object) -> str:
    if isinstance(value, str) and not value.isascii() and any("\ud800" <= c <= "\udfff" for c in value):
        return f"is {_shown(value)}: half of a surrogate pair is no printable character"
    if isinstance(value, float) and not isfinite(value):
        return f"is {value}: it must be a finite number"
    if isinstance(value, int) and abs(value) > _MOST_WHOLE:
        return f"is {_shown_number(value)}: it must lie within ±{_MOST_WHOLE}"
    return ""


def _finding(place: Place, why: str) -> Finding:
    where = ".".join(ascii(part)[1:-1][:40] if isinstance(part, str) else str(part) for part in place) or "body"
    return Finding(detail=f"{where} {why}", pointer=pointer_to(place))


def _shown(value: str) -> str:
    text = ascii(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _shown_number(value: int) -> str:
    return f"a whole number of {value.bit_length()} bits"
