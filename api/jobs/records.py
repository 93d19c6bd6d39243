"""A job as the store has it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

__all__ = ["Job", "JobState"]


class JobState(StrEnum):
    """Where a job stands; the last three are final."""

    ACCEPTED = "accepted"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """Work on runs: its request, its progress and its result. Times are seconds since 1970, UTC."""

    number: int  # the order of acceptance
    id: str
    kind: str
    name: str
    campaign_id: str  # empty: the runs are not those of one campaign
    request: Mapping[str, Any]  # JSON: the ids of the runs and the options of the kind
    result: Mapping[str, Any]  # JSON: the figures of its result; empty unless it is done
    state: JobState
    phase: str
    done: float  # 0 … 1
    reason: str  # why it failed or was cancelled
    created_at_s: float
    started_at_s: float | None
    ended_at_s: float | None
    removed_at_s: float | None  # when the files of its result were removed

    @property
    def runs(self) -> tuple[str, ...]:
        """Ids of the captured or uploaded runs."""
        return tuple(self.request["runs"])

    @property
    def held_out(self) -> tuple[str, ...]:
        """Ids of the runs that are not used for fitting."""
        return tuple(self.request["held_out"])

    @property
    def has_files(self) -> bool:
        """Whether the files of its result can be fetched."""
        return self.state is JobState.DONE and self.removed_at_s is None
