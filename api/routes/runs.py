"""Uploaded run files."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect

from api.errors import TooSlow
from api.routes.files import stated_length
from api.routes.run_list import RunRecordAnswer, record_answer
from api.service import ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1/runs", tags=["runs"])


@router.post("", status_code=201)
async def upload(request: Request, service: ServiceDep, response: Response, name: str = "run.h5") -> RunRecordAnswer:
    """Store the run file in the body of the request; its id goes into ``runs`` of a job."""
    await run_in_threadpool(service.runs.check_room)
    try:
        kept = await service.runs.receive(name, request.stream(), length=stated_length(request))
    except ClientDisconnect as error:
        raise TooSlow(f"{name!a:.60}: the connection ended before the file: send it again") from error
    response.headers["Location"] = f"/v1/runs/{kept.id}"
    return record_answer(await run_in_threadpool(service.catalogue.one, kept.id))
