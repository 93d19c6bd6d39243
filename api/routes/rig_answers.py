"""Rigs over HTTP: what is registered, what their queues do, and what is known of them."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from api.campaigns.records import RigRecord
from api.campaigns.rigs import RigEvent
from api.campaigns.sight import seen_of
from api.routes.answers import iso_time
from api.service import Service

__all__ = [
    "Changes",
    "NewRig",
    "Reason",
    "Reservation",
    "RigAnswer",
    "RigEventAnswer",
    "RigEvents",
    "RigList",
    "RigName",
    "event_answer",
    "rig_answer",
]

_Name = Field(default="", max_length=100, pattern=r"^[^\x00-\x1f/]*$")


class _Body(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class RigName(_Body):
    """A rig by its id, address, serial number or name."""

    rig: str = Field(min_length=1, max_length=500)
    reason: str = Field(default="", max_length=500)


class Reason(_Body):
    """Why somebody does it."""

    reason: str = Field(default="", max_length=500)


class Reservation(_Body):
    """How long a rig is reserved, and for whom where access control does not say it."""

    for_s: float = Field(gt=0, le=30 * 86400.0)
    by: str = Field(default="", max_length=100)


class NewRig(_Body):
    """A rig to be registered: its address, and what an administrator knows of it."""

    address: str = Field(min_length=1, max_length=500, examples=["modbus://127.0.0.1:5020"])
    name: str = _Name
    envelope: dict[str, JsonValue] | None = None
    interlocks: list[str] = Field(default_factory=list, max_length=50)


class Changes(_Body):
    """What changes of a registered rig; a key that is left out stays as it is."""

    name: str | None = Field(default=None, max_length=100, pattern=r"^[^\x00-\x1f/]*$")
    address: str | None = Field(default=None, min_length=1, max_length=500)
    envelope: dict[str, JsonValue] | None = None
    interlocks: list[str] | None = Field(default=None, max_length=50)
    out_of_service: str | None = Field(default=None, max_length=500)
    """The reason; null: it is in service again."""


class ProgressAnswer(BaseModel):
    """The test that is played."""

    model_config = ConfigDict(frozen=True)

    campaign: str
    test: str
    phase: str
    samples: int
    total_samples: int
    fifo: float | None = None  # share of the rig's FIFO that is full


class RigAnswer(BaseModel):
    """One rig: who it is, its worker, its campaigns, why and since when its queue is paused."""

    model_config = ConfigDict(frozen=True)

    id: str
    url: str
    name: str
    model: str
    serial: str
    envelope: dict[str, JsonValue] | None
    interlocks: list[str]
    out_of_service: str | None
    reserved_by: str | None
    reserved_until: str | None
    worker: str | None
    worker_again_at: str | None  # the next one, after one that ended on its own; at once where the queue is resumed
    running: str | None
    accepted: int
    paused: str | None
    paused_since: str | None
    state: str
    state_text: str
    known_at: str | None  # when that was seen; null: nobody has seen the rig
    readings: dict[str, float]  # force_n, displacement_m, current_a, temperature_degc, pressure_pa, as far as known
    progress: ProgressAnswer | None


class RigList(BaseModel):
    """Every registered rig."""

    model_config = ConfigDict(frozen=True)

    rigs: list[RigAnswer]


class RigEventAnswer(BaseModel):
    """One thing that happened to a rig; ``who`` is empty where the service did it."""

    model_config = ConfigDict(frozen=True)

    number: int
    at: str
    who: str
    text: str


class RigEvents(BaseModel):
    """What happened to a rig, the newest first."""

    model_config = ConfigDict(frozen=True)

    events: list[RigEventAnswer]


def rig_answer(record: RigRecord, service: Service) -> RigAnswer:
    rig = record.rig
    again_s = service.restarts.next_s(rig.id)
    seen = seen_of(rig, service.lines.lines.get(rig.id), again_s)
    return RigAnswer(
        id=rig.id,
        url=rig.address,
        name=rig.name,
        model=rig.model,
        serial=rig.serial,
        envelope=None if rig.envelope is None else dict(rig.envelope),
        interlocks=list(rig.interlocks),
        out_of_service=rig.out_of_service,
        reserved_by=rig.reserved_by,
        reserved_until=None if rig.reserved_until_s is None else iso_time(rig.reserved_until_s),
        worker=record.worker or None,
        worker_again_at=None if again_s is None else iso_time(again_s),
        running=record.running or None,
        accepted=record.accepted,
        paused=record.pause.reason if record.pause else None,
        paused_since=iso_time(record.pause.at_s) if record.pause else None,
        state=seen.state,
        state_text=seen.text,
        known_at=None if seen.at_s is None else iso_time(seen.at_s),
        readings=dict(seen.readings),
        progress=None if not seen.progress else ProgressAnswer(**seen.progress),
    )


def event_answer(event: RigEvent) -> RigEventAnswer:
    return RigEventAnswer(number=event.number, at=iso_time(event.at_s), who=event.who, text=event.text)
