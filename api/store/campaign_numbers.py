"""From the id of a campaign to its number, by which other tables refer to it."""

from __future__ import annotations

from sqlalchemy import Connection, select

from api.errors import NotFound
from api.store.tables import campaigns

__all__ = ["campaign_number", "unknown_campaign"]


def campaign_number(connection: Connection, campaign_id: str) -> int:
    """The number of a campaign; raises NotFound."""
    number = connection.scalar(select(campaigns.c.number).where(campaigns.c.id == campaign_id))
    if number is None:
        raise unknown_campaign(campaign_id)
    return int(number)


def unknown_campaign(campaign_id: str) -> NotFound:
    """The error for an id that no campaign has."""
    return NotFound(f"there is no campaign {campaign_id!r:.60}: GET /v1/campaigns lists them")
