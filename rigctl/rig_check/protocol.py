"""What a rig check has found: one line for each thing that was looked at."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from rigctl.transport import Identity

__all__ = ["Finding", "Protocol", "Verdict", "left_out", "noted"]


class Verdict(StrEnum):
    """What a finding means."""

    GOOD = "good"
    NOTE = "note"  # nothing to judge, or something to know
    BAD = "bad"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One line of the protocol."""

    part: str
    what: str
    found: str
    verdict: Verdict = Verdict.GOOD
    wanted: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Protocol:
    """Everything that was found on one rig; one without motion has no finding of the part ``motion``."""

    url: str
    made_at: str  # ISO 8601, UTC
    identity: Identity
    findings: tuple[Finding, ...]
    round_trips_s: NDArray[np.float64]
    operator: str = ""

    @property
    def passed(self) -> bool:
        return all(one.verdict is not Verdict.BAD for one in self.findings)

    def with_findings(self, more: tuple[Finding, ...]) -> Protocol:
        return replace(self, findings=(*self.findings, *more))


def noted(part: str, what: str, found: str) -> Finding:
    """A finding that there is nothing to judge in."""
    return Finding(part=part, what=what, found=found, verdict=Verdict.NOTE)


def left_out(why: str) -> Finding:
    """The finding that the part with motion was not done."""
    return noted("motion", "not done", why)
