"""Problem answers as RFC 9457 describes them: every refusal of the service has this form."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from http import HTTPStatus
from typing import Any, Literal
from urllib.parse import quote

from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import Response
from starlette.types import Scope, Send

from api.findings import MOST_FINDINGS, Finding

__all__ = ["MEDIA_TYPE", "RETRY_AFTER_S", "Problem", "kinds", "problem", "problem_answers", "send_problem"]

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_S = 5  # a database or a worker that is gone needs about this long to come back
_KINDS: Mapping[int, tuple[str, str]] = {
    400: ("not-json", "The body is not JSON"),
    401: ("no-access", "Sign in first"),
    403: ("forbidden", "This is not allowed"),
    404: ("not-found", "There is nothing at this address"),
    405: ("method", "This address does not have this method"),
    408: ("too-slow", "The body did not come in time"),
    409: ("conflict", "Its state does not allow this"),
    410: ("gone", "It was removed"),
    412: ("changed", "It has changed since it was read"),
    413: ("too-large", "The body is too large"),
    415: ("media-type", "The service does not read this kind of content"),
    416: ("range", "The file does not have this range"),
    421: ("host", "The service does not answer to this name"),
    422: ("invalid-input", "The input cannot be used"),
    428: ("precondition", "A precondition is missing"),
    429: ("too-many", "Too many requests"),
    500: ("fault", "A fault of the service"),
    503: ("unavailable", "The service cannot do this now"),
    502: ("rig", "The rig could not do this"),
    504: ("rig-silent", "The rig did not acknowledge"),
    507: ("full", "There is no room for it"),
}
_LONGEST_INSTANCE = 200
_LONGEST_DETAIL = 390


class ErrorAnswer(BaseModel):
    """One error: where it stands, and what would be right."""

    model_config = ConfigDict(frozen=True)

    source: Literal["body", "query", "path", "header", "cookie"] = Field(description="Part of the request.")
    pointer: str = Field(description="JSON pointer (RFC 6901) into that part.", examples=["/tests/0/frequency"])
    detail: str = Field(description="One line: what, where, the value, what would be right.")


class Problem(BaseModel):
    """Why a request was refused (RFC 9457)."""

    model_config = ConfigDict(frozen=True)

    type: str = Field(description="The kind of problem, an address on this service.", examples=["/docs#not-found"])
    title: str = Field(description="The kind of problem in words.")
    status: int = Field(description="The HTTP status.")
    detail: str = Field(description="One line: what, where, the value, what would be right.")
    instance: str = Field(description="The address that was asked for.")
    errors: list[ErrorAnswer] = Field(description="Every error that was found, with its place.")


def problem(
    status: int,
    detail: str,
    scope: Scope,
    *,
    errors: Iterable[Finding] = (),
    headers: Mapping[str, str] | None = None,
) -> Response:
    """The answer that refuses the request in ``scope``; 503 says when to try again."""
    kept = dict(headers or {})
    kept.pop("content-length", None)
    if status == 503:
        kept.setdefault("Retry-After", str(RETRY_AFTER_S))
    return Response(_content(status, detail, scope, errors), status_code=status, media_type=MEDIA_TYPE, headers=kept)


async def send_problem(
    scope: Scope, send: Send, status: int, detail: str, *, headers: Mapping[str, str] | None = None
) -> None:
    """Refuse the request in ``scope`` without reading its body."""

    async def no_body() -> Any:  # Any: a message of ASGI
        return {"type": "http.disconnect"}

    await problem(status, detail, scope, headers=headers)(scope, no_body, send)


def problem_answers(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """How OpenAPI describes these refusals. Any: FastAPI's own dictionary."""
    schema = {"$ref": "#/components/schemas/Problem"}
    return {
        status: {"description": _KINDS[status][1], "content": {MEDIA_TYPE: {"schema": schema}}} for status in statuses
    }


def kinds() -> Mapping[int, tuple[str, str]]:
    """The kinds of problems by their HTTP status: name and title."""
    return _KINDS


def _content(status: int, detail: str, scope: Scope, errors: Iterable[Finding]) -> bytes:
    name, title = _KINDS.get(status, ("", ""))
    body = {
        "type": f"/docs#{name}" if name else "about:blank",
        "title": title or HTTPStatus(status).phrase,
        "status": status,
        "detail": detail if len(detail) <= _LONGEST_DETAIL else f"{detail[: _LONGEST_DETAIL - 1]}…",
        "instance": quote(scope.get("path", ""), safe="/:@!$&'()*+,;=~-._")[:_LONGEST_INSTANCE],
        "errors": [
            {"source": one.source, "pointer": one.pointer, "detail": one.detail} for one in list(errors)[:MOST_FINDINGS]
        ],
    }
    return json.dumps(body).encode()
