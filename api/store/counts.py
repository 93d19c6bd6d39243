"""How much the store holds, for monitoring."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import func, select

from api.store.database import Database
from api.store.tables import campaigns, jobs, rigs

__all__ = ["StoreCounts", "count_store"]


@dataclass(frozen=True, slots=True, kw_only=True)
class StoreCounts:
    """Campaigns and jobs by state; of each registered rig, by its id, waiting campaigns and whether it is paused."""

    campaigns: Mapping[str, int]
    jobs: Mapping[str, int]
    queues: Mapping[str, int]
    paused: Mapping[str, int]


def count_store(database: Database) -> StoreCounts:
    """The counts, of one moment."""
    with database.reading() as connection:
        states = connection.execute(select(campaigns.c.state, func.count()).group_by(campaigns.c.state))
        of_campaigns = {row[0]: int(row[1]) for row in states}
        of_jobs = connection.execute(select(jobs.c.state, func.count()).group_by(jobs.c.state))
        waiting = select(campaigns.c.rig_id, func.count()).where(campaigns.c.state == "accepted")
        queues = {row[0]: int(row[1]) for row in connection.execute(waiting.group_by(campaigns.c.rig_id))}
        known = {row.id: row.paused_reason is not None for row in connection.execute(select(rigs))}
        return StoreCounts(
            campaigns=of_campaigns,
            jobs={row[0]: int(row[1]) for row in of_jobs},
            queues={rig: queues.get(rig, 0) for rig in known},
            paused={rig: int(paused) for rig, paused in known.items()},
        )
