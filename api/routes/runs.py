"""Run files from elsewhere: sent whole, as they are."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool

from api.routes.answers import UploadAnswer, upload_answer
from api.service import Here
from api.store.uploads import received

__all__ = ["router"]

router = APIRouter(prefix="/v1/runs", tags=["runs"])


@router.post("", status_code=201)
async def upload(request: Request, here: Here, response: Response, name: str = "run.h5") -> UploadAnswer:
    """Keep the run file that is the body of the request; its id goes into ``runs`` of an explanation."""
    kept = await received(here.files, name, request.stream())
    await run_in_threadpool(here.explanations.keep_upload, kept)
    response.headers["Location"] = f"/v1/runs/{kept.id}"
    return upload_answer(kept)


@router.get("/{upload_id}")
def one(upload_id: str, here: Here) -> UploadAnswer:
    """What is known of an uploaded run."""
    return upload_answer(here.explanations.upload(upload_id))
