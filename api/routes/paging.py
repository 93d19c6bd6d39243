"""Pages of lists, the newest entries first: a cursor stands for the entries after one, whatever is added meanwhile."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated
from urllib.parse import urlencode

from fastapi import Depends, Query, Request, Response

from api.findings import Finding, Refused

__all__ = ["MOST_NUMBER", "CursorDep", "PageDep", "cursor_of", "link_pages", "read_cursor"]

MOST_NUMBER = 2**31 - 1  # of an entry: an integer of PostgreSQL
_LONGEST_CURSOR = 400

Key = tuple[float | int | str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class NextPage:
    """Where the next page begins; None: there is none."""

    before: int | None
    cursor: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """At most ``limit`` entries, of lower numbers than ``before``."""

    limit: int
    before: int | None
    request: Request = field(repr=False)
    response: Response = field(repr=False)

    def next(self, numbers: Sequence[int]) -> NextPage:
        """The page after this one, whose entries have these numbers; after a full page there may be another.

        The answer gets its Link header.
        """
        last = numbers[-1] if len(numbers) == self.limit else None
        cursor = None if last is None else cursor_of(last)
        link_pages(self.request, self.response, cursor)
        return NextPage(before=last, cursor=cursor)


Limit = Annotated[int, Query(ge=1, le=200, description="Most entries of a page.")]
CursorDep = Annotated[
    str,
    Query(
        max_length=_LONGEST_CURSOR,
        description="`next_cursor` of the page before, or from its Link header.",
    ),
]


async def _page(
    request: Request,
    response: Response,
    limit: Limit = 50,
    cursor: CursorDep = "",
    before: Annotated[
        int | None, Query(ge=1, le=MOST_NUMBER, description="Entries before this number; or give a cursor.")
    ] = None,
) -> Page:
    if cursor and before is not None:
        raise _wrong("cursor and before are given: give one of them")
    if cursor:
        match read_cursor(cursor):
            case (int() as number,) if 1 <= number <= MOST_NUMBER:
                before = number
            case _:
                raise _wrong()
    return Page(limit=limit, before=before, request=request, response=response)


PageDep = Annotated[Page, Depends(_page)]


def cursor_of(*key: float | int | str) -> str:
    """The cursor of the entries after the one with this key."""
    return base64.urlsafe_b64encode(json.dumps(key).encode()).decode().rstrip("=")


def read_cursor(cursor: str) -> Key:
    """The key in a cursor; raises Refused where the service did not make it."""
    try:
        text = base64.b64decode(cursor.encode("ascii") + b"=" * (-len(cursor) % 4), altchars=b"-_", validate=True)
        key = json.loads(text)
    except (ValueError, RecursionError, binascii.Error) as error:
        raise _wrong() from error
    if not isinstance(key, list) or not all(type(part) in (int, float, str) for part in key):
        raise _wrong()
    return tuple(key)


def link_pages(request: Request, response: Response, cursor: str | None) -> None:
    """State the first page and, by ``cursor``, the next one in a Link header (RFC 8288)."""
    kept = [(name, value) for name, value in request.query_params.items() if name not in ("cursor", "before")]
    links = [(kept, "first")]
    if cursor is not None:
        links.append(([*kept, ("cursor", cursor)], "next"))
    response.headers["Link"] = ", ".join(
        f'<{request.url.path}{f"?{urlencode(query)}" if query else ""}>; rel="{name}"' for query, name in links
    )


def _wrong(why: str = "cursor is none that this service has given: take next_cursor of a page") -> Refused:
    return Refused([Finding(detail=why, pointer="/cursor", source="query")])
