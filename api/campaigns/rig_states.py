"""What is known of a rig, in one word and one line, and no more."""

from __future__ import annotations

from enum import StrEnum

from rigctl.axis import UNPOWERED
from rigctl.operator_acts import in_words
from rigctl.progress import Phase
from rigctl.transport import Status

__all__ = ["Known", "after_look", "while_playing"]


class Known(StrEnum):
    """The states of a rig; none of them says more than somebody has seen."""

    UNKNOWN = "unknown"  # nobody has asked it since its worker started or died
    UNREACHABLE = "unreachable"  # it was asked and did not answer
    FREE = "free"  # without power, commanded by nobody
    RUNNING = "running"  # a campaign of this service commands it
    HOLDING = "holding"  # a hold was asked for: the piston still moves
    HELD = "held"  # the piston rests
    STOPPING = "stopping"  # a stop was asked for: the rig has not said that it is off
    OCCUPIED = "occupied"  # another host commands it
    POWERED = "powered, unattended"  # it has power, and nobody commands it
    FAULT = "latched fault"  # until an operator resets it
    OTHER = "another rig"  # another rig answers at its address
    OUT_OF_SERVICE = "out of service"


def after_look(status: Status) -> tuple[Known, str]:
    """What a rig that no campaign commands says of itself."""
    powered = status.state not in UNPOWERED
    if status.state.faulted or status.faults:
        return (Known.POWERED if powered else Known.FAULT), in_words(status)
    if status.session:
        return Known.OCCUPIED, in_words(status)
    return (Known.POWERED if powered else Known.FREE), in_words(status)


def while_playing(phase: Phase, *, hold_asked: bool, end_asked: bool) -> Known:
    """What the worker that plays a campaign knows."""
    if end_asked or phase is Phase.STOPPING:
        return Known.STOPPING
    if phase is Phase.HOLD:
        return Known.HELD
    if hold_asked or phase is Phase.HOLDING:
        return Known.HOLDING
    return Known.RUNNING
