"""Acts of an operator on a rig: look, stop, reset. No program does any of them on its own (ISO 13850, ISO 12100)."""

from __future__ import annotations

from contextlib import suppress
from typing import Protocol

from rigctl.axis import UNPOWERED, Axis, latched
from rigctl.clock import Clock, SystemClock
from rigctl.device import RigState, describe
from rigctl.errors import RigError, StopFailed, TransportError
from rigctl.transport import Capability, Identity, Status, Transport

__all__ = ["Person", "ask_to_start", "in_words", "latched", "look", "reset", "stop"]

CALL_S = 0.25
REST_S = 5.0  # a stop from full speed takes 1.4 s at most; a rig whose clock waits for its host moves on with each look
POLL_S = 0.02

_STATES = {
    RigState.INIT: "starting",
    RigState.DISABLED: "without power",
    RigState.HOLD: "under power",
    RigState.ACTIVE: "under power, follows set-points",
    RigState.FAULT_DISABLED: "without power after a fault",
    RigState.FAULT_HOLD: "under power after a fault",
    RigState.FAULT_REACTION: "decelerates after a fault",
}


class Person(Protocol):
    """Somebody who answers for the rig."""

    @property
    def is_there(self) -> bool:
        """Whether they can be asked."""
        ...

    def confirm(self, text: str) -> None:
        """Return when they say yes; Declined otherwise."""
        ...


def ask_to_start(transport: Transport, person: Person, what: str, *, clock: Clock | None = None) -> Identity:
    """Return who the rig is, once a person has said that it may move; a simulated rig needs no word.

    A latched fault is shown, and reset only where the person says so; without a person it stays.

    Raises
    ------
    NeedsReset
        When a fault is latched and nobody is there to reset it.
    Declined
        When the person does not say yes, or nobody can be asked.
    """
    identity, status = look(transport, clock)
    if (needs_reset := latched(transport.url, status)) is not None:
        if not person.is_there:
            raise needs_reset
        person.confirm(f"{transport.url}: {in_words(status)}. Is the cause gone, and may the rig be reset?")
        reset(transport, clock)
    if Capability.SIMULATED not in identity.capabilities:
        person.confirm(
            f"{transport.url}: {identity.model} {identity.serial}, {in_words(status)}. "
            f"{what}: is everybody out of its reach, and may it move now?"
        )
    return identity


def look(transport: Transport, clock: Clock | None = None) -> tuple[Identity, Status]:
    """Return who the rig is and what it says of itself; nothing is commanded and no watchdog fed."""
    axis = Axis(transport, clock or SystemClock(), stall_s=REST_S)
    return axis.identify(), axis.status()


def stop(transport: Transport, clock: Clock | None = None) -> Status:
    """Stop the rig, whoever commands it, and wait until it is at rest without power; return its status.

    Raises
    ------
    StopFailed
        When the rig does not say within REST_S that its power is off.
    """
    clock = clock or SystemClock()
    ends, last = clock.now() + REST_S, "it keeps moving"
    while clock.now() < ends:
        try:
            status = transport.stop(CALL_S)
            if status.state in UNPOWERED:
                return status
            last = f"it is in {status.state.name}"
        except TransportError as error:
            last = str(error)
        clock.sleep(POLL_S)
    raise StopFailed(
        f"{transport.url}: the stop was not acknowledged within {REST_S:g} s, the rig may still be powered ({last})"
    )


def reset(transport: Transport, clock: Clock | None = None) -> Status:
    """Reset a latched fault; the rig is without power afterwards, and nothing has moved.

    Raises
    ------
    RigFault
        When the cause persists.
    RigOccupied
        When another host commands the rig.
    """
    axis = Axis(transport, clock or SystemClock(), stall_s=REST_S)
    axis.identify()
    axis.claim()
    try:
        return axis.reset()
    finally:
        with suppress(RigError):  # else the rig ends the session itself, once this host is silent
            axis.release()


def in_words(status: Status) -> str:
    """Return in one line what the rig says of itself, and no more."""
    faults = describe(status.faults, status.detector)
    master = f", commanded by {'a host' if status.session else 'nobody'}"
    if status.state.faulted:  # a rig with a latched fault obeys no host, whoever had it last
        master = ""
    rest = "" if status.arrived else ", moving"
    return f"{_STATES[status.state]} ({status.state.name}){rest}{master}{', latched: ' + faults if faults else ''}"
