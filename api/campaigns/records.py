"""What the store tells: campaigns, their tests, runs and events, and leases on rigs."""

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
    "Explanation",
    "ExplanationState",
    "Lease",
    "RigRecord",
    "RunRecord",
    "TestState",
    "Upload",
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
class RunRecord:
    """What the store knows of a run file; the samples are only in the file."""

    id: str
    campaign_id: str
    test: str
    held_out: bool
    status: str
    location: str  # where the run files' keeper finds it
    size_bytes: int
    sha256: str
    samples: int
    sample_rate_hz: float
    created: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """One thing that happened to a campaign, in the order in which it happened."""

    number: int
    at_s: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Lease:
    """The right of one worker to drive one rig; ``token`` rises with every new holder."""

    rig: str
    owner: str
    token: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RigRecord:
    """One rig as the store sees it: who drives it and what waits for it."""

    url: str
    worker: str  # empty: nobody holds it
    running: str  # id of the running campaign; empty: none
    accepted: int  # campaigns that wait


class ExplanationState(StrEnum):
    """Where an explanation stands; the last three are final."""

    ACCEPTED = "accepted"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True, kw_only=True)
class Explanation:
    """A gap to be explained: a base model, the runs, and how far the work is. Times are seconds since 1970, UTC."""

    number: int  # the order of acceptance
    id: str
    name: str
    campaign_id: str  # empty: the runs are not those of one campaign
    model: Mapping[str, Any] | None  # the JSON of a model file; None: the runs hold the simulation
    runs: tuple[str, ...]  # ids of captured or uploaded runs
    held_out: tuple[str, ...]
    state: ExplanationState
    phase: str
    done: float  # 0 … 1
    reason: str  # why it failed or was cancelled
    verdict: str
    effects: tuple[tuple[str, float], ...]  # name and confidence
    created_at_s: float
    started_at_s: float | None
    ended_at_s: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Upload:
    """A run file that came from elsewhere."""

    id: str
    name: str
    location: str  # where the run files' keeper finds it
    size_bytes: int
    sha256: str
    specimen: str
    status: str
    samples: int
    sample_rate_hz: float
