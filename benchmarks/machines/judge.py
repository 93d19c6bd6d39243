"""Asks the workflow about one case, and once more with what it found as its base; keeps everything that it said."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from benchmarks.explain.judge import answer
from benchmarks.machines.case import Case, case
from benchmarks.machines.injection import injected
from benchmarks.machines.kinds import KINDS
from benchmarks.machines.measured import MeasuredSet, measured_sets
from benchmarks.machines.storage import truth_of
from benchmarks.machines.variants import Question, variant
from identification.discrepancy import Explanation, explain
from identification.errors import IdentificationError
from identification.physical.modelfile import model_from_json, model_to_json

Outcome = dict[str, Any]  # Any: a line of JSON


def judge(
    seed: int,
    kinds: Sequence[str] = tuple(KINDS),
    again: bool = True,
    variants: Sequence[str] = (),
    beside: bool = False,
) -> Outcome:
    """Draw the case of a seed, explain it, and say what was hidden beside what was said."""
    begun = time.perf_counter()
    made = case(seed, kinds, beside)
    drawn = time.perf_counter() - begun
    question = question_of(made)
    outcome, found = asked(question)
    outcome = {"source": "machine", **truth_of(made), "drawn_seconds": drawn, **outcome}
    if found is not None and again:
        outcome["again"] = asked_again(question, found)
    outcome["variants"] = {v: names_of(variant(question, v)) for v in variants}
    return outcome


@lru_cache(maxsize=1)
def _sets(folder: str) -> list[MeasuredSet]:
    return measured_sets(Path(folder))


def judge_injection(seed: int, folder: str, again: bool = False) -> Outcome:
    """Explain measured runs as they are and with a known effect; names that the machine itself has are `own`."""
    made = injected(seed, _sets(folder))
    hidden = {**asdict(made.hidden), "excess": min(made.hidden.excess, 1e9), "identifiable": made.identifiable}
    outcome: Outcome = {
        "source": "injection", "seed": seed, "kind": made.source, "hidden": [hidden], "form": [],
        "identifiable": made.identifiable, "gain": made.gain, "left_n": made.left_n, "noise_n": made.noise_n,
        "base": [e["element"] for e in made.base_model["paths"]["core"]], "runs": len(made.runs), "detail": {},
    }  # fmt: skip
    question = Question(model=made.base_model, runs=made.runs, held_out=made.held_out)
    said, found = asked(question)
    outcome |= said
    outcome["own"] = names_of(replace(question, runs=made.own_runs, held_out=made.own_held))
    if found is not None and again:
        outcome["again"] = asked_again(question, found)
    return outcome


def question_of(made: Case) -> Question:
    """What the workflow is given of a case."""
    if made.own_choice:
        return Question(model=made.base_model, runs=(*made.runs, *made.held_out), held_out=None)
    return Question(model=made.base_model, runs=made.runs, held_out=made.held_out)


def asked(question: Question) -> tuple[Outcome, Explanation | None]:
    """The answer as a line of JSON; or the refusal, and None."""
    begun, busy = time.perf_counter(), time.process_time()
    try:
        found = explain(model_from_json(dict(question.model)), question.runs, question.held_out)
    except IdentificationError as error:
        return {"error": str(error), "seconds": time.perf_counter() - begun}, None
    times = {"seconds": time.perf_counter() - begun, "cpu_seconds": time.process_time() - busy}
    return {**answer(found), "notes": list(found.notes), "remainder": found.remainder, **times}, found


def asked_again(question: Question, found: Explanation) -> Outcome:
    """Names and verdict with the found model as the base."""
    model = model_to_json(found.model)
    return names_of(Question(model=model, runs=question.runs, held_out=question.held_out))


def names_of(question: Question | None) -> Outcome:
    """Names and verdict alone; empty where there is no question."""
    if question is None:
        return {}
    said, _ = asked(question)
    return {key: said[key] for key in ("verdict", "names", "error", "seconds") if key in said}
