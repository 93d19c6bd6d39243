"""Rigs in the store: who they are, where they are, whether they are in service, and for whom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

from sqlalchemy import ColumnElement, Connection, Row, insert, select, update
from sqlalchemy.dialects import postgresql, sqlite

from api.errors import Conflict, InputError, NotFound
from api.store.clock import now
from api.store.tables import rig_events, rigs
from rigctl.canonical import canonical_address, is_allowed
from rigctl.transport import Capability, Identity

__all__ = [
    "Rig",
    "RigEvent",
    "all_rigs",
    "check_allowed",
    "ensure_rig",
    "find_rig",
    "read_rig",
    "record_rig_event",
    "rig_key",
    "set_rig",
    "store_identity",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rig:
    """One registered rig. Times are seconds since 1970, UTC."""

    id: str
    key: str  # which rig it is, see `rig_key`
    address: str  # in its one spelling
    name: str
    model: str
    serial: str  # empty: it has not answered yet
    envelope: Mapping[str, Any] | None  # Any: JSON, as TOML has it
    interlocks: tuple[str, ...]
    out_of_service: str | None  # the reason
    reserved_by: str | None
    reserved_until_s: float | None
    paused_reason: str | None
    paused_at_s: float | None
    state: str  # as its worker saw it last
    state_text: str
    state_at_s: float | None
    created_at_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RigEvent:
    """One thing that happened to a rig or its queue, and who did it; empty: the service."""

    number: int
    at_s: float
    who: str
    text: str


def rig_key(identity: Identity, address: str) -> str:
    """Which rig it is: maker, model and serial number. A simulated rig, whose number is a seed, is its address."""
    if Capability.SIMULATED in identity.capabilities or not identity.serial.strip():
        return address
    return f"{identity.vendor}/{identity.model}/{identity.serial}"


def check_allowed(address: str, patterns: Sequence[str]) -> None:
    """Raise InputError where the administrator has not allowed rigs at a canonical address."""
    if not is_allowed(address, patterns):
        raise InputError(
            f"rig address {address!r:.200} is not allowed here: an administrator adds it to the setting rigs_allowed "
            f"(now {', '.join(patterns)})"
        )


def find_rig(connection: Connection, text: str) -> Rig | None:
    """The rig with this id, address in any spelling, serial number or name; None where there is none.

    Raises UrlError for an address that is none, and Conflict where several rigs have this serial number or name.
    """
    if "://" in text:
        return _one(connection, rigs.c.address == canonical_address(text))
    if (found := _one(connection, rigs.c.id == text)) is not None:
        return found
    rows = connection.execute(select(rigs).where((rigs.c.serial == text) | (rigs.c.name == text)).limit(2)).all()
    if len(rows) > 1:
        raise Conflict(f"several rigs have the serial number or the name {text!r:.200}: give the id or the address")
    return _rig(rows[0]) if rows and text else None


def all_rigs(connection: Connection) -> tuple[Rig, ...]:
    """Every registered rig, by its address."""
    return tuple(map(_rig, connection.execute(select(rigs).order_by(rigs.c.address))))


def read_rig(connection: Connection, text: str) -> Rig:
    """The rig with this id, address, serial number or name; raises NotFound."""
    found = find_rig(connection, text)
    if found is None:
        raise NotFound(f"there is no rig {text!r:.200}: GET /v1/rigs lists the rigs by id, serial number and address")
    return found


def ensure_rig(connection: Connection, text: str) -> Rig:
    """The rig, registered on the way where an address names one that is not; raises InputError and UrlError."""
    found = find_rig(connection, text)
    if found is not None:
        return found
    if "://" not in text:
        raise InputError(
            f"rig is {text!r:.200}: no rig has this id, serial number or name, and it is no address "
            "(modbus://HOST:PORT, can://INTERFACE/CHANNEL): GET /v1/rigs lists the rigs"
        )
    address = canonical_address(text)
    fresh = {"id": uuid4().hex, "key": address, "address": address, "created_at_s": now()}
    texts = dict.fromkeys(("name", "model", "serial", "state_text"), "")
    added = _insert(connection)(rigs).values(**fresh, **texts, interlocks=[], state="unknown").on_conflict_do_nothing()
    connection.execute(added)
    found = _one(connection, rigs.c.address == address)
    if found is None:
        raise Conflict(f"rig address {address}: another rig is known as this one: GET /v1/rigs lists the rigs")
    return found


def set_rig(connection: Connection, rig_id: str, **values: object) -> None:
    connection.execute(update(rigs).where(rigs.c.id == rig_id).values(**values))


def record_rig_event(connection: Connection, rig_id: str, text: str, who: str = "") -> None:
    connection.execute(insert(rig_events).values(rig=rig_id, at_s=now(), who=who, text=text))


def store_identity(connection: Connection, rig: Rig, identity: Identity) -> str:
    """Store who answered at the address of a rig; returns the key of the rig.

    Raises Conflict where that is another rig than the one that is registered, or one that has another address too.
    """
    key = rig_key(identity, rig.address)
    if key == rig.key and (identity.model, identity.serial) == (rig.model, rig.serial):
        return key
    if rig.key not in (key, rig.address):
        raise Conflict(f"rig {rig.address}: {key} answers, registered is {rig.key}: change its address, or register it")
    other = _one(connection, (rigs.c.key == key) & (rigs.c.id != rig.id))
    if other is not None:
        raise Conflict(f"rig {rig.address} is {key}, which is registered as {other.address}: use that address")
    set_rig(connection, rig.id, key=key, model=identity.model, serial=identity.serial)
    record_rig_event(connection, rig.id, f"it says that it is {identity.vendor} {identity.model} {identity.serial}")
    return key


def _one(connection: Connection, where: ColumnElement[bool]) -> Rig | None:
    row = connection.execute(select(rigs).where(where)).one_or_none()
    return None if row is None else _rig(row)


def _rig(row: Row[Any]) -> Rig:
    # Any: SQLAlchemy's rows know their columns only when they run
    values = {name: getattr(row, name) for name in Rig.__slots__}
    return Rig(**{**values, "interlocks": tuple(row.interlocks)})


def _insert(connection: Connection) -> Any:
    # Any: two functions of SQLAlchemy without a common type
    return postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
