"""Jobs of every kind: submit one, follow it, cancel it, download the files of its result."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Query, Response
from fastapi.responses import FileResponse

from api.errors import NotFound
from api.jobs.accept import accept
from api.jobs.kinds import AnyRequest, find_kind
from api.routes.answers import MOST_NUMBER, JobAnswer, JobList, job_answer
from api.service import ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])


@router.post("", status_code=201)
def submit(
    body: Annotated[AnyRequest, Body(discriminator="kind")], service: ServiceDep, response: Response
) -> JobAnswer:
    """Accept a job; refuses the same input as the command line, with the same messages."""
    job = accept(body, campaigns=service.campaigns, runs=service.runs, jobs=service.jobs)
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    return job_answer(job)


@router.get("")
def list_jobs(
    service: ServiceDep,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
    before: Annotated[int | None, Query(ge=1, le=MOST_NUMBER)] = None,
    campaign: str = "",
    kind: str = "",
) -> JobList:
    """The newest jobs first."""
    found = service.jobs.newest(limit=limit, before=before, campaign_id=campaign, kind=kind)
    more = found[-1].number if len(found) == limit else None
    return JobList(jobs=[job_answer(job) for job in found], next_before=more)


@router.get("/{job_id}")
def one(job_id: str, service: ServiceDep) -> JobAnswer:
    """Its progress or its result."""
    return job_answer(service.jobs.one(job_id))


@router.post("/{job_id}/cancel", status_code=202)
def cancel(job_id: str, service: ServiceDep) -> JobAnswer:
    """Cancel it."""
    return job_answer(service.jobs.cancel(job_id, "a cancellation was requested over HTTP"))


@router.get("/{job_id}/files/{name}", response_class=FileResponse)
def file(job_id: str, name: str, service: ServiceDep) -> FileResponse:
    """A file of its result, the same as the command line writes."""
    job = service.jobs.one(job_id)
    files = find_kind(job.kind).files
    if name not in files:
        raise NotFound(f"job {job_id} of kind {job.kind} has no file {name!r:.60}: it has {', '.join(files)}")
    return FileResponse(service.results.file(job, name), media_type=files[name])
