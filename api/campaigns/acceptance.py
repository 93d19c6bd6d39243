"""Campaigns are accepted: each whole, once for its Idempotency-Key, and several at once with few statements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection

from api.campaigns.new_campaign import NewCampaign
from api.campaigns.records import Campaign
from api.campaigns.rigs import Rig, find_rig
from api.campaigns.store import CampaignStore, Placed, insert_campaigns
from api.errors import Conflict, InputError
from api.store.database import Database
from api.store.idempotency import GivenAnswer, IdempotencyKeys, KeyedRequest
from api.store.runs import RunStore
from excitation import TestPlan
from rigctl.errors import UrlError

__all__ = ["Acceptance", "Wanted"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """A campaign that somebody asks for, checked already. ``request``: where it came with a key."""

    new: NewCampaign
    plan: TestPlan
    created_by: str
    request: KeyedRequest | None
    answer: Callable[[Campaign], GivenAnswer]


class Acceptance:
    """Stores campaigns; an answer comes with whether it was given before. A full disk accepts none."""

    def __init__(self, database: Database, keys: IdempotencyKeys, runs: RunStore) -> None:
        self._database, self._keys, self._runs = database, keys, runs
        self._campaigns = CampaignStore(database)

    def alone(self, wanted: Wanted) -> tuple[GivenAnswer, bool]:
        """Store one campaign, or find the answer that its request had before.

        Raises DiskFull; InputError, UrlError and Conflict where its rig or its key cannot be used.
        """

        def made() -> GivenAnswer:
            self._runs.check_room()
            return wanted.answer(self._campaigns.create(wanted.new, plan=wanted.plan, created_by=wanted.created_by))

        return (made(), False) if wanted.request is None else self._keys.once(wanted.request, made)

    def together(self, wanted: Sequence[Wanted]) -> list[tuple[GivenAnswer, bool] | None]:
        """Store those for a registered rig that come without a key, or as the first with theirs; None for the others.

        Raises DiskFull, and Conflict where a key comes to another service at the same time.
        """
        self._runs.check_room()
        with self._database.together() as connection:
            placed = self._placed(connection, wanted)
            if not placed:
                return [None] * len(wanted)
            campaigns = insert_campaigns(connection, list(placed.values()))
            answers = {k: wanted[k].answer(made) for k, made in zip(placed, campaigns, strict=True)}
            keyed = [(request, answer) for k, answer in answers.items() if (request := wanted[k].request)]
            if keyed:
                self._keys.keep(keyed)
        return [(answers[k], False) if k in answers else None for k in range(len(wanted))]

    def _placed(self, connection: Connection, wanted: Sequence[Wanted]) -> dict[int, Placed]:
        """Those that can be stored together, by their position."""
        rigs = {text: _registered(connection, text) for text in {one.new.rig for one in wanted}}
        requests = [one.request for one in wanted if one.request is not None]
        taken = set(self._keys.came_before(requests)) if requests else set()
        found: dict[int, Placed] = {}
        for k, one in enumerate(wanted):
            rig = rigs[one.new.rig]
            key = None if one.request is None else (one.request.key, one.request.address)
            if rig is None or key in taken:
                continue
            if key is not None:
                taken.add(key)
            found[k] = Placed(new=one.new, plan=one.plan, rig=rig, created_by=one.created_by)
        return found


def _registered(connection: Connection, text: str) -> Rig | None:
    """The rig; None where it has to be registered first, or where the text is refused."""
    try:
        return find_rig(connection, text)
    except (Conflict, InputError, UrlError):
        return None
