"""What every route is given: one service's store, run files, live samples and settings."""

from __future__ import annotations

from dataclasses import dataclass, field
from threading import Event
from typing import Annotated

from fastapi import Depends, Request

from api.campaigns.live import Live
from api.campaigns.store import Store
from api.jobs.results import Reports
from api.jobs.store import ExplanationStore
from api.settings import Settings
from api.store.runs import RunFiles

__all__ = ["Here", "House"]


@dataclass(frozen=True, slots=True, kw_only=True)
class House:
    """Built by the lifespan of the app, closed with it. ``closing`` ends answers that would never end."""

    settings: Settings
    store: Store
    explanations: ExplanationStore
    files: RunFiles
    reports: Reports
    live: Live
    closing: Event = field(default_factory=Event)


def _house(request: Request) -> House:
    house = request.app.state.house
    assert isinstance(house, House)  # the lifespan has run
    return house


Here = Annotated[House, Depends(_house)]
