"""What the store knows of campaigns: their tests and events, and the rigs that they name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from api.campaigns.orders import Asked

__all__ = [
    "Campaign",
    "CampaignState",
    "CampaignTest",
    "Event",
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
    rig: str
    specimen: str
    interlocks: tuple[str, ...]
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
class RigRecord:
    """One rig: which worker drives it and what waits for it."""

    url: str
    worker: str  # empty: nobody holds it
    running: str  # id of the running campaign; empty: none
    accepted: int  # campaigns that wait
