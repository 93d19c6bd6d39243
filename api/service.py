"""What every route uses: the stores, results, live samples and settings of one service."""

from __future__ import annotations

from dataclasses import dataclass, field
from threading import Event
from typing import Annotated

from fastapi import Depends, Request

from api.campaigns.live import Live
from api.campaigns.store import CampaignStore
from api.jobs.results import Results
from api.jobs.store import JobStore
from api.settings import Settings
from api.store.database import Database
from api.store.runs import RunStore

__all__ = ["Service", "ServiceDep", "open_service"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """Made when the app starts. ``closing`` ends streamed answers."""

    settings: Settings
    database: Database
    campaigns: CampaignStore
    runs: RunStore
    jobs: JobStore
    explanations: JobStore  # the jobs of kind explain, which have routes of their own
    results: Results
    live: Live
    closing: Event = field(default_factory=Event)


def open_service(settings: Settings) -> Service:
    """Open the database and the folders; raises SettingsError or StoreError."""
    database = Database(settings.store_url)
    return Service(
        settings=settings,
        database=database,
        campaigns=CampaignStore(database),
        runs=RunStore(database, settings.runs_dir.absolute()),
        jobs=JobStore(database),
        explanations=JobStore(database, kind="explain", noun="explanation"),
        results=Results(settings.results_dir.absolute()),
        live=Live(),
    )


def _service(request: Request) -> Service:
    service = request.app.state.service
    assert isinstance(service, Service)  # the app has started
    return service


ServiceDep = Annotated[Service, Depends(_service)]
