"""Progress of a test, for a person or a program."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from rigctl.transport import CaptureBlock


class Phase(StrEnum):
    """Phase of a test; the words are those of commercial controllers."""

    CONNECTING = "connecting"
    WAITING = "waiting"  # for the temperature gate, or dwelling
    STARTING = "starting"
    RUNNING = "running"
    HOLDING = "holding"  # coming to rest
    HOLD = "hold"
    RESUMING = "resuming"
    STOPPING = "stopping"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """One report: how far the test is, and the latest captured samples where there are any."""

    test: str
    phase: Phase
    samples: int
    total_samples: int
    text: str = ""
    block: CaptureBlock | None = None
