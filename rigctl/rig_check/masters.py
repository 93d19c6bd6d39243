"""Whether a rig has one master: what a second host gets when it wants to command."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing, suppress
from typing import Final

from rigctl.axis import Axis
from rigctl.clock import Clock
from rigctl.errors import RequestDenied, RigError, RigOccupied, TransportError
from rigctl.procedures.station import STALL_S
from rigctl.rig_check.protocol import Finding, Verdict
from rigctl.transport import Transport

__all__ = ["one_master", "one_master_under_power"]

LET_IN: Final = "it was let in"
REFUSED: Final = "refused; it may read"


def one_master(another: Callable[[], Transport], clock: Clock) -> Finding:
    """Connect once more while this host commands: the second one may read, and must be refused."""
    return _judged(lambda: _second_host(another, clock))


def one_master_under_power(another: Callable[[], Transport], first: Transport, deadline_s: float) -> Finding:
    """The same while this host feeds the watchdog of a controller with power: no call takes over `deadline_s`."""
    return _judged(lambda: _second_host_under_power(another, first, deadline_s))


def _judged(second_host: Callable[[], str]) -> Finding:
    try:
        text, verdict = second_host(), Verdict.GOOD
    except TransportError:
        text, verdict = "not known, no answer: the wire may have a place for one host only", Verdict.NOTE
    if text == LET_IN:
        verdict = Verdict.BAD
    return Finding(
        part="one master", what="a second host wants to command", found=text, verdict=verdict, wanted="refused"
    )


def _second_host(another: Callable[[], Transport], clock: Clock) -> str:
    with closing(another()) as second:
        axis = Axis(second, clock, stall_s=STALL_S)
        axis.identify()
        axis.status()
        try:
            axis.claim()
        except RigOccupied:
            return REFUSED
        with suppress(RigError):
            axis.release()
    return LET_IN


def _second_host_under_power(another: Callable[[], Transport], first: Transport, deadline_s: float) -> str:
    with closing(another()) as second:
        try:
            for call in (second.identify, second.status, second.claim):
                first.status(deadline_s)
                call(deadline_s)
        except RequestDenied:
            return REFUSED
        finally:
            first.status(deadline_s)
    return LET_IN
