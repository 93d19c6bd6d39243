"""Campaigns: ask for one, follow it, end it, fetch what it captured."""

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
from api.service import Here
from rigctl.runfile import read_run

__all__ = ["router"]

router = APIRouter(prefix="/v1/campaigns", tags=["campaigns"])

_MOST_NUMBER = 2**31 - 1


@router.post("", status_code=201)
def create(body: NewCampaign, here: Here, response: Response) -> CampaignSummary:
    """Accept a campaign; its rig's worker plays it when those before it have ended."""
    campaign = here.store.create(body)
    response.headers["Location"] = f"/v1/campaigns/{campaign.id}"
    return summary(campaign)


@router.get("")
def list_campaigns(
    here: Here,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
    before: Annotated[int | None, Query(ge=1, le=_MOST_NUMBER)] = None,
    state: CampaignState | None = None,
) -> CampaignList:
    """The newest campaigns first."""
    found = here.store.campaigns(limit=limit, before=before, state=state)
    more = found[-1].number if len(found) == limit else None
    return CampaignList(campaigns=[summary(campaign) for campaign in found], next_before=more)


@router.get("/{campaign_id}")
def one(campaign_id: str, here: Here) -> CampaignAnswer:
    """One campaign with its configurations and everything that happened to it."""
    return detail(here.store.campaign(campaign_id), here.store.events(campaign_id))


@router.post("/{campaign_id}/abort", status_code=202)
def abort(campaign_id: str, here: Here) -> CampaignSummary:
    """Ask for its end: at once where it waits; where it runs, the rig stops within its own limits first."""
    return summary(here.store.abort(campaign_id, "an abort was asked for over HTTP"))


@router.post("/{campaign_id}/stop", status_code=202)
def stop(campaign_id: str, here: Here) -> CampaignSummary:
    """Ask for its end in order: the rig comes to rest, travels back to mid-stroke without current, and powers off."""
    return summary(here.store.ask(campaign_id, Asked.STOP, "a stop was asked for over HTTP"))


@router.post("/{campaign_id}/hold", status_code=202)
def hold(campaign_id: str, here: Here) -> CampaignSummary:
    """Ask a running one to wait: the rig comes to rest under power; between two tests it stays switched off."""
    return summary(here.store.ask(campaign_id, Asked.HOLD, "over HTTP"))


@router.post("/{campaign_id}/resume", status_code=202)
def resume(campaign_id: str, here: Here) -> CampaignSummary:
    """Let one that holds go on with the first sample that is not recorded yet."""
    return summary(here.store.ask(campaign_id, Asked.NOTHING, "over HTTP"))


@router.get("/{campaign_id}/runs")
def list_runs(campaign_id: str, here: Here) -> RunList:
    """What it captured, in order."""
    return RunList(runs=[answer_run(run) for run in here.store.runs(campaign_id)])


@router.get("/{campaign_id}/runs/{run_id}", response_class=FileResponse)
def download(campaign_id: str, run_id: str, here: Here) -> FileResponse:
    """The run file."""
    record = here.store.run(campaign_id, run_id)
    path = here.files.local(record)
    return FileResponse(path, media_type="application/x-hdf5", filename=path.name)


@router.get("/{campaign_id}/runs/{run_id}/loops")
def run_loops(
    campaign_id: str, run_id: str, here: Here, points: Annotated[int, Query(ge=16, le=20000)] = 2000
) -> dict[str, JsonValue]:
    """Displacement, velocity and force of the run, thinned to at most so many points, for a picture."""
    run = read_run(here.files.local(here.store.run(campaign_id, run_id)))
    return loops(run, points)
