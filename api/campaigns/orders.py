"""What people ask of a campaign that runs: hold, go on, stop, abort. An end that was asked for is never taken back."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["ENDS", "Asked", "Order", "combine"]


class Asked(StrEnum):
    """What was asked last."""

    NOTHING = ""  # go on
    HOLD = "hold"  # come to rest under power, and wait
    STOP = "stop"  # come to rest, travel back to mid-stroke without current, end
    ABORT = "abort"  # come to rest, power off where the piston stands, end


ENDS = (Asked.STOP, Asked.ABORT)


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """What a worker has to do, and why where it is to end."""

    asked: Asked = Asked.NOTHING
    reason: str | None = None


def combine(asked: Asked, wish: Asked) -> Asked | None:
    """What is asked after a wish; None where it comes too late: the campaign is ending."""
    if asked not in ENDS:
        return wish
    if wish not in ENDS:
        return None
    return Asked.ABORT if Asked.ABORT in (asked, wish) else Asked.STOP
