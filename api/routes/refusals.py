"""From an error to an answer of one line: by the table in ``api.errors``, or from pydantic's finding."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from api.campaigns.new_campaign import NewCampaign
from api.errors import OUTCOMES, one_line, outcome_of
from api.jobs.explain import EXPLAIN
from api.jobs.kinds import KINDS

__all__ = ["answer_errors", "refusal"]

LOG = logging.getLogger("damper_rig.service")


def answer_errors(app: FastAPI) -> None:
    """Let the app answer every error in one line, except faults of this program."""
    for kind in {kind for kind, _ in OUTCOMES}:
        app.add_exception_handler(kind, _ours)
    app.add_exception_handler(RequestValidationError, _refused)
    app.add_exception_handler(HTTPException, _http)


async def _ours(request: Request, error: Exception) -> JSONResponse:
    outcome = outcome_of(error)
    assert outcome is not None  # only errors of the table come here
    if outcome.http_status >= 500:
        LOG.error("%s %s: %s", request.method, request.url.path, one_line(error))
    return JSONResponse({"detail": one_line(error)}, status_code=outcome.http_status)


async def _http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    detail = " ".join(str(error.detail).split())
    if error.status_code in (404, 405):
        detail = f"{request.method} {ascii(request.url.path)[1:-1]:.80}: {detail}; /docs lists the routes"
    return JSONResponse({"detail": detail}, status_code=error.status_code, headers=error.headers)


async def _refused(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    status = 400 if first["type"] == "json_invalid" else 422
    return JSONResponse(
        {"detail": refusal(first, len(error.errors()), _keys(request.url.path, first["loc"]))}, status_code=status
    )


def _keys(path: str, loc: Sequence[int | str]) -> str:
    """The keys of the body; where a body states its kind, pydantic puts the kind into the location."""
    kind = next((KINDS[str(part)] for part in loc if part in KINDS), EXPLAIN)
    body = NewCampaign if path.startswith("/v1/campaigns") else kind.request
    return ", ".join(key.name for key in fields(body))


def refusal(error: dict[str, Any], count: int, known: str) -> str:
    """One line for a finding of pydantic: where, the value, what would be right. Any: pydantic's own dictionary."""
    where = _place(error["loc"])
    more = f" ({count - 1} more)" if count > 1 else ""
    if error["type"] == "json_invalid":
        return f"{where}: not JSON: {error.get('ctx', {}).get('error', error['msg'])}"
    if error["type"] == "union_tag_invalid":
        return f"{where}.kind is {_shown(error['ctx']['tag'])}: it must be one of {', '.join(KINDS)}"
    if error["type"] == "union_tag_not_found":
        return f"{where}.kind is missing: add one of {', '.join(KINDS)}"
    if error["type"] == "missing":
        return f"{where} is missing: add it{more}"
    if error["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
        return f"{where} is not a known key: known are {known}{more}"
    if error["type"] == "value_error":  # one of ours: its message is complete
        return one_line(error["ctx"]["error"])
    return f"{where} is {_shown(error['input'])}: {error['msg'].replace('Input should', 'it must', 1)}{more}"


def _place(loc: Sequence[int | str]) -> str:
    parts = [ascii(part)[1:-1][:40] if isinstance(part, str) else str(part) for part in loc]
    return ".".join(parts) or "body"


def _shown(value: object) -> str:
    text = ascii(value)
    return text if len(text) <= 60 else text[:57] + "..."
