"""What a laboratory may change in how a test is played."""

from __future__ import annotations

from dataclasses import dataclass

from excitation.rig import Envelope
from rigctl.errors import LimitError
from rigctl.interlocks import Interlock
from rigctl.limits import Limits

__all__ = ["PlayerSettings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayerSettings:
    """Times and limits that a laboratory may change."""

    ramp_s: float = 1.0
    settle_s: float = 0.0  # at full amplitude before recording; periodic excitations only
    limits: Limits | None = None  # tighter than the machine's
    envelopes: tuple[Envelope, ...] = ()  # of the rig and of the specimen
    watchdog_s: float = 1.0  # the rig stops when it has not heard from this computer for so long
    link_patience_s: float = 2.0  # an exchange is repeated for so long
    stall_s: float = 5.0  # without any progress of the rig
    gate_s: float = 3600.0  # of the rig's time, for the temperature gate and for an interlock that holds
    interlocks: tuple[Interlock, ...] = ()
    report_s: float = 0.1
    poll_s: float = 0.01

    def __post_init__(self) -> None:
        if not 0 < self.ramp_s < 3600:
            raise LimitError(f"ramp is {self.ramp_s} s: it must lie above 0 and below 3600")
        if not 0 <= self.settle_s < 3600:
            raise LimitError(f"settle is {self.settle_s} s: it must lie in 0 … 3600")
        if not 0.25 <= self.watchdog_s <= 10:
            raise LimitError(f"watchdog is {self.watchdog_s} s: it must lie in 0.25 … 10")
