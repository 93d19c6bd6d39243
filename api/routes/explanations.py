"""Explanations, the jobs of kind ``explain``: submit one, follow it, download the report."""

from __future__ import annotations

import json

from fastapi import APIRouter, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field

from api.campaigns.new_campaign import NewCampaign
from api.errors import Conflict
from api.jobs.accept import prepare
from api.jobs.explain import EXPLAIN, ExplainRequest
from api.routes.answers import CampaignSummary, ExplanationAnswer, ExplanationList, explanation_answer
from api.routes.campaigns import accepted, checked
from api.routes.creation import CreationDep
from api.routes.paging import PageDep
from api.routes.person import PersonDep
from api.service import Service, ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1/explanations", tags=["explanations"])


class NextCampaign(BaseModel):
    """Where the next test is played, and with which specimen."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    rig: str = Field(description="Address, id, serial number or name.", examples=["modbus://127.0.0.1:5020"])
    specimen: str = Field(examples=["damper 7"])
    name: str = ""
    operator: str = ""


@router.post("", status_code=201, response_model=ExplanationAnswer)
def create(body: ExplainRequest, service: ServiceDep, creation: CreationDep) -> Response:
    """Accept a base model and runs; refuses the same input as the command line, with the same messages."""
    if before := creation.given():
        return before
    job = prepare(body, campaigns=service.campaigns, runs=service.runs, memory_bytes=service.settings.job_memory_bytes)

    def create_job() -> tuple[BaseModel, str]:
        made = service.jobs.create(**job)
        return explanation_answer(made), f"/v1/explanations/{made.id}"

    return creation.answer(create_job)


@router.get("")
def list_explanations(
    service: ServiceDep,
    page: PageDep,
    campaign: str = "",
) -> ExplanationList:
    """The newest explanations first."""
    found = service.explanations.newest(limit=page.limit, before=page.before, campaign_id=campaign)
    after = page.next([one.number for one in found])
    return ExplanationList(
        explanations=[explanation_answer(job) for job in found], next_before=after.before, next_cursor=after.cursor
    )


@router.get("/{explanation_id}")
def one(explanation_id: str, service: ServiceDep) -> ExplanationAnswer:
    """Its progress or its result."""
    return explanation_answer(service.explanations.one(explanation_id))


@router.post("/{explanation_id}/cancel", status_code=202)
def cancel(explanation_id: str, service: ServiceDep) -> ExplanationAnswer:
    """Cancel it."""
    return explanation_answer(service.explanations.cancel(explanation_id, "a cancellation was requested over HTTP"))


@router.post("/{explanation_id}/campaign", status_code=201, response_model=CampaignSummary)
def next_campaign(
    explanation_id: str, body: NextCampaign, service: ServiceDep, creation: CreationDep, person: PersonDep
) -> Response:
    """Accept a campaign of the next test that the explanation proposes; refused where it proposes none."""
    explanation = service.explanations.one(explanation_id)
    report = json.loads(service.results.file(explanation, "report.json", noun="explanation").read_text("utf-8"))
    design = report["next_test"]["design"]
    if not design:
        raise Conflict(
            f"explanation {explanation_id} proposes no test: {report['next_test']['text'] or 'none is worth it'}"
        )
    new, plan = checked(
        NewCampaign(
            name=body.name or f"next test after {explanation_id[:8]}",
            rig=body.rig,
            specimen=body.specimen,
            operator=body.operator,
            tests=[design],
        ),
        service,
    )
    service.runs.check_room()
    return creation.answer(lambda: accepted(service.campaigns.create(new, plan=plan, created_by=person)))


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
