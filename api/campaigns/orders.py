"""What can be requested of a running campaign: hold, resume, stop, abort. A stop or an abort cannot be withdrawn."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["ENDS", "Asked", "Order", "combine"]


class Asked(StrEnum):
    """The last request."""

    NOTHING = ""  # resume
    HOLD = "hold"  # come to rest under power, and wait
    STOP = "stop"  # come to rest, travel back to mid-stroke without current, end
    ABORT = "abort"  # come to rest, power off where the piston stands, end


ENDS = (Asked.STOP, Asked.ABORT)


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """What a worker has to do; the reason where the campaign must end."""

    asked: Asked = Asked.NOTHING
    reason: str | None = None


def combine(asked: Asked, wish: Asked) -> Asked | None:
    """The request that holds after a new one; None where it comes too late, because the campaign is ending."""
    if asked not in ENDS:
        return wish
    if wish not in ENDS:
        return None
    return Asked.ABORT if Asked.ABORT in (asked, wish) else Asked.STOP
