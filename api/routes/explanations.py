"""Explanations, the jobs of kind ``explain``: submit one, follow it, download the report."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse

from api.jobs.accept import accept
from api.jobs.explain import EXPLAIN, ExplainRequest
from api.routes.answers import MOST_NUMBER, ExplanationAnswer, ExplanationList, explanation_answer
from api.service import Service, ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1/explanations", tags=["explanations"])


@router.post("", status_code=201)
def create(body: ExplainRequest, service: ServiceDep, response: Response) -> ExplanationAnswer:
    """Accept a base model and runs; refuses the same input as the command line, with the same messages."""
    job = accept(body, campaigns=service.campaigns, runs=service.runs, jobs=service.jobs)
    response.headers["Location"] = f"/v1/explanations/{job.id}"
    return explanation_answer(job)


@router.get("")
def list_explanations(
    service: ServiceDep,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
    before: Annotated[int | None, Query(ge=1, le=MOST_NUMBER)] = None,
    campaign: str = "",
) -> ExplanationList:
    """The newest explanations first."""
    found = service.explanations.newest(limit=limit, before=before, campaign_id=campaign)
    more = found[-1].number if len(found) == limit else None
    return ExplanationList(explanations=[explanation_answer(job) for job in found], next_before=more)


@router.get("/{explanation_id}")
def one(explanation_id: str, service: ServiceDep) -> ExplanationAnswer:
    """Its progress or its result."""
    return explanation_answer(service.explanations.one(explanation_id))


@router.post("/{explanation_id}/cancel", status_code=202)
def cancel(explanation_id: str, service: ServiceDep) -> ExplanationAnswer:
    """Cancel it."""
    return explanation_answer(service.explanations.cancel(explanation_id, "a cancellation was requested over HTTP"))


@router.get("/{explanation_id}/report.json", response_class=FileResponse)
def report(explanation_id: str, service: ServiceDep) -> FileResponse:
    """The discovery report, as `damper-rig explain` writes it."""
    return _file(service, explanation_id, "report.json")


@router.get("/{explanation_id}/report.html", response_class=FileResponse)
def page(explanation_id: str, service: ServiceDep) -> FileResponse:
    """The report as one page that opens offline."""
    return _file(service, explanation_id, "report.html")


@router.get("/{explanation_id}/model.json", response_class=FileResponse)
def model(explanation_id: str, service: ServiceDep) -> FileResponse:
    """The base model with the named effects added and everything fitted again."""
    return _file(service, explanation_id, "model.json")


@router.get("/{explanation_id}/evidence.h5", response_class=FileResponse)
def evidence(explanation_id: str, service: ServiceDep) -> FileResponse:
    """The curves, maps and traces of the report: `damper-rig report` draws the page from it and report.json."""
    return _file(service, explanation_id, "evidence.h5")


def _file(service: Service, explanation_id: str, name: str) -> FileResponse:
    path = service.results.file(service.explanations.one(explanation_id), name, noun="explanation")
    return FileResponse(path, media_type=EXPLAIN.files[name])
