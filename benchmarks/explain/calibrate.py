"""Fit the confidence to judged names: `python -m benchmarks.explain.calibrate OUTCOMES.jsonl …`.

Reliability is shown by cross-validation, each name judged by a table that no name of its seed was fitted to, beside the
confidence that was stated when the cases were judged. `--collect KIND:FIRST:END[:RUNS]` judges cases first and appends
them to the first file; those that it has already are not run again. `--write` puts the table where `identification`
reads it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from benchmarks.explain.__main__ import in_a_line, wanted
from benchmarks.explain.judge import Outcome, features_from_json, judge
from benchmarks.explain.outcomes import collect, executor_for_cases, read
from benchmarks.explain.summary import CONFIDENT, expected_calibration_error
from benchmarks.hidden import Conditions
from benchmarks.machines.figures import right_among
from identification.criteria import FORM
from identification.discrepancy.confidence import DOUBTS, Features, Table, confidence, doubts
from identification.discrepancy.confidence_table import PATH, table_to_json

STATED = FORM.min_confidence
SURE_AND_RIGHT = 0.99  # share of the names stated as sure that is to be right
PARTS = 11  # of the cross-validation; a prime, as the kinds of specimen come in rows of seeds
_PENALTY = 1.0  # on half the squared weights of the doubts in units of their scatter: each is of the order of one

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedName:
    """A name that a search found, what spoke for it, and whether it was hidden there."""

    seed: int
    features: Features
    stated: float  # confidence when it was judged
    true: bool


def names_in(outcomes: Sequence[Outcome]) -> list[JudgedName]:
    """Every name that was judged, also those then withheld."""
    return [name for o in outcomes if "judged" in o for name in _judged_in(o)]  # without it, a refusal


def _judged_in(o: Outcome) -> list[JudgedName]:
    """The names of one case; those that only say that the curve of its base is of another form are neither."""
    found = [said["name"] for said in o["judged"]]
    machine = o.get("source") == "machine"
    true = right_among({**o, "form": []}, found) if machine else set(o["true"])
    neither = right_among(o, found) - true if machine else set()
    return [
        JudgedName(
            seed=o["seed"],
            features=features_from_json(said),
            stated=said["confidence"],
            true=said["name"] in true,
        )
        for said in o["judged"]
        if said["name"] not in neither
    ]


def fitted(names: Sequence[JudgedName], penalty: float = _PENALTY) -> Table:
    """The table with the largest likelihood of what was true, less the penalty on its weights; no weight below zero."""
    against = np.array([[doubts(n.features)[d] for d in DOUBTS] for n in names])
    scale = np.maximum(against.std(axis=0), 1e-9)
    sign = np.where([n.true for n in names], 1.0, -1.0)

    def loss(p: Floats) -> tuple[float, Floats]:
        odds = sign * (p[0] - (against / scale) @ p[1:])
        slope = -sign * np.exp(-np.logaddexp(0.0, odds))
        value = np.sum(np.logaddexp(0.0, -odds)) + 0.5 * penalty * np.sum(p[1:] ** 2)
        return float(value), np.concatenate([[slope.sum()], -(against / scale).T @ slope + penalty * p[1:]])

    bounds = [(None, None), *[(0.0, None)] * len(DOUBTS)]
    best = minimize(loss, np.zeros(1 + len(DOUBTS)), jac=True, method="L-BFGS-B", bounds=bounds)
    weights = dict(zip(DOUBTS, (best.x[1:] / scale).tolist(), strict=True))
    free = Table(
        without_doubt=float(best.x[0]), weights=weights, most=(1.0, 1.0), sure_from=CONFIDENT, names=len(names)
    )
    one, two = (_borne_out([n for n in names if n.features.runs <= runs], free) for runs in (1, 2))
    limited = replace(free, most=(min(one, two), two))
    return replace(limited, sure_from=_sure_from(names, limited))


def _borne_out(names: Sequence[JudgedName], table: Table) -> float:
    """The most that so many names can bear out: (right + 1)/(stated + 2), Laplace's rule of succession."""
    stated = [n.true for n in names if confidence(n.features, table) >= STATED]
    return (sum(stated) + 1) / (len(stated) + 2)


def _sure_from(names: Sequence[JudgedName], table: Table) -> float:
    """The least confidence of 0.9 or more from which nearly all names are right; 1 where there is none."""
    said = np.array([confidence(n.features, table) for n in names])
    order = np.argsort(-said)
    share = np.cumsum([names[k].true for k in order]) / np.arange(1, len(names) + 1)
    enough = said[order][(share >= SURE_AND_RIGHT) & (said[order] >= CONFIDENT)]
    return float(min(enough, default=1.0))


def reliability(confidences: Sequence[float], true: Sequence[bool]) -> str:
    """Names stated and sure, how many of them are right, expected calibration error and Brier score, in a line."""
    c, ok = np.array(confidences), np.array(true)
    said, sure = c >= STATED, c >= CONFIDENT
    brier = float(np.mean((c - ok) ** 2))
    error = expected_calibration_error(c.tolist(), ok.tolist())
    counts = f"{int(ok[said].sum()):>5} of {int(said.sum()):<5}{int(ok[sure].sum()):>5} of {int(sure.sum()):<5}"
    return f"{counts}{error:>8.3f}{brier:>8.4f}"


def left_out(names: Sequence[JudgedName]) -> list[float]:
    """Confidence of every name by a table that was fitted to the other parts; the names of one seed are one part's."""
    parts = [n.seed % PARTS for n in names]
    tables = [fitted([n for n, part in zip(names, parts, strict=True) if part != k]) for k in range(PARTS)]
    return [confidence(n.features, tables[part]) for n, part in zip(names, parts, strict=True)]


def shown(names: Sequence[JudgedName]) -> str:
    """Reliability of the confidence that was stated, and of tables that were fitted without each name."""
    true = [n.true for n in names]
    lines = [f"{f'{sum(true)} of {len(true)} true':<24}{'right, stated':>14}{'right ≥ 0.9':>14}{'ECE':>8}{'Brier':>8}"]
    for how, values in (("as stated", [n.stated for n in names]), ("cross-validated", left_out(names))):
        lines.append(f"{how:<24}{reliability(values, true)}")
    return "\n".join(lines)


def _case(o: Outcome) -> tuple[str, int, int | None]:
    return o["kind"], o["seed"], o.get("runs")


def cases_of(texts: Sequence[str]) -> list[tuple[str, int, Conditions]]:
    """Kind, seed and conditions of every case that `KIND:FIRST:END[:RUNS]` asks for."""
    cases = []
    for text in texts:
        kind, first, end, *runs = text.split(":")
        conditions = Conditions(runs=int(runs[0]) if runs else None)
        cases += [(kind, seed, conditions) for kind, seed in wanted([f"{kind}:{first}:{end}"])]
    return cases


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.explain.calibrate", description=__doc__)
    parser.add_argument("outcomes", nargs="+", type=Path, help="a line of JSON a case, compressed where it ends in .gz")
    parser.add_argument(
        "--collect", action="append", default=[], metavar="CASES", help="KIND:FIRST:END[:RUNS], judged first"
    )
    parser.add_argument("--workers", type=int, help="cases at once; without it, DAMPER_RIG_WORKERS or one a processor")
    parser.add_argument("--write", action="store_true", help=f"write the table to {PATH.name} beside confidence.py")
    arguments = parser.parse_args()
    first = arguments.outcomes[0]
    done = {_case(o) for o in read(first)}
    todo = [c for c in cases_of(arguments.collect) if (c[0], c[1], c[2].runs) not in done]
    if todo:
        with closing(executor_for_cases(arguments.workers)) as executor:
            collect(judge, todo, first, executor, in_a_line)
    every = {_case(o): o for path in reversed(arguments.outcomes) for o in read(path)}  # the first file counts
    names = names_in(list(every.values()))
    table = fitted(names)
    print(shown(names))
    print("at most {:.2f} from one run, {:.2f} from two".format(*table.most))
    print(f"sure from {table.sure_from:.3f}")
    print(f"log odds without a doubt {table.without_doubt:.2f}; weights of the doubts:")
    print("\n".join(f"  {name:<20}{weight:.3f}" for name, weight in table.weights.items()))
    if arguments.write:
        PATH.write_text(json.dumps(table_to_json(table), indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
