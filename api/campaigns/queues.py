"""The queue of a rig in the store: its order, and its pause. Once paused, nothing starts until somebody resumes it."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from sqlalchemy import ColumnElement, Connection, func, select, update

from api.campaigns.records import CampaignState
from api.campaigns.rigs import Rig, record_rig_event, set_rig
from api.errors import Changed, Conflict
from api.store.clock import now
from api.store.tables import campaigns, rigs

__all__ = [
    "RESTARTED",
    "in_order",
    "may_start",
    "move",
    "pause_after_restart",
    "pause_queue",
    "queue_version",
    "resume_queue",
    "waiting_of",
]

RESTARTED = "the service was restarted"


def in_order() -> tuple[ColumnElement[int], ...]:
    """The order of a queue, for a query."""
    return (func.coalesce(campaigns.c.place, campaigns.c.number), campaigns.c.number)


def may_start() -> ColumnElement[bool]:
    """Whether a waiting campaign may start on its rig, for a query that joins both."""
    free = rigs.c.reserved_by.is_(None) | (rigs.c.reserved_until_s <= now())
    mine = free | (rigs.c.reserved_by == campaigns.c.created_by)
    in_service = rigs.c.paused_reason.is_(None) & rigs.c.out_of_service.is_(None)
    return (campaigns.c.state == CampaignState.ACCEPTED) & in_service & mine


def pause_queue(connection: Connection, rig_id: str, reason: str, who: str = "") -> None:
    """Pause the queue of a rig; the newest reason holds."""
    set_rig(connection, rig_id, paused_reason=reason, paused_at_s=now())
    record_rig_event(connection, rig_id, f"queue paused: {reason}", who)


def pause_after_restart(connection: Connection, rig: Rig, why: str = RESTARTED) -> None:
    """Pause the queue of a rig because its program was restarted; what it was paused for before stays in its reason."""
    if rig.paused_reason is None:
        pause_queue(connection, rig.id, why)
    elif why not in rig.paused_reason:
        pause_queue(connection, rig.id, f"{rig.paused_reason}; {why}")


def resume_queue(connection: Connection, rig: Rig, who: str = "", reason: str = "") -> None:
    """Resume the queue of a rig; no error if it is not paused."""
    if rig.paused_reason is not None:
        set_rig(connection, rig.id, paused_reason=None, paused_at_s=None)
        said = f"queue resumed: {reason}" if reason else "queue resumed"
        record_rig_event(connection, rig.id, f"{said} (it was paused: {rig.paused_reason})", who)


def waiting_of(connection: Connection, rig_id: str) -> tuple[str, ...]:
    """The ids of the campaigns that wait for a rig, in their order."""
    waits = (campaigns.c.rig_id == rig_id) & (campaigns.c.state == CampaignState.ACCEPTED)
    return tuple(connection.scalars(select(campaigns.c.id).where(waits).order_by(*in_order())))


def queue_version(ids: Sequence[str]) -> str:
    """A text that is another one as soon as the queue has another order or other campaigns."""
    return hashlib.sha256("\n".join(ids).encode()).hexdigest()[:16]


def move(connection: Connection, rig: Rig, campaign_id: str, to: int, version: str, who: str = "") -> None:
    """Put a waiting campaign at place ``to`` of its queue, 0 the first; the others keep their order.

    Raises Conflict where it does not wait, and Changed where the queue is not the one that the caller has seen.
    """
    query = select(campaigns.c.id, campaigns.c.name, in_order()[0].label("place")).where(
        (campaigns.c.rig_id == rig.id) & (campaigns.c.state == CampaignState.ACCEPTED)
    )
    rows = connection.execute(query.order_by(*in_order()).with_for_update()).all()
    ids = [row.id for row in rows]
    if campaign_id not in ids:
        raise Conflict(f"campaign {campaign_id} does not wait any more: only a waiting campaign can be moved")
    if version != queue_version(ids):
        raise Changed(
            f"the queue of rig {rig.address} has changed since it was read: read GET /v1/rigs/{rig.id}/queue again"
        )
    ids.remove(campaign_id)
    ids.insert(max(to, 0), campaign_id)
    for place, one in zip(sorted(row.place for row in rows), ids, strict=True):
        connection.execute(update(campaigns).where(campaigns.c.id == one).values(place=place))
    name = next(row.name for row in rows if row.id == campaign_id)
    record_rig_event(connection, rig.id, f"campaign {name!r} moved to place {ids.index(campaign_id) + 1}", who)
