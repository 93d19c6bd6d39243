"""Sparse regression on the same cases: `python -m benchmarks.explain.sindy single:6000:6042 pair:6000:6020 -o DIR`.

PySINDy is given the same runs, the base refitted to them, and a library of the catalogue's terms (terms.py). It
selects by sequentially thresholded least squares; the threshold is that of the sparsest model whose error on runs left
out is within one standard error of the best; for comparison also the one threshold that is best in hindsight for all
cases. The effects of the remaining terms are its names. Needs pysindy (dependency group bench); outcomes are appended
to DIR/sindy.jsonl, and cases that the file has already are not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.explain.__main__ import wanted
from benchmarks.explain.judge import Outcome, judge
from benchmarks.explain.outcomes import collect, executor_for_cases, read
from benchmarks.explain.summary import CONFIDENT
from benchmarks.explain.terms import library
from benchmarks.hidden import case
from identification.discrepancy.preparation import prepared
from identification.discrepancy.signatures import tangent
from identification.fitting.leastsquares import fit_records
from identification.physical.modelfile import model_from_json
from identification.record import compact

Floats = NDArray[np.float64]

THRESHOLDS = np.geomspace(0.01, 4.0, 18)  # of the residual's rms
CASES = ("single:6000:6042", "pair:6000:6020")


def sparse(columns: Floats, target: Floats, threshold: float) -> Floats:
    """Coefficients (K,) by PySINDy's sequentially thresholded least squares."""
    import pysindy

    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=threshold, alpha=1e-6, max_iter=30),
        feature_library=pysindy.IdentityLibrary(),
    )
    model.fit(columns, t=1.0, x_dot=target[:, np.newaxis])
    return np.asarray(model.coefficients()[0], dtype=np.float64)


def selected(columns: Sequence[Floats], targets: Sequence[Floats]) -> tuple[list[NDArray[np.bool_]], int]:
    """The terms that remain at each threshold, (K,), and the threshold chosen on runs left out."""
    counts = np.array([t.size for t in targets])
    rms = np.sqrt(np.mean(np.concatenate(targets) ** 2))
    size = np.sqrt(np.mean(np.vstack(columns) ** 2, axis=0))
    size[size == 0.0] = 1.0
    parts = [_packed(c / size, t / rms) for c, t in zip(columns, targets, strict=True)]
    errors = np.array([[_left_out(parts, k, s) for k in range(len(parts))] for s in THRESHOLDS]) / counts
    errors = np.log(errors)  # so that one run on which a model diverges does not dominate
    mean, spread = errors.mean(axis=1), (errors - errors.mean(axis=0)).std(axis=1) / np.sqrt(errors.shape[1])
    best = int(np.argmin(mean))
    chosen = max(k for k in range(len(THRESHOLDS)) if mean[k] <= mean[best] + spread[best])
    return [np.abs(_solved(parts, s)) > 0.0 for s in THRESHOLDS], chosen


def _packed(columns: Floats, target: Floats) -> Floats:
    """The triangular factor of [columns, target], (K + 1, K + 1): it has the same least-squares solution."""
    return np.asarray(np.linalg.qr(np.column_stack([columns, target]), mode="r"))


def _left_out(parts: Sequence[Floats], k: int, threshold: float) -> float:
    found = _solved([part for j, part in enumerate(parts) if j != k], threshold)
    return float(np.sum((parts[k][:, -1] - parts[k][:, :-1] @ found) ** 2))


def _solved(parts: Sequence[Floats], threshold: float) -> Floats:
    """As `sparse`; zeros where every term is below the threshold."""
    import warnings

    whole = np.vstack(parts)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PySINDy warns where its threshold leaves no term: that is a valid answer here
        return sparse(whole[:, :-1], whole[:, -1], threshold)


def names_of(kind: str, seed: int) -> Outcome:
    """The names by sparse regression, plain and with the projection off the base's tangents.

    For each the names at every threshold, and the index of the chosen one.
    """
    hidden = case(seed, kind)
    model, train, _ = prepared(model_from_json(hidden.base_model), hidden.runs, hidden.held_out)
    records = [compact(r) for r in train]
    base = fit_records(model, records)
    here = tangent(base.model, records)
    terms, columns = library(base.model, records)
    ends = np.cumsum([c.shape[0] for c in columns])[:-1]
    weights = np.concatenate([np.full(c.shape[0], w) for c, w in zip(columns, here.weights, strict=True)])
    whitened = np.vstack(columns) * weights[:, np.newaxis]
    out: Outcome = {}
    for variant, matrix in (("plain", whitened), ("projected", here.project(whitened))):
        path, chosen = selected(np.split(matrix, ends), np.split(here.residual, ends))
        names = [sorted({terms[k][0] for k in np.flatnonzero(stays)}) for stays in path]
        out[variant] = {"path": names, "chosen": chosen}
    return out


def compared(kind: str, seed: int) -> Outcome:
    """The outcome of one case by the workflow and by sparse regression."""
    return {**judge(kind, seed), "sindy": names_of(kind, seed)}


def table(outcomes: Sequence[Outcome]) -> str:
    """Share of cases with the exact set of names, and with the true names somewhere in the list."""
    kinds = list(dict.fromkeys(o["kind"] for o in outcomes))
    lines = [_row("exact set / true names in the list", kinds)]
    lines.append(_row("this workflow", [_shares(outcomes, kind, _ours) for kind in kinds]))
    for variant, title in (("plain", "SINDy"), ("projected", "SINDy with our projection")):
        chosen = [_shares(outcomes, kind, partial(_sindy, variant)) for kind in kinds]
        lines.append(_row(f"{title}, threshold by cross-validation", chosen))
        exact = [sum(_sindy(variant, o, k) == o["true"] for o in outcomes) for k in range(len(THRESHOLDS))]
        tuned = [_shares(outcomes, kind, partial(_sindy, variant, k=int(np.argmax(exact)))) for kind in kinds]
        lines.append(_row(f"{title}, best threshold in hindsight", tuned))
    lines.append(_row("cases", [str(sum(o["kind"] == kind for o in outcomes)) for kind in kinds]))
    count = np.mean([len(_sindy("plain", o)) for o in outcomes])
    sure = [(n in o["true"]) for o in outcomes for n, c in o.get("names", {}).items() if c >= CONFIDENT]
    lines.append(f"SINDy gives {count:.1f} names a case")
    lines.append(f"of this workflow's names with confidence ≥ {CONFIDENT}, {sum(sure)} of {len(sure)} are right")
    return "\n".join(lines)


def _ours(o: Outcome) -> list[str]:
    return sorted(o.get("names", {}))


def _sindy(variant: str, o: Outcome, k: int | None = None) -> list[str]:
    """Names at one threshold; None: the chosen one."""
    of = o["sindy"][variant]
    found: list[str] = of["path"][of["chosen"] if k is None else k]
    return found


def _shares(outcomes: Sequence[Outcome], kind: str, names: Callable[[Outcome], list[str]]) -> str:
    these = [o for o in outcomes if o["kind"] == kind]
    exact = np.mean([names(o) == o["true"] for o in these])
    inside = np.mean([set(o["true"]) <= set(names(o)) for o in these])
    return f"{exact:.0%} / {inside:.0%}"


def _row(title: str, cells: Sequence[str]) -> str:
    return f"{title:<60}"[:60] + "".join(f"{cell:>14}" for cell in cells)


def in_a_line(o: Outcome) -> str:
    """The hidden names and those of both methods, in one line."""
    ours = ", ".join(o.get("names", {})) or o.get("verdict", o.get("error"))
    return f"{o['kind']} {o['seed']}: {', '.join(o['true'])} → {ours} | SINDy: {', '.join(_sindy('plain', o))}"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.explain.sindy", description=__doc__)
    parser.add_argument("cases", nargs="*", default=list(CASES), help="KIND:FIRST:END")
    parser.add_argument("-o", "--output", type=Path, default=Path("bench-explain"))
    arguments = parser.parse_args()
    path = arguments.output / "sindy.jsonl"
    cases = wanted(arguments.cases)
    done = {(o["kind"], o["seed"]) for o in read(path)}
    with closing(executor_for_cases(1)) as executor:
        collect(compared, [c for c in cases if c not in done], path, executor, in_a_line)
    print(table([o for o in read(path) if (o["kind"], o["seed"]) in set(cases)]))


if __name__ == "__main__":
    main()
