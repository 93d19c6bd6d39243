"""What the store knows of campaigns: their tests and events, and the rigs that they name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from api.campaigns.orders import Asked
from api.campaigns.rigs import Rig

__all__ = [
    "Campaign",
    "CampaignState",
    "CampaignTest",
    "Event",
    "Pause",
    "RigRecord",
    "TestState",
]


class CampaignState(StrEnum):
    """Where a campaign stands; the last three are final."""

    ACCEPTED = "accepted"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    ABORTED = "aborted"


class TestState(StrEnum):
    """Where one test of a campaign stands; the last four are final."""

    __test__ = False  # the name starts with "Test": pytest must not collect it

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    ABORTED = "aborted"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignTest:
    """One test as it was asked for, and how far it is."""

    position: int
    name: str
    config: Mapping[str, Any]  # any JSON object: checked by excitation before it was accepted
    held_out: bool
    duration_s: float
    state: TestState
    phase: str
    samples: int
    total_samples: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """Tests in order on one rig with one specimen. Times are seconds since 1970, UTC."""

    number: int  # the order of acceptance
    id: str
    name: str
    rig: str  # the address that it had when the campaign was accepted
    rig_id: str
    created_by: str  # empty: not known
    specimen: str
    interlocks: tuple[str, ...]
    envelopes: tuple[Mapping[str, Any], ...]  # Any: JSON, as TOML has it
    setup: Mapping[str, Any]  # any JSON object: the keys of `PREPARED`
    question: str  # what it asks its operator; empty: nothing
    warm_up: Mapping[str, Any] | None  # any JSON object, as the configuration of a test is
    state: CampaignState
    reason: str  # why it failed or was aborted
    asked: Asked  # of it while it runs
    created_at_s: float
    started_at_s: float | None
    ended_at_s: float | None
    tests: tuple[CampaignTest, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """One thing that happened to a campaign, in the order in which it happened."""

    number: int
    at_s: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Pause:
    """Why no campaign of a rig starts, and since when."""

    reason: str
    at_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RigRecord:
    """One rig with its queue: which worker drives it, what waits for it, and whether its queue is paused."""

    rig: Rig
    worker: str  # empty: nobody holds it
    running: str  # id of the running campaign; empty: none
    accepted: int  # campaigns that wait

    @property
    def url(self) -> str:
        return self.rig.address

    @property
    def pause(self) -> Pause | None:
        """Why no campaign starts; None: the next one starts as soon as the rig is free."""
        if self.rig.paused_reason is None:
            return None
        return Pause(reason=self.rig.paused_reason, at_s=self.rig.paused_at_s or 0.0)
