"""The same measurement in another shape: halves, other runs held out, half the rate, other units of force.

An answer that changes with them is not stable.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rigctl.runfile import Run

VARIANTS = ("first halves", "second halves", "other held out", "half the rate", "force × 1000")

# Parameters of the given models that are forces, or forces for a motion.
FORCES = frozenset(("c", "c_control", "F1", "F2", "d", "c1", "c2", "f_r", "c_soft", "c_firm", "alpha", "alpha_control",
                    "k", "F0", "m"))  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """What the workflow is asked: a model, runs, and runs that no fit may see (None: it chooses)."""

    model: Mapping[str, Any]
    runs: tuple[Run, ...]
    held_out: tuple[Run, ...] | None


def variant(question: Question, name: str) -> Question | None:
    """The question in another shape; None where it has none."""
    if name in ("first halves", "second halves"):
        return _of_runs(question, lambda run: _half(run, second=name.startswith("second")))
    if name == "half the rate":
        return _of_runs(question, _half_rate)
    if name == "other held out":
        return _other_held(question)
    if name == "force × 1000":
        scaled = _of_runs(question, lambda run: _times(run, 1000.0))
        return replace(scaled, model=_model_times(question.model, 1000.0))
    raise ValueError(f"variant is {name!r}: it must be one of {', '.join(VARIANTS)}")


def _of_runs(question: Question, change: Any) -> Question:  # Any: a function of a run
    held = None if question.held_out is None else tuple(change(r) for r in question.held_out)
    return replace(question, runs=tuple(change(r) for r in question.runs), held_out=held)


def _part(run: Run, part: slice, rate: float) -> Run:
    return replace(
        run, sample_rate_hz=run.sample_rate_hz * rate, channels={n: v[part] for n, v in run.channels.items()}, path=None
    )


def _half(run: Run, *, second: bool) -> Run:
    middle = run.samples // 2
    return _part(run, slice(middle, None) if second else slice(0, middle), 1.0)


def _half_rate(run: Run) -> Run:
    return _part(run, slice(None, None, 2), 0.5)


def _other_held(question: Question) -> Question | None:
    """The first training run changes places with the first that is held out."""
    if not question.held_out or len(question.runs) < 3:
        return None
    first, *rest = question.runs
    return replace(question, runs=(question.held_out[0], *rest), held_out=(first, *question.held_out[1:]))


def _times(run: Run, factor: float) -> Run:
    return replace(run, channels={n: v * factor if n == "force" else v for n, v in run.channels.items()}, path=None)


def _model_times(model: Mapping[str, Any], factor: float) -> Mapping[str, Any]:
    paths = {
        path: [
            {**e, "parameters": {n: _number_times(n, v, factor) for n, v in e["parameters"].items()}} for e in elements
        ]
        for path, elements in model["paths"].items()
    }
    return {**model, "paths": paths}


def _number_times(name: str, value: Any, factor: float) -> Any:  # Any: a number or an object, as in the contract
    if name not in FORCES:
        return value
    return {**value, "value": value["value"] * factor} if isinstance(value, dict) else value * factor


def runs_of(question: Question) -> Sequence[Run]:
    """All runs."""
    return (*question.runs, *(question.held_out or ()))
