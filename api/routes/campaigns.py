"""Campaigns: schedule one, follow it, end it, download its runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from fastapi import APIRouter, Query, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse
from pydantic import JsonValue

from api.campaigns.envelopes import check_campaign
from api.campaigns.estimate import estimate
from api.campaigns.loops import loops
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.orders import Asked
from api.campaigns.records import Campaign, CampaignState
from api.campaigns.rigs import check_allowed
from api.routes.answers import (
    CampaignAnswer,
    CampaignList,
    CampaignSummary,
    CheckAnswer,
    Confirmation,
    RunList,
    answer_run,
    check_answer,
    detail,
    summary,
)
from api.routes.creation import CreationDep, created, json_answer
from api.routes.files import run_file
from api.routes.paging import PageDep
from api.routes.person import PersonDep
from api.routes.queue_answers import Move, Precondition, QueueAnswer, place_in, queue_answer, read_version
from api.service import Service, ServiceDep
from excitation import TestPlan
from rigctl.canonical import canonical_address
from rigctl.runfile import read_run

__all__ = ["accepted", "checked", "router"]

router = APIRouter(prefix="/v1/campaigns", tags=["campaigns"])


@router.post(
    "",
    status_code=201,
    response_model=CampaignSummary,
    responses={200: {"model": CheckAnswer, "description": "Of a dry run."}},
)
async def create(
    body: NewCampaign,
    creation: CreationDep,
    dry_run: Annotated[bool, Query(description="Only check it and say what it takes; nothing is stored.")] = False,
) -> Response:
    """Accept a campaign; it is played after the earlier campaigns of its rig."""
    service = creation.service
    if dry_run:
        return json_answer(await run_in_threadpool(check, body, service))
    if body.design or body.plays_samples or service.envelopes:  # the store is read, or every test is predicted
        body, plan = await run_in_threadpool(checked, body, service)
    else:
        body, plan = checked(body, service)
    return await creation.accept(body, plan, lambda campaign: created(*accepted(campaign)))


@router.post("/check")
def check(body: NewCampaign, service: ServiceDep) -> CheckAnswer:
    """What a campaign would take and ask of the rig: a dry run, nothing is stored."""
    body, plan = checked(body, service)
    service.runs.check_room()
    return check_answer(estimate(plan, (*body.own_envelopes, *service.envelopes)))


@router.get("")
def list_campaigns(service: ServiceDep, page: PageDep, state: CampaignState | None = None) -> CampaignList:
    """The newest campaigns first."""
    found = service.campaigns.campaigns(limit=page.limit, before=page.before, state=state)
    after = page.next([one.number for one in found])
    return CampaignList(
        campaigns=[summary(campaign) for campaign in found], next_before=after.before, next_cursor=after.cursor
    )


@router.get("/{campaign_id}")
def one(campaign_id: str, service: ServiceDep) -> CampaignAnswer:
    """One campaign with its configurations and events."""
    return detail(service.campaigns.campaign(campaign_id), service.campaigns.events(campaign_id))


@router.delete("/{campaign_id}", status_code=204)
def delete(campaign_id: str, service: ServiceDep) -> None:
    """Delete a campaign that waits; one that runs is aborted, one that has ended stays."""
    service.campaigns.delete(campaign_id)


@router.post("/{campaign_id}/retry", status_code=201, response_model=CampaignSummary)
def retry(campaign_id: str, service: ServiceDep, creation: CreationDep, person: PersonDep) -> Response:
    """Accept a new campaign that repeats one that has ended."""
    service.runs.check_room()
    return creation.answer(lambda: accepted(service.campaigns.retry(campaign_id, created_by=person)))


@router.post("/{campaign_id}/move")
def move(
    campaign_id: str, body: Move, service: ServiceDep, response: Response, person: PersonDep, if_match: Precondition
) -> QueueAnswer:
    """Put a waiting campaign at another place of its queue, as it was read (If-Match: the ETag of the queue)."""
    rig = service.campaigns.campaign(campaign_id).rig_id
    to = place_in(service.rigs.queue(rig), campaign_id, body)
    queue = service.rigs.move(rig, campaign_id, to=to, version=read_version(if_match), who=person)
    response.headers["ETag"] = f'"{queue.version}"'
    return queue_answer(queue)


@router.post("/{campaign_id}/abort", status_code=202)
def abort(campaign_id: str, service: ServiceDep) -> CampaignSummary:
    """Abort it: at once where it waits; where it runs, the rig comes to rest within its limits and powers off."""
    return summary(service.campaigns.abort(campaign_id, "an abort was requested over HTTP"))


@router.post("/{campaign_id}/stop", status_code=202)
def stop(campaign_id: str, service: ServiceDep) -> CampaignSummary:
    """Stop it: the rig comes to rest, travels back to mid-stroke without current, and powers off."""
    return summary(service.campaigns.ask(campaign_id, Asked.STOP, "a stop was requested over HTTP"))


@router.post("/{campaign_id}/hold", status_code=202)
def hold(campaign_id: str, service: ServiceDep) -> CampaignSummary:
    """Hold it: the rig comes to rest under power; between two tests it stays switched off."""
    return summary(service.campaigns.ask(campaign_id, Asked.HOLD, "over HTTP"))


@router.post("/{campaign_id}/resume", status_code=202)
def resume(campaign_id: str, service: ServiceDep) -> CampaignSummary:
    """Resume it with the first sample that is not recorded yet."""
    return summary(service.campaigns.ask(campaign_id, Asked.NOTHING, "over HTTP"))


@router.post("/{campaign_id}/confirm", status_code=202)
def confirm(campaign_id: str, body: Confirmation, service: ServiceDep) -> CampaignSummary:
    """Answer what it asks its operator: yes or no, or a number."""
    return summary(service.campaigns.answer(campaign_id, body.answer, body.question))


@router.get("/{campaign_id}/runs")
def list_runs(campaign_id: str, service: ServiceDep) -> RunList:
    """Its captured runs, in order."""
    return RunList(runs=[answer_run(run) for run in service.runs.of_campaign(campaign_id)])


@router.get("/{campaign_id}/runs/{run_id}", response_class=FileResponse)
def download(campaign_id: str, run_id: str, service: ServiceDep) -> FileResponse:
    """The run file."""
    record = service.runs.one(campaign_id, run_id)
    path = service.runs.path(record)
    return run_file(path, record.sha256)


@router.get("/{campaign_id}/runs/{run_id}/loops")
def run_loops(
    campaign_id: str, run_id: str, service: ServiceDep, points: Annotated[int, Query(ge=16, le=20000)] = 2000
) -> dict[str, JsonValue]:
    """Displacement, velocity and force of the run, reduced to at most ``points`` points, for a chart."""
    run = read_run(service.runs.path(service.runs.one(campaign_id, run_id)))
    return loops(run, points)


def accepted(campaign: Campaign) -> tuple[CampaignSummary, str]:
    """The answer for a campaign that was accepted, and its address."""
    return summary(campaign), f"/v1/campaigns/{campaign.id}"


def checked(body: NewCampaign, service: Service) -> tuple[NewCampaign, TestPlan]:
    """The campaign with the tests of its design, for a rig that is allowed, and its plan, within the envelopes.

    Raises NotFound, InputError or Refused.
    """
    if "://" in body.rig:
        check_allowed(canonical_address(body.rig), service.settings.rig_patterns)
    if body.design:
        design = service.designs.one(body.design)
        warm_up = None if design.warm_up is None else dict(design.warm_up)
        body = replace(body, design="", tests=[dict(test) for test in design.tests], warm_up=warm_up)
    plan = body.planned(service.runs.samples.excitations())
    check_campaign(plan, service.envelopes)
    return body, plan
