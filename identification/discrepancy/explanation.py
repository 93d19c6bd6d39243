"""What the workflow answers: verdict, effects with their evidence, gaps step by step, and the next test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.criteria import CHANCE
from identification.discrepancy.aliases import aliases
from identification.discrepancy.evidence import Evidence
from identification.discrepancy.naming import Compared, Move
from identification.discrepancy.where import Region
from identification.fitting.leastsquares import Fit
from identification.physical.model import Model
from identification.record import Record
from identification.report.page_data import Profile

Floats = NDArray[np.float64]


class Verdict(StrEnum):
    """How the gap ended."""

    NO_DISCREPANCY = "no_discrepancy"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    UNKNOWN_EFFECT = "unknown_effect"


@dataclass(frozen=True, slots=True, kw_only=True)
class Gaps:
    """rms of measured minus simulated force at each step, N, and what no model can explain."""

    as_given: float
    base_refitted: float
    final: float
    noise_floor: float

    @property
    def closed(self) -> float | None:
        """Share of the reducible gap that the names closed; None where there was nothing to close."""
        reducible = self.base_refitted - self.noise_floor
        if reducible <= CHANCE.at_noise * self.noise_floor:
            return None
        return (self.base_refitted - self.final) / reducible


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One named effect."""

    element: str
    path: str
    confidence: float
    parameters: Mapping[str, tuple[float, float | None, str]]  # name → value, standard deviation, unit
    alternatives: tuple[tuple[str, float], ...]
    gap_before: float  # N rms on the training runs, with every other name but this
    gap_after: float  # N rms, with all
    evidence: Evidence | None


@dataclass(frozen=True, slots=True, kw_only=True)
class NextTest:
    """The test that would tell the best explanation from its best rival, ready to be scheduled."""

    text: str = ""
    design: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Traces:
    """One held-out or training record with the simulated forces of each step, (M,) each, N."""

    record: Record
    as_given: Floats
    refitted: Floats
    final: Floats
    held_out: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Distortion:
    """Force and gap by kind before any model, N rms: what is odd, what is even, what is noise."""

    runs: tuple[str, ...]  # that tell it
    force: Mapping[str, float]  # rms, linear, odd, even, noise
    gap: Mapping[str, float]  # of the refitted base: odd, even, offset, noise
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Explanation:
    """Everything that `explain` found; `report_data` turns it into the JSON of report.json."""

    verdict: Verdict
    effects: tuple[Effect, ...]
    withheld: tuple[Evidence, ...]  # for names that the search found and that were too unlikely to state
    train: Gaps
    held_out: Gaps
    where: tuple[Region, ...]
    profiles: tuple[Profile, ...]
    repeatable: bool
    remainder: str
    next_test: NextTest
    given: Model
    base: Fit
    model: Model
    moves: tuple[Move, ...]
    compared: Mapping[str, Compared]
    traces: tuple[Traces, ...]
    notes: tuple[str, ...]
    findings: tuple[str, ...]  # of the checks of the data; the notes hold them too
    distortion: Distortion | None = None  # None where no run tells odd from even


def report_data(e: Explanation) -> dict[str, Any]:
    """The content of report.json: plain numbers and text, nothing that JSON can't hold."""
    return {
        "format": "damper-rig/discrepancy-report",
        "format_version": 1,
        "verdict": str(e.verdict),
        "effects": [_effect_data(f) for f in e.effects],
        "gap": {"unit": "N", "train": _gap_data(e.train), "held_out": _gap_data(e.held_out, closed=True)},
        "where": [
            {
                "variable": r.variable,
                "low": r.low,
                "high": r.high,
                "unit": r.unit,
                "share_of_gap": r.share_of_gap,
                "runs": list(r.runs),
                "text": r.text,
            }
            for r in e.where
        ],
        "remainder": {"repeatable": e.repeatable, "text": e.remainder},
        "next_test": {"text": e.next_test.text, "design": dict(e.next_test.design)},
        "runs": {
            "train": [t.record.name for t in e.traces if not t.held_out],
            "held_out": [t.record.name for t in e.traces if t.held_out],
        },
        "distortion": None if e.distortion is None else asdict(e.distortion),
        "notes": [*e.notes, *aliases([f.element for f in e.effects])],
    }


def _effect_data(f: Effect) -> dict[str, Any]:
    return {
        "element": f.element,
        "path": f.path,
        "confidence": f.confidence,
        "parameters": {
            name: {"value": value, "std": std, "unit": unit} for name, (value, std, unit) in f.parameters.items()
        },
        "alternatives": [{"element": n, "confidence": c} for n, c in f.alternatives],
        "gap_before": f.gap_before,
        "gap_after": f.gap_after,
    }


def _gap_data(g: Gaps, *, closed: bool = False) -> dict[str, float | None]:
    data: dict[str, float | None] = {
        "as_given": g.as_given,
        "base_refitted": g.base_refitted,
        "final": g.final,
        "noise_floor": g.noise_floor,
    }
    if closed:
        data["closed"] = g.closed
    return data


def gaps_of(traces: Sequence[Traces]) -> Gaps:
    """Gaps over the records of some traces."""
    samples = sum(t.record.measured.size for t in traces)

    def rms(forces: Sequence[Floats]) -> float:
        total = sum(float(np.sum((t.record.measured - f) ** 2)) for t, f in zip(traces, forces, strict=True))
        return float(np.sqrt(total / samples))

    floor = float(np.sqrt(sum(t.record.sigma**2 * t.record.measured.size for t in traces) / samples))
    return Gaps(
        as_given=rms([t.as_given for t in traces]),
        base_refitted=rms([t.refitted for t in traces]),
        final=rms([t.final for t in traces]),
        noise_floor=floor,
    )
