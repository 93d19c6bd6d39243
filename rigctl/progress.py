"""Progress of a test, for a person or a program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

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
    """One report: how far the test is, and the samples that were recorded since the report before, where there are any.

    Their numbers are those of the excitation: a report whose block does not follow the block before says that samples
    were left out.
    """

    test: str
    phase: Phase
    samples: int
    total_samples: int
    text: str = ""
    block: CaptureBlock | None = None
    sample_rate_hz: float = 0.0  # of the block
    fifo: float | None = None  # share of the rig's FIFO that is full; None: nothing is streamed


def joined(blocks: Sequence[CaptureBlock]) -> CaptureBlock | None:
    """The last of the blocks with all those before it that it continues without a gap; None where there is none."""
    if not blocks:
        return None
    first = len(blocks) - 1
    while first and blocks[first - 1].first_index + blocks[first - 1].samples == blocks[first].first_index:
        first -= 1
    return replace(blocks[first], values=np.concatenate([block.values for block in blocks[first:]]))
