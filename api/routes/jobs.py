"""Jobs of every kind: submit one, follow it, cancel it, download the files of its result."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel

from api.errors import NotFound
from api.jobs.accept import prepare
from api.jobs.kinds import AnyRequest, find_kind
from api.routes.answers import JobAnswer, JobList, job_answer
from api.routes.creation import CreationDep
from api.routes.paging import PageDep
from api.service import ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])


@router.post("", status_code=201, response_model=JobAnswer)
def submit(
    body: Annotated[AnyRequest, Body(discriminator="kind")], service: ServiceDep, creation: CreationDep
) -> Response:
    """Accept a job; refuses the same input as the command line, with the same messages."""
    if before := creation.given():
        return before
    job = prepare(body, campaigns=service.campaigns, runs=service.runs, memory_bytes=service.settings.job_memory_bytes)

    def create_job() -> tuple[BaseModel, str]:
        made = service.jobs.create(**job)
        return job_answer(made), f"/v1/jobs/{made.id}"

    return creation.answer(create_job)


@router.get("")
def list_jobs(
    service: ServiceDep,
    page: PageDep,
    campaign: str = "",
    kind: str = "",
) -> JobList:
    """The newest jobs first."""
    found = service.jobs.newest(limit=page.limit, before=page.before, campaign_id=campaign, kind=kind)
    after = page.next([one.number for one in found])
    return JobList(jobs=[job_answer(job) for job in found], next_before=after.before, next_cursor=after.cursor)


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
    files = find_kind(job.kind).files_of(job.request)
    if name not in files:
        raise NotFound(f"job {job_id} of kind {job.kind} has no file {name!r:.60}: it has {', '.join(files)}")
    return FileResponse(service.results.file(job, name), media_type=files[name])
