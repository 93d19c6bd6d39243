"""From an error to a problem answer: by the table in ``api.errors``, or from pydantic's findings."""

from __future__ import annotations

import logging
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response
from fastapi.routing import iter_route_contexts
from starlette.exceptions import HTTPException
from starlette.routing import compile_path

from api.campaigns.new_campaign import NewCampaign
from api.errors import OUTCOMES, TOO_FEW_FILES, TOO_MANY_OPEN, Busy, DiskFull, one_line, outcome_of
from api.findings import SOURCES, Finding, Refused, pointer_to
from api.jobs.explain import EXPLAIN
from api.jobs.kinds import KINDS
from api.problems import problem
from api.settings import Settings

__all__ = ["answer_errors", "refusal"]

LOG = logging.getLogger("damper_rig.service")
_METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")
_NOT_SAID = {  # of the service itself: the log has the whole of it
    500: "the service could not do this: its log says why",
    502: "the rig could not do this: the log of the service says why",
    503: "the campaign store or a worker does not answer: try again",
    504: "the rig does not answer: the log of the service says more",
}


def answer_errors(app: FastAPI, settings: Settings) -> None:
    """Let the app answer every error with a problem, also faults of this program."""
    app.state.hidden_folders = _folders(settings)
    for kind in {kind for kind, _ in OUTCOMES}:
        app.add_exception_handler(kind, _ours)
    app.add_exception_handler(RequestValidationError, _refused)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _fault)


async def _ours(request: Request, error: Exception) -> Response:
    outcome = outcome_of(error)
    assert outcome is not None  # only errors of the table come here
    if isinstance(error, DiskFull | Busy):  # their messages are made for clients
        LOG.warning("%s %s: %s", request.method, request.url.path, one_line(error))
        headers = {"Retry-After": str(error.retry_after_s)} if isinstance(error, Busy) else {}
        return problem(outcome.http_status, one_line(error), request.scope, headers=headers)
    if isinstance(error, OSError) and error.errno in TOO_FEW_FILES:
        LOG.error("%s %s: %s", request.method, request.url.path, one_line(error))
        return problem(503, TOO_MANY_OPEN, request.scope)
    if outcome.http_status >= 500:
        LOG.error("%s %s: %s", request.method, request.url.path, one_line(error))
        return problem(outcome.http_status, _NOT_SAID[outcome.http_status], request.scope)
    found = error.findings if isinstance(error, Refused) else ()
    return problem(outcome.http_status, _without_folders(request, one_line(error)), request.scope, errors=found)


async def _fault(request: Request, error: Exception) -> Response:
    # the server logs the error with its stack and closes the connection: a client must not send the next request there
    return problem(500, _NOT_SAID[500], request.scope, headers={"Connection": "close"})


async def _http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    detail, headers = " ".join(str(error.detail).split()), dict(error.headers or {})
    if error.status_code in (404, 405):
        detail = f"{request.method} {ascii(request.url.path)[1:-1]:.80}: {detail}; /docs lists the routes"
    if error.status_code == 405:
        headers["Allow"] = ", ".join(_allowed(request))
    return problem(error.status_code, detail, request.scope, headers=headers)


def _allowed(request: Request) -> list[str]:
    """The methods of every route at this address; Starlette names those of the first one."""
    routes = [route for route in iter_route_contexts(request.app.routes) if route.path]
    path = next((one.path for one in routes if compile_path(str(one.path))[0].match(request.scope["path"])), None)
    methods = {method for one in routes if one.path == path for method in one.methods or ()}
    return [method for method in _METHODS if method in methods]


async def _refused(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    found = [one for given in error.errors() for one in _findings(request.url.path, given)]
    status = 400 if error.errors()[0]["type"] == "json_invalid" else 422
    more = f" ({len(found) - 1} more)" if len(found) > 1 else ""
    return problem(status, _without_folders(request, found[0].detail + more), request.scope, errors=found)


def _findings(path: str, error: dict[str, Any]) -> Sequence[Finding]:
    """What pydantic found in one place. Any: pydantic's own dictionary."""
    ours = error.get("ctx", {}).get("error")
    if isinstance(ours, Refused):
        return ours.findings
    source, *place = error["loc"] or ("body",)
    if place and place[0] in KINDS and "discriminator" not in error["type"]:
        place = place[1:]  # where a body states its kind, pydantic puts the kind into the location
    detail = refusal(error, _keys(path, error["loc"]))
    return [
        Finding(
            detail=detail,
            pointer="" if error["type"] == "json_invalid" else pointer_to(tuple(place)),
            source=next((one for one in SOURCES if one == source), "body"),
        )
    ]


def _keys(path: str, loc: Sequence[int | str]) -> str:
    """The keys of the body; where a body states its kind, pydantic puts the kind into the location."""
    kind = next((KINDS[str(part)] for part in loc if part in KINDS), EXPLAIN)
    body = NewCampaign if path.startswith("/v1/campaigns") else kind.request
    return ", ".join(key.name for key in fields(body))


def refusal(error: dict[str, Any], known: str) -> str:
    """One line for a finding of pydantic: where, the value, what would be right. Any: pydantic's own dictionary."""
    where = _place(error["loc"])
    if error["type"] == "json_invalid":
        return f"{where}: not JSON: {error.get('ctx', {}).get('error', error['msg'])}"
    if error["type"] == "union_tag_invalid":
        return f"{where}.kind is {_shown(error['ctx']['tag'])}: it must be one of {', '.join(KINDS)}"
    if error["type"] == "union_tag_not_found":
        return f"{where}.kind is missing: add one of {', '.join(KINDS)}"
    if error["type"] == "missing":
        return f"{where} is missing: add it"
    if error["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
        return f"{where} is not a known key: known are {known}"
    if error["type"] == "value_error":  # one of ours: its message is complete
        return one_line(error["ctx"]["error"])
    return f"{where} is {_shown(error['input'])}: {error['msg'].replace('Input should', 'it must', 1)}"


def _place(loc: Sequence[int | str]) -> str:
    parts = [ascii(part)[1:-1][:40] if isinstance(part, str) else str(part) for part in loc]
    return ".".join(parts) or "body"


def _shown(value: object) -> str:
    text = ascii(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _folders(settings: Settings) -> tuple[str, ...]:
    """Folders of this computer that no answer names, the deepest first."""
    places = [settings.data_dir, Path.cwd(), Path(__file__).parents[2], Path(sys.prefix), Path.home()]
    places.append(Path(tempfile.gettempdir()))
    found = {str(place.absolute()) for place in places} | {str(place.resolve()) for place in places}
    return tuple(sorted((one for one in found if len(one) > 1), key=len, reverse=True))


def _without_folders(request: Request, line: str) -> str:
    """The line with the names of files, but without where they are."""
    for folder in request.app.state.hidden_folders:
        line = line.replace(f"{folder}/", "").replace(folder, "the data of the service")
    return line
