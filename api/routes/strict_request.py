"""What no request may have: a query parameter that its route does not know, or a body of another kind."""

from __future__ import annotations

from collections.abc import Iterator
from difflib import get_close_matches

from fastapi import Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute
from starlette.exceptions import HTTPException

from api.findings import Finding, Refused, pointer_to

__all__ = ["is_json", "refuse_what_is_not_read"]


async def refuse_what_is_not_read(request: Request) -> None:
    """Raises Refused for query parameters that the route does not read, HTTPException 415 for a body that is no JSON.

    A parameter that is dropped in silence can move a rig: ``?dry_run=true`` once played the campaign.
    """
    route = request.scope.get("route")
    if not isinstance(route, APIRoute):
        return
    known = tuple(_names(route.dependant))
    found = [_unknown(name, known) for name in dict.fromkeys(request.query_params) if name not in known]
    found += [
        Finding(detail=f"{name} is given more than once: give it once", pointer=pointer_to((name,)), source="query")
        for name in known
        if len(request.query_params.getlist(name)) > 1
    ]
    if found:
        raise Refused(found)
    if (
        route.body_field is not None
        and not is_json(given := request.headers.get("content-type", ""))
        and await request.body()
    ):
        raise HTTPException(
            415, f"content-type is {given!a:.60}: send application/json", {"Accept": "application/json"}
        )


def _names(dependant: Dependant) -> Iterator[str]:
    yield from (one.alias for one in dependant.query_params)
    for inner in dependant.dependencies:
        yield from _names(inner)


def _unknown(name: str, known: tuple[str, ...]) -> Finding:
    shown = ascii(name)[1:-1][:60]
    near = get_close_matches(name[:60], known, 1)
    right = f"did you mean {near[0]}" if near else f"known are {', '.join(known)}" if known else "this route has none"
    return Finding(
        detail=f"{shown} is not a known query parameter: {right}", pointer=pointer_to((name,)), source="query"
    )


def is_json(content_type: str) -> bool:
    """Whether a content-type is one of JSON."""
    kind = content_type.partition(";")[0].strip().lower()
    return kind == "application/json" or (kind.startswith("application/") and kind.endswith("+json"))
