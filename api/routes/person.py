"""Who makes a request: what access control has found out, for events and reservations."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request

__all__ = ["PersonDep", "person"]


def person(request: Request) -> str:
    """The name that access control has put into the state of the request as ``person``; empty without it."""
    return str(request.scope.get("state", {}).get("person", ""))


async def _person(request: Request) -> str:  # not in a thread of the pool: it waits for nothing
    return person(request)


PersonDep = Annotated[str, Depends(_person)]
