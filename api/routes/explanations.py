"""Explanations: ask what a simulation is missing, follow the work, end it, fetch the report."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse

from api.jobs.accept import accepted
from api.jobs.explain import NewExplanation
from api.routes.answers import ExplanationAnswer, ExplanationList, explanation_answer
from api.service import Here

__all__ = ["router"]

router = APIRouter(prefix="/v1/explanations", tags=["explanations"])

_MOST_NUMBER = 2**31 - 1


@router.post("", status_code=201)
def create(body: NewExplanation, here: Here, response: Response) -> ExplanationAnswer:
    """Accept a base model and runs; what the command line would refuse is refused here, in the same words."""
    asked = accepted(here, body)
    response.headers["Location"] = f"/v1/explanations/{asked.id}"
    return explanation_answer(asked)


@router.get("")
def list_explanations(
    here: Here,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
    before: Annotated[int | None, Query(ge=1, le=_MOST_NUMBER)] = None,
    campaign: str = "",
) -> ExplanationList:
    """The newest explanations first."""
    found = here.explanations.newest(limit=limit, before=before, campaign_id=campaign)
    more = found[-1].number if len(found) == limit else None
    return ExplanationList(explanations=[explanation_answer(one) for one in found], next_before=more)


@router.get("/{explanation_id}")
def one(explanation_id: str, here: Here) -> ExplanationAnswer:
    """How far it is, or how it ended."""
    return explanation_answer(here.explanations.one(explanation_id))


@router.post("/{explanation_id}/cancel", status_code=202)
def cancel(explanation_id: str, here: Here) -> ExplanationAnswer:
    """Ask for its end."""
    return explanation_answer(here.explanations.cancel(explanation_id, "a cancellation was asked for over HTTP"))


@router.get("/{explanation_id}/report.json", response_class=FileResponse)
def report(explanation_id: str, here: Here) -> FileResponse:
    """The discovery report, as `damper-rig explain` writes it."""
    return _file(here, explanation_id, "report.json", "application/json")


@router.get("/{explanation_id}/report.html", response_class=FileResponse)
def page(explanation_id: str, here: Here) -> FileResponse:
    """The same for people: one page that opens offline."""
    return _file(here, explanation_id, "report.html", "text/html")


@router.get("/{explanation_id}/model.json", response_class=FileResponse)
def model(explanation_id: str, here: Here) -> FileResponse:
    """The base model with the named effects added and everything fitted again."""
    return _file(here, explanation_id, "model.json", "application/json")


def _file(here: Here, explanation_id: str, name: str, media_type: str) -> FileResponse:
    return FileResponse(here.reports.local(here.explanations.one(explanation_id), name), media_type=media_type)
