"""What every route uses: the stores, results, live samples and settings of one service."""

from __future__ import annotations

from dataclasses import dataclass, field
from threading import Event
from typing import Annotated

from fastapi import Depends, Request

from api.access.access import Access
from api.campaigns.acceptance import Acceptance
from api.campaigns.envelopes import service_envelopes
from api.campaigns.live import Live
from api.campaigns.restarts import Restarts
from api.campaigns.rig_store import RigStore
from api.campaigns.store import CampaignStore
from api.jobs.results import Results
from api.jobs.store import JobStore
from api.line.service_end import ServiceEnd
from api.settings import Settings
from api.store.database import Database
from api.store.designs import DesignStore
from api.store.group_commit import GroupCommit
from api.store.idempotency import IdempotencyKeys
from api.store.models import ModelStore
from api.store.run_catalogue import RunCatalogue
from api.store.runs import RunStore, open_runs
from excitation.rig import Envelope

__all__ = ["Service", "ServiceDep", "open_service", "service_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """Made when the app starts. ``closing`` ends streamed answers."""

    settings: Settings
    access: Access
    database: Database
    campaigns: CampaignStore
    rigs: RigStore
    runs: RunStore
    jobs: JobStore
    explanations: JobStore  # the jobs of kind explain, which have routes of their own
    results: Results
    live: Live
    designs: DesignStore
    models: ModelStore
    catalogue: RunCatalogue
    lines: ServiceEnd  # to the workers of the rigs
    idempotency: IdempotencyKeys
    group_commit: GroupCommit
    acceptance: Acceptance
    envelopes: tuple[Envelope, ...] = ()  # that hold for every campaign
    restarts: Restarts = field(default_factory=Restarts)  # of workers that ended on their own
    closing: Event = field(default_factory=Event)


def open_service(settings: Settings, access: Access, lines: ServiceEnd, live: Live) -> Service:
    """Open the database and the folders; raises SettingsError, DesignError or StoreError."""
    database = Database(settings.store_url)
    access.open(database)
    runs = _run_store(database, settings)
    idempotency = IdempotencyKeys(database, keep_s=settings.keep_keys_hours * 3600.0)
    return Service(
        settings=settings,
        access=access,
        database=database,
        campaigns=CampaignStore(database),
        rigs=RigStore(database),
        runs=runs,
        jobs=JobStore(database),
        explanations=JobStore(database, kind="explain", noun="explanation"),
        results=Results(settings.results_dir.absolute()),
        designs=DesignStore(database),
        models=ModelStore(database),
        catalogue=RunCatalogue(database),
        live=live,
        lines=lines,
        idempotency=idempotency,
        group_commit=GroupCommit(database),
        acceptance=Acceptance(database, idempotency, runs),
        envelopes=service_envelopes(settings),
    )


def _run_store(database: Database, settings: Settings) -> RunStore:
    runs = open_runs(database, settings)
    runs.put_uploads_right()
    runs.samples.put_right()
    return runs


def service_of(request: Request) -> Service:
    """The service that a request has come to."""
    service = request.app.state.service
    assert isinstance(service, Service)  # the app has started
    return service


async def _service(request: Request) -> Service:  # not in a thread of the pool: it waits for nothing
    return service_of(request)


ServiceDep = Annotated[Service, Depends(_service)]
