"""Registered rigs and their queues, as the routes use them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, func, select

from api.campaigns.queues import move, pause_after_restart, pause_queue, queue_version, resume_queue, waiting_of
from api.campaigns.records import CampaignState, RigRecord
from api.campaigns.rigs import Rig, RigEvent, all_rigs, ensure_rig, read_rig, record_rig_event, set_rig, store_identity
from api.campaigns.store import OPEN_STATES, rig_resource
from api.errors import Conflict, InputError
from api.store.clock import now
from api.store.database import Database
from api.store.leases import holders
from api.store.sightings import Sightings
from api.store.tables import campaigns, rig_events, rigs
from rigctl.transport import Identity

__all__ = ["Queue", "RigStore"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Queue:
    """The campaigns that wait for a rig, by their ids, and the version of that order."""

    rig: Rig
    campaigns: tuple[str, ...]

    @property
    def version(self) -> str:
        return queue_version(self.campaigns)


class RigStore:
    """Rigs in the database. Safe to use from many threads; every call is one transaction.

    A rig is named by its id, address, serial number or name; every call raises NotFound where there is none.
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def register(self, address: str, *, who: str = "", identity: Identity | None = None, **values: Any) -> RigRecord:
        """Register a rig, or change what is registered of it; Conflict where it is known under another address.

        Any: the columns ``name``, ``envelope`` and ``interlocks``.
        """
        with self._database.writing() as connection:
            rig = ensure_rig(connection, address)
            if identity is not None:
                store_identity(connection, rig, identity)
            _check_name(connection, rig, values.get("name", ""))
            if values:
                set_rig(connection, rig.id, **values)
            record_rig_event(connection, rig.id, f"registered at {rig.address}", who)
            return _record(connection, self._database.sightings, rig.id)

    def change(self, rig: str, *, who: str = "", **values: Any) -> RigRecord:
        """Change the name, address, envelope or interlocks of a rig, or take it out of service. Any: its columns."""
        with self._database.writing() as connection:
            found = read_rig(connection, rig)
            _check_name(connection, found, values.get("name") or "")
            if "address" in values and values["address"] != found.address:
                _check_address(connection, found, values["address"])
                if found.key == found.address:
                    values["key"] = values["address"]
            if values:
                set_rig(connection, found.id, **values)
            for name, value in values.items():
                if name != "key" and value != getattr(found, name):
                    record_rig_event(connection, found.id, f"{name} is now {value!r:.200}", who)
            return _record(connection, self._database.sightings, found.id)

    def reserve(self, rig: str, *, who: str, for_s: float) -> RigRecord:
        """Reserve a rig: until then only campaigns of ``who`` start. Conflict where somebody else has reserved it."""
        with self._database.writing() as connection:
            found = read_rig(connection, rig)
            at_s = float(connection.scalar(select(now())) or 0.0)
            if found.reserved_by not in (None, who) and (found.reserved_until_s or 0.0) > at_s:
                raise Conflict(f"rig {found.address} is reserved by {found.reserved_by}: wait, or ask for its release")
            set_rig(connection, found.id, reserved_by=who, reserved_until_s=now() + for_s)
            record_rig_event(connection, found.id, f"reserved for {for_s:g} s", who)
            return _record(connection, self._database.sightings, found.id)

    def release(self, rig: str, *, who: str) -> RigRecord:
        """End the reservation of a rig."""
        with self._database.writing() as connection:
            found = read_rig(connection, rig)
            set_rig(connection, found.id, reserved_by=None, reserved_until_s=None)
            if found.reserved_by is not None:
                record_rig_event(connection, found.id, f"reservation of {found.reserved_by} ended", who)
            return _record(connection, self._database.sightings, found.id)

    def pause(self, rig: str, reason: str, *, who: str = "") -> RigRecord:
        """Pause the queue of a rig."""
        with self._database.writing() as connection:
            found = read_rig(connection, rig)
            pause_queue(connection, found.id, reason, who)
            return _record(connection, self._database.sightings, found.id)

    def resume(self, rig: str, *, who: str = "", reason: str = "") -> RigRecord:
        """Let the campaigns that wait for a rig start again."""
        with self._database.writing() as connection:
            found = read_rig(connection, rig)
            resume_queue(connection, found, who, reason)
            return _record(connection, self._database.sightings, found.id)

    def pause_after_restart(self, *, but: frozenset[str] = frozenset()) -> None:
        """Pause the queue of every rig with a campaign that has not ended, except rigs ``but``, by their ids."""
        query = select(campaigns.c.rig_id).where(campaigns.c.state.in_(OPEN_STATES)).distinct()
        with self._database.writing() as connection:
            for rig_id in connection.scalars(query).all():
                if rig_id not in but:
                    pause_after_restart(connection, read_rig(connection, rig_id))

    def queue(self, rig: str) -> Queue:
        """The campaigns that wait for a rig."""
        with self._database.reading() as connection:
            found = read_rig(connection, rig)
            return Queue(rig=found, campaigns=waiting_of(connection, found.id))

    def move(self, rig_id: str, campaign_id: str, *, to: int, version: str, who: str = "") -> Queue:
        """Put a waiting campaign at another place; Changed where the queue is not the one of ``version``."""
        with self._database.writing() as connection:
            found = read_rig(connection, rig_id)
            move(connection, found, campaign_id, to, version, who)
            return Queue(rig=found, campaigns=waiting_of(connection, found.id))

    def rigs(self) -> tuple[RigRecord, ...]:
        """Every rig, by its address."""
        with self._database.reading() as connection:
            return _records(connection, self._database.sightings)

    def one(self, rig: str) -> RigRecord:
        """One rig."""
        with self._database.reading() as connection:
            return _record(connection, self._database.sightings, read_rig(connection, rig).id)

    def events(self, rig: str, *, limit: int = 100) -> tuple[RigEvent, ...]:
        """What happened to a rig, the newest first."""
        with self._database.reading() as connection:
            mine = rig_events.c.rig == read_rig(connection, rig).id
            rows = connection.execute(select(rig_events).where(mine).order_by(rig_events.c.number.desc()).limit(limit))
            return tuple(RigEvent(number=row.number, at_s=row.at_s, who=row.who, text=row.text) for row in rows)


def _check_name(connection: Connection, rig: Rig, name: str) -> None:
    taken = select(rigs.c.address).where(((rigs.c.name == name) | (rigs.c.serial == name)) & (rigs.c.id != rig.id))
    if name and (other := connection.scalar(taken.limit(1))) is not None:
        raise Conflict(f"rig {other} is called {name!r:.200} already: give another name")
    if "://" in name:
        raise InputError(f"name is {name!r:.200}: a name is no address")


def _check_address(connection: Connection, rig: Rig, address: str) -> None:
    if (other := connection.scalar(select(rigs.c.address).where(rigs.c.address == address))) is not None:
        raise Conflict(f"a rig is registered at {other} already")
    running = (campaigns.c.rig_id == rig.id) & (campaigns.c.state == CampaignState.RUNNING)
    if connection.scalar(select(campaigns.c.id).where(running).limit(1)) is not None:
        raise Conflict(f"a campaign runs on rig {rig.address}: change its address when it has ended")


def _record(connection: Connection, sightings: Sightings, rig_id: str) -> RigRecord:
    [record] = [record for record in _records(connection, sightings) if record.rig.id == rig_id]
    return record


def _records(connection: Connection, sightings: Sightings) -> tuple[RigRecord, ...]:
    workers = holders(connection, sightings)
    counted = select(campaigns.c.rig_id, func.count().label("waiting")).group_by(campaigns.c.rig_id)
    waiting = {
        row.rig_id: row.waiting
        for row in connection.execute(counted.where(campaigns.c.state == CampaignState.ACCEPTED))
    }
    running = dict(
        connection.execute(
            select(campaigns.c.rig_id, campaigns.c.id).where(campaigns.c.state == CampaignState.RUNNING)
        ).all()
    )
    return tuple(
        RigRecord(
            rig=rig,
            worker=workers.get(rig_resource(rig.key), ""),
            running=running.get(rig.id, ""),
            accepted=waiting.get(rig.id, 0),
        )
        for rig in all_rigs(connection)
    )
