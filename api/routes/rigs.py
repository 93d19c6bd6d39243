"""Rigs: register one, take it out of service, reserve it, and govern its queue."""

from __future__ import annotations

import asyncio
from contextlib import closing, suppress
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import JSONResponse

from api.campaigns.rigs import check_allowed
from api.errors import InputError
from api.problems import problem
from api.routes.person import PersonDep
from api.routes.queue_answers import QueueAnswer, queue_answer
from api.routes.rig_answers import (
    Changes,
    NewRig,
    Reason,
    Reservation,
    RigAnswer,
    RigEvents,
    RigList,
    RigName,
    event_answer,
    rig_answer,
)
from api.routes.stops import Stops
from api.service import Service, ServiceDep
from excitation.configuration import to_spec
from excitation.rig import Envelope
from rigctl.address import connect
from rigctl.canonical import canonical_address
from rigctl.errors import TransportError
from rigctl.interlocks import interlock
from rigctl.transport import Identity

__all__ = ["router"]

router = APIRouter(prefix="/v1/rigs", tags=["rigs"])

ASK_S = 2.0  # for a rig to say who it is when it is registered; one that is switched off is registered all the same


@router.get("")
def list_rigs(service: ServiceDep) -> RigList:
    """Every registered rig; a campaign that names an allowed address registers a rig on the way."""
    return RigList(rigs=[rig_answer(rig, service) for rig in service.rigs.rigs()])


@router.post("", status_code=201)
def register(body: NewRig, service: ServiceDep, response: Response, person: PersonDep) -> RigAnswer:
    """Register a rig, which is asked who it is where it answers; again: change what is registered of it."""
    address = canonical_address(body.address)
    check_allowed(address, service.settings.rig_patterns)
    _check(body.envelope, body.interlocks)
    values = {"name": body.name, "envelope": body.envelope, "interlocks": body.interlocks}
    record = service.rigs.register(address, who=person, identity=_identity(address), **values)
    response.headers["Location"] = f"/v1/rigs/{record.rig.id}"
    return rig_answer(record, service)


@router.post("/resume")
def resume_named(body: RigName, service: ServiceDep, person: PersonDep) -> RigAnswer:
    """Resume the queue of a rig, after a look at the rig: the campaigns that wait for it start again."""
    return rig_answer(service.rigs.resume(body.rig, who=person, reason=body.reason), service)


@router.get("/{rig}")
def one(rig: str, service: ServiceDep) -> RigAnswer:
    """One rig, by its id, serial number or name."""
    return rig_answer(service.rigs.one(rig), service)


@router.patch("/{rig}")
def change(rig: str, body: Changes, service: ServiceDep, person: PersonDep) -> RigAnswer:
    """Change its name, address, envelope or interlocks, or take it out of service with a reason."""
    values: dict[str, Any] = {key: getattr(body, key) for key in body.model_fields_set}  # Any: columns of the store
    if values.get("address") is not None:
        values["address"] = canonical_address(values["address"])
        check_allowed(values["address"], service.settings.rig_patterns)
    for key in ("name", "address", "interlocks"):
        if key in values and values[key] is None:
            raise InputError(f"{key} is null: give a value, or leave it out")
    _check(values.get("envelope"), values.get("interlocks") or [])
    return rig_answer(service.rigs.change(rig, who=person, **values), service)


@router.get("/{rig}/events")
def events(rig: str, service: ServiceDep) -> RigEvents:
    """What happened to a rig and its queue, and who did it: the newest 100, the newest first."""
    return RigEvents(events=[event_answer(event) for event in service.rigs.events(rig)])


@router.get("/{rig}/queue")
def queue(rig: str, service: ServiceDep, response: Response) -> QueueAnswer:
    """The campaigns that wait for a rig, in order; its ETag is the precondition of a move."""
    found = service.rigs.queue(rig)
    response.headers["ETag"] = f'"{found.version}"'
    return queue_answer(found)


@router.post("/{rig}/pause")
def pause(rig: str, body: Reason, service: ServiceDep, person: PersonDep) -> RigAnswer:
    """Pause its queue: the campaign that runs goes on, none starts until somebody resumes the queue."""
    return rig_answer(service.rigs.pause(rig, body.reason or "an operator paused it", who=person), service)


@router.post("/{rig}/resume")
def resume(rig: str, body: Reason, service: ServiceDep, person: PersonDep) -> RigAnswer:
    """Resume its queue, after a look at the rig."""
    return rig_answer(service.rigs.resume(rig, who=person, reason=body.reason), service)


@router.post("/{rig}/reserve")
def reserve(rig: str, body: Reservation, service: ServiceDep, person: PersonDep) -> RigAnswer:
    """Reserve it for a while: until then only campaigns of the same person start."""
    who = person or body.by
    if not who:
        raise InputError("by is missing: say for whom the rig is reserved")
    return rig_answer(service.rigs.reserve(rig, who=who, for_s=body.for_s), service)


@router.post("/{rig}/release")
def release(rig: str, service: ServiceDep, person: PersonDep) -> RigAnswer:
    """End its reservation."""
    return rig_answer(service.rigs.release(rig, who=person), service)


@router.post("/{rig}/stop", status_code=202)
async def stop(rig: str, service: ServiceDep, request: Request) -> Response:
    """Stop whatever moves on it, whoever commands it; its queue pauses.

    It works without the store; this is no emergency stop: where somebody is in danger, press the button.
    """
    return await _past_layer(rig, "stop", service, request)


@router.post("/{rig}/make-safe")
async def make_safe(rig: str, service: ServiceDep, request: Request) -> Response:
    """Stop it, switch it off, and say whether it is at rest without current; also where its worker has died."""
    return await _past_layer(rig, "make-safe", service, request)


async def _past_layer(rig: str, wish: str, service: Service, request: Request) -> Response:
    """A rig that only the store knows: registered a moment ago."""
    found = (await run_in_threadpool(service.rigs.one, rig)).rig
    stops: Stops = request.app.state.stops
    asked = asyncio.run_coroutine_threadsafe(stops.rig(found.id, found.address, wish, ""), stops.loop)
    status, body = await asyncio.wrap_future(asked)  # the lines live in another loop than bodies
    if status >= 400:
        return problem(status, body["detail"], request.scope)
    return JSONResponse(body, status_code=status)


def _identity(address: str) -> Identity | None:
    """Who answers at an address; None where nobody does."""
    with suppress(TransportError), closing(connect(address)) as wire:
        return wire.identify(ASK_S)
    return None


def _check(envelope: dict[str, Any] | None, interlocks: list[str]) -> None:
    """Raise DesignError or LimitError, one line, for what cannot be used. Any: JSON."""
    if envelope is not None:
        to_spec(Envelope, envelope, "envelope")
    for text in interlocks:
        interlock(text)
