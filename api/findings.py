"""Everything that is wrong with a request, each with its place in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal, get_args

from api.errors import OUTCOMES, InputError, one_line
from excitation.errors import DesignError

__all__ = ["MOST_FINDINGS", "SOURCES", "Finding", "Findings", "Refused", "pointer_to"]

MOST_FINDINGS = 100  # in one answer: a plan has at most 500 tests, and nobody reads on
_LONGEST_PART = 60

EXPECTED = tuple(kind for kind, outcome in OUTCOMES if outcome.http_status == 422)  # what bad input raises

Place = tuple[str | int, ...]
Source = Literal["body", "query", "path", "header", "cookie"]
SOURCES: tuple[Source, ...] = get_args(Source)


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One error: part of the request, JSON pointer into it, and one line."""

    detail: str
    pointer: str = ""
    source: Source = "body"


class Refused(InputError):
    """Several things are wrong; the message is the first of them and how many there are."""

    def __init__(self, findings: Sequence[Finding]) -> None:
        more = len(findings) - 1
        super().__init__(findings[0].detail + (f" ({more} more)" if more else ""))
        self.findings = tuple(findings)


class Findings:
    """Collects what is wrong, so that all of it is said at once."""

    def __init__(self) -> None:
        self.found: list[Finding] = []

    def add(self, place: Place, error: Exception) -> None:
        """Note an error at a place in the body; a DesignError may stand for several."""
        inner = error.findings if isinstance(error, DesignError) else ()
        if inner:
            self.found += [Finding(detail=text, pointer=pointer_to((*place, *below))) for below, text in inner]
        else:
            self.found.append(Finding(detail=one_line(error), pointer=pointer_to(place)))

    @contextmanager
    def at(self, *place: str | int) -> Iterator[None]:
        """Note an error of the block at a place in the body, and go on after the block."""
        try:
            yield
        except EXPECTED as error:
            self.add(place, error)

    def refuse(self) -> None:
        """Raise Refused where anything was noted."""
        if self.found:
            raise Refused(self.found)


def pointer_to(place: Place) -> str:
    """The JSON pointer of a place (RFC 6901), in ASCII.

    >>> pointer_to(("tests", 0, "a/b"))
    '/tests/0/a~1b'
    """
    return "".join(f"/{_part(part)}" for part in place)


def _part(part: str | int) -> str:
    return (
        ascii(part)[1:-1][:_LONGEST_PART].replace("~", "~0").replace("/", "~1") if isinstance(part, str) else str(part)
    )
