"""Uploaded run files."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from api.routes.answers import UploadAnswer, upload_answer
from api.service import ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1/runs", tags=["runs"])


@router.post("", status_code=201)
async def upload(request: Request, service: ServiceDep, response: Response, name: str = "run.h5") -> UploadAnswer:
    """Store the run file in the body of the request; its id goes into ``runs`` of a job."""
    kept = await service.runs.receive(name, request.stream())
    response.headers["Location"] = f"/v1/runs/{kept.id}"
    return upload_answer(kept)


@router.get("/{upload_id}")
def one(upload_id: str, service: ServiceDep) -> UploadAnswer:
    """The record of an uploaded run."""
    return upload_answer(service.runs.upload(upload_id))
