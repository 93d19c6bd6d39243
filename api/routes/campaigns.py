"""Campaigns: schedule one, follow it, end it, download its runs."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse
from pydantic import JsonValue

from api.campaigns.loops import loops
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.orders import Asked
from api.campaigns.records import CampaignState
from api.routes.answers import (
    CampaignAnswer,
    CampaignList,
    CampaignSummary,
    RunList,
    answer_run,
    detail,
    summary,
)
from api.service import ServiceDep
from rigctl.runfile import read_run

__all__ = ["router"]

router = APIRouter(prefix="/v1/campaigns", tags=["campaigns"])

_MOST_NUMBER = 2**31 - 1


@router.post("", status_code=201)
def create(body: NewCampaign, service: ServiceDep, response: Response) -> CampaignSummary:
    """Accept a campaign; it is played after the earlier campaigns of its rig."""
    campaign = service.campaigns.create(body)
    response.headers["Location"] = f"/v1/campaigns/{campaign.id}"
    return summary(campaign)


@router.get("")
def list_campaigns(
    service: ServiceDep,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
    before: Annotated[int | None, Query(ge=1, le=_MOST_NUMBER)] = None,
    state: CampaignState | None = None,
) -> CampaignList:
    """The newest campaigns first."""
    found = service.campaigns.campaigns(limit=limit, before=before, state=state)
    more = found[-1].number if len(found) == limit else None
    return CampaignList(campaigns=[summary(campaign) for campaign in found], next_before=more)


@router.get("/{campaign_id}")
def one(campaign_id: str, service: ServiceDep) -> CampaignAnswer:
    """One campaign with its configurations and events."""
    return detail(service.campaigns.campaign(campaign_id), service.campaigns.events(campaign_id))


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


@router.get("/{campaign_id}/runs")
def list_runs(campaign_id: str, service: ServiceDep) -> RunList:
    """Its captured runs, in order."""
    return RunList(runs=[answer_run(run) for run in service.runs.of_campaign(campaign_id)])


@router.get("/{campaign_id}/runs/{run_id}", response_class=FileResponse)
def download(campaign_id: str, run_id: str, service: ServiceDep) -> FileResponse:
    """The run file."""
    record = service.runs.one(campaign_id, run_id)
    path = service.runs.path(record)
    return FileResponse(path, media_type="application/x-hdf5", filename=path.name)


@router.get("/{campaign_id}/runs/{run_id}/loops")
def run_loops(
    campaign_id: str, run_id: str, service: ServiceDep, points: Annotated[int, Query(ge=16, le=20000)] = 2000
) -> dict[str, JsonValue]:
    """Displacement, velocity and force of the run, reduced to at most ``points`` points, for a chart."""
    run = read_run(service.runs.path(service.runs.one(campaign_id, run_id)))
    return loops(run, points)
