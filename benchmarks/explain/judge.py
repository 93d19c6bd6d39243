"""Runs the workflow on one hidden case and compares its answer with the truth."""

from __future__ import annotations

import time
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from benchmarks.hidden import STANDARD, Case, Conditions, case
from identification.discrepancy import Explanation, explain
from identification.discrepancy.confidence import Features
from identification.discrepancy.evidence import Evidence
from identification.errors import IdentificationError
from identification.physical.model import name_of
from identification.physical.modelfile import model_from_json

Outcome = dict[str, Any]  # Any: a line of JSON


def judge(kind: str, seed: int, conditions: Conditions = STANDARD) -> Outcome:
    """Draw the case, explain it, and compare; the answer is one line of JSON."""
    hidden = case(seed, kind, conditions)
    begun, busy = time.perf_counter(), time.process_time()
    found: Explanation | IdentificationError
    try:
        found = explain(model_from_json(hidden.base_model), hidden.runs, hidden.held_out)
    except IdentificationError as error:
        found = error
    times = {"seconds": time.perf_counter() - begun, "cpu_seconds": time.process_time() - busy}
    told = {"kind": kind, "seed": seed, "runs": conditions.runs, **compared(hidden, found)}
    return told if isinstance(found, IdentificationError) else {**told, **times}


def compared(hidden: Case, found: Explanation | IdentificationError) -> Outcome:
    """What was found in a case, or why nothing was, beside what is hidden in it."""
    truth: Outcome = {
        "true": sorted(hidden.effects), "family": hidden.detail.get("family"), "unknown": hidden.detail.get("unknown"),
        "excess": hidden.excess, "mismatch": hidden.mismatch,
    }  # fmt: skip
    if isinstance(found, IdentificationError):
        return {**truth, "error": str(found)}
    return {**truth, **answer(found), "against_truth": _against_truth(found, hidden)}


def answer(found: Explanation) -> Outcome:
    """The answer of the workflow, and features of its search."""
    held = found.held_out
    return {
        "verdict": str(found.verdict),
        "names": {e.element: e.confidence for e in found.effects},
        "alternatives": {e.element: dict(e.alternatives) for e in found.effects},
        "judged": [
            *(_judged(e.evidence, stated=True) for e in found.effects if e.evidence is not None),
            *(_judged(e, stated=False) for e in found.withheld),
        ],
        "held_out": {
            "as_given": held.as_given, "base_refitted": held.base_refitted, "final": held.final,
            "noise_floor": held.noise_floor, "closed": held.closed,
        },
        "moves": [
            {
                "kind": m.kind, "name": m.name, "before": m.excess_before, "after": m.excess_after,
                "rivals": [[t.name, t.excess, t.contribution, t.parameters, t.screened] for t in m.rivals],
            }
            for m in found.moves
        ],
    }  # fmt: skip


def _judged(e: Evidence, *, stated: bool) -> Outcome:
    """A name that the search found, what spoke for it, and whether that was enough to state it."""
    return {
        "name": name_of(e.name), "stated": stated, "confidence": e.confidence, **_json_features(e.features),
        "strengths": [s if np.isfinite(s) else None for s in e.strengths], "precision": list(e.precision),
        "rivals": [[r.name, r.behind, r.finer] for r in e.rivals],
    }  # fmt: skip


def _json_features(features: Features) -> Outcome:
    """The features of a name; JSON has no infinite margin, of a name without a rival it is null."""
    return {key: value if np.isfinite(value) else None for key, value in asdict(features).items()}


def features_from_json(data: Outcome) -> Features:
    """The features of a judged name, from its line of JSON."""
    older = {"left_held_out": data["left_beside"]}  # outcomes that do not have it
    own = {f.name: data.get(f.name, older.get(f.name)) for f in fields(Features)}
    return Features(**{**own, "margin": np.inf if own["margin"] is None else own["margin"]})


def _against_truth(found: Explanation, hidden: Case) -> float:
    """Rms of the final model against the noise-free force of the held-out runs, in units of the noise."""
    held = [t for t in found.traces if t.held_out]
    errors = [np.asarray(f)[t.record.window] - t.final for t, f in zip(held, hidden.truth, strict=True)]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)) / hidden.noise_n)
