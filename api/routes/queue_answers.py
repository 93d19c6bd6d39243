"""The queue of a rig over HTTP: its order, and the precondition of a change."""

from __future__ import annotations

from typing import Annotated, Self

from fastapi import Header
from pydantic import BaseModel, ConfigDict, Field, model_validator

from api.campaigns.rig_store import Queue
from api.errors import Conflict, Needed

__all__ = ["Move", "Precondition", "QueueAnswer", "place_in", "queue_answer", "read_version"]

Precondition = Annotated[str | None, Header(description="the ETag of the queue, as GET /v1/rigs/{rig}/queue gave it")]


class Move(BaseModel):
    """Where a campaign goes in its queue: to a position (0: the first), or before or after another campaign."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    position: int | None = Field(default=None, ge=0, le=2**31 - 1)
    before: str | None = Field(default=None, max_length=64)
    after: str | None = Field(default=None, max_length=64)

    @model_validator(mode="after")
    def _one_of_three(self) -> Self:
        if sum(value is not None for value in (self.position, self.before, self.after)) != 1:
            raise ValueError("give one of position, before and after")
        return self


class QueueAnswer(BaseModel):
    """The ids of the campaigns that wait for a rig, in order, and the version of that order (its ETag)."""

    model_config = ConfigDict(frozen=True)

    rig: str
    campaigns: list[str]
    version: str


def queue_answer(queue: Queue) -> QueueAnswer:
    return QueueAnswer(rig=queue.rig.id, campaigns=list(queue.campaigns), version=queue.version)


def read_version(if_match: str | None) -> str:
    """The version in an If-Match header; raises Needed where there is none."""
    if not if_match:
        raise Needed("the header If-Match is missing: give the ETag of GET /v1/rigs/{rig}/queue")
    return if_match.strip().removeprefix("W/").strip('"')


def place_in(queue: Queue, campaign_id: str, move: Move) -> int:
    """The position that a move asks for, counted without the campaign itself; raises Conflict."""
    others = [one for one in queue.campaigns if one != campaign_id]
    if move.position is not None:
        return move.position
    beside = move.before if move.before is not None else move.after
    if beside not in others:
        raise Conflict(f"campaign {beside!r:.60} does not wait for this rig: give one that does")
    return others.index(beside) + (1 if move.after is not None else 0)
