"""The part of a rig check with power: one millimetre, a stop on the way, and a host that falls silent.

The movements are those of work near a person: a jog at low pressure where the rig has it, else a travel at 10 mm/s at
most. A controller of another make without low pressure travels by its own positioning.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from rigctl.axis import UNPOWERED
from rigctl.clock import Clock
from rigctl.device import Fault, PressureStage, RigState, describe
from rigctl.errors import TransportError
from rigctl.limits import Configuration
from rigctl.procedures.station import Station, powered
from rigctl.rig_check.masters import one_master_under_power
from rigctl.rig_check.protocol import Finding, Verdict, noted
from rigctl.transport import Identity, Status, Transport
from rigctl.wire_rate import CALL_S

__all__ = ["check_in_motion"]

MOVE_M: Final = 1e-3
REACHED_M: Final = 1e-4  # between where the piston is and where it was asked to be, at rest
ON_THE_WAY_M: Final = 0.25e-3  # the piston has begun to move, and most of the way is left
BEGIN_S: Final = 2.0  # until then; at 10 mm/s it takes 0.1 s
STOP_S: Final = 1.4  # from a stop to rest without power
LOOK_S: Final = 0.005
SETTLED_S: Final = 0.025
SILENCE: Final = 2.0  # of the watchdog's time


def check_in_motion(
    transport: Transport, clock: Clock, *, another: Callable[[], Transport] | None = None, watchdog: bool = True
) -> tuple[Finding, ...]:
    """Move the piston by a millimetre and back, stop it on the way, and let the host fall silent under power.

    `another` connects once more, as a second host would: a controller of another make is asked for its one master
    here, because it refuses another host only while it has power. Where `watchdog`, the rig ends with its watchdog's
    fault latched: an operator resets it. Without, that part is left out.
    """
    found: list[Finding] = []
    with powered(transport, clock) as station:
        found.append(noted("motion", "pressure", _pressure(station)))
        if station.identity.foreign and another is not None:
            found.append(one_master_under_power(another, transport, min(CALL_S, station.identity.watchdog_s / 2)))
        found += _moved(station)
        found += _stopped_on_the_way(station, transport)
    if watchdog:
        found += _watchdog(transport, clock, station.identity)
    return tuple(found)


def _pressure(station: Station) -> str:
    low = station.identity.low_pressure
    if station.stage is PressureStage.LOW and low is not None:
        return f"low: {1e3 * low.velocity_m_s:g} mm/s, {low.force_n:g} N"
    speed = "the controller's own speed of positioning" if station.identity.foreign else "10 mm/s"
    return f"full, the rig has no low pressure; {speed}"


def _moved(station: Station) -> list[Finding]:
    """A millimetre towards mid-stroke, and back."""
    start = station.axis.status().displacement_m
    found = []
    for what, to in (("moves by 1 mm", _inwards(start)), ("comes back", start)):
        began = station.clock.now()
        status = station.move(to, lambda: False)
        off = status.displacement_m - to
        found.append(
            Finding(
                part="motion",
                what=what,
                found=f"{1e3 * off:+.3f} mm off after {station.clock.now() - began:.2f} s, {status.force_n:.0f} N",
                verdict=Verdict.GOOD if abs(off) <= REACHED_M else Verdict.BAD,
                wanted=f"within {1e3 * REACHED_M:g} mm",
            )
        )
    return found


def _inwards(start_m: float) -> float:
    return start_m - MOVE_M if start_m > 0 else start_m + MOVE_M


def _stopped_on_the_way(station: Station, transport: Transport) -> list[Finding]:
    """A stop that comes while the piston travels."""
    start = station.axis.status().displacement_m
    if not _begins_to_move(station, transport, start):
        found, verdict = f"it did not move within {BEGIN_S:g} s", Verdict.BAD
    else:
        took, status = _stop(station, transport)
        station.clock.sleep(SETTLED_S)
        went = abs(transport.status(CALL_S).displacement_m - start)
        found = f"at rest without power after {took:.2f} s, {1e3 * went:.3f} mm on"
        found = found if _rests(status) else status.state.name
        good = _rests(status) and took <= STOP_S and went <= MOVE_M + REACHED_M
        verdict = Verdict.GOOD if good else Verdict.BAD
        if good and went > MOVE_M - REACHED_M:
            found, verdict = f"{found}: not known, it had arrived before the stop reached it", Verdict.NOTE
    return [
        Finding(
            part="motion", what="a stop while it moves", found=found, verdict=verdict, wanted=f"within {STOP_S:g} s"
        )
    ]


def _begins_to_move(station: Station, transport: Transport, start_m: float) -> bool:
    """Ask for a millimetre, and return True as soon as the piston is on its way; False after BEGIN_S."""
    to, began, low = _inwards(start_m), station.clock.now(), station.stage is PressureStage.LOW
    status = transport.jog(to, CALL_S) if low else transport.direct(to, 0.0, CALL_S)
    while abs(status.displacement_m - start_m) < ON_THE_WAY_M:
        if station.clock.now() - began > BEGIN_S:
            return False
        station.clock.sleep(LOOK_S)
        status = transport.jog(to, CALL_S) if low else transport.status(CALL_S)
    return True


def _stop(station: Station, transport: Transport) -> tuple[float, Status]:
    """Stop, and return the seconds until the piston rests without power, with the last status.

    A rig of our own does all of it after one request. A controller of another make has two: one that stops, and,
    once it is at rest, one that switches off; its transport sends the one that is due.
    """
    again = transport.stop if station.identity.foreign else transport.status
    began, status = station.clock.now(), transport.stop(CALL_S)
    while not _rests(status) and station.clock.now() - began < 2 * STOP_S:
        station.clock.sleep(LOOK_S)
        with suppress(TransportError):
            status = again(CALL_S)
    return station.clock.now() - began, status


def _rests(status: Status) -> bool:
    return status.state in UNPOWERED and status.arrived


def _watchdog(transport: Transport, clock: Clock, identity: Identity) -> list[Finding]:
    """Under power at rest, a host that falls silent; the status that is read afterwards comes too late to feed it."""
    silent_s = SILENCE * (identity.watchdog_s or Configuration().heartbeat_s)
    with powered(transport, clock):
        clock.sleep(silent_s)
        status = transport.status(CALL_S)
    if identity.foreign:
        acted, wanted = status.state.faulted or status.state in UNPOWERED, f"by its map: {identity.watchdog}"
    else:
        acted = status.state.faulted and Fault.HEARTBEAT in status.faults
        wanted = f"{RigState.FAULT_HOLD.name} or without power, the heartbeat's fault latched"
    return [
        Finding(
            part="motion",
            what=f"the host is silent for {silent_s:g} s under power",
            found=f"{status.state.name}: {describe(status.faults, status.detector) or 'no fault'}",
            verdict=Verdict.GOOD if acted else Verdict.BAD,
            wanted=wanted,
        )
    ]
