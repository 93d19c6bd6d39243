"""Where naming breaks down: `python -m benchmarks.explain.breakdown --seeds 7000:7010 -o DIR`.

One hidden effect in each case; the same specimens at every point of every curve. Outcomes are appended to
DIR/breakdown.jsonl as they come, seed by seed; those that the file has already are not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from benchmarks.explain.judge import Outcome, judge
from benchmarks.explain.outcomes import collect, executor_for_cases, read
from benchmarks.explain.summary import CONFIDENT, right
from benchmarks.hidden import STANDARD, Conditions, OutOfReach

# The condition that is varied, its title, its values, and the value that it has in the other curves.
NOISE, RUNS, SINES, BASE = "noise", "runs", "sines only", "base error"
CURVES: dict[str, tuple[str, dict[float, Conditions]]] = {
    NOISE: (
        "noise, % of the force's rms",
        {100.0 * s: Conditions(noise_share=s) for s in (0.002, 0.01, 0.02, 0.05, 0.2)},
    ),
    RUNS: ("training runs of every kind", {**{float(n): Conditions(runs=n) for n in (1, 2, 4, 8)}, 6.0: STANDARD}),
    SINES: ("training runs, all of them sines", {float(n): Conditions(runs=n, sines_only=True) for n in (1, 2, 4, 8)}),
    BASE: ("residual of a wrong base curve, × noise", {e: Conditions(base_error=e) for e in (0.5, 1.0, 2.0, 4.0)}),
}
_COLOURS = {"right": "#1d7a45", "wrong": "#b3261e"}


def points_left(seed: int, done: Sequence[Outcome]) -> list[tuple[str, float]]:
    known = {(o["curve"], o["at"]) for o in done if o["seed"] == seed}
    return [(curve, at) for curve, (_, points) in CURVES.items() for at in points if (curve, at) not in known]


def judged(seed: int, curve: str, at: float) -> Outcome:
    """The outcome of one specimen at one point of one curve; `skipped` says why there is none."""
    try:
        return {"curve": curve, "at": at, **judge("single", seed, CURVES[curve][1][at])}
    except OutOfReach as error:
        return {"curve": curve, "at": at, "seed": seed, "true": [], "skipped": str(error)}


def in_a_line(o: Outcome) -> str:
    said = ", ".join(o.get("names", {})) or o.get("verdict") or o.get("error", "skipped")
    return f"{o['curve']} {o['at']:g}, seed {o['seed']}: {', '.join(o['true'])} → {said}"


def at_point(outcomes: Sequence[Outcome], curve: str, at: float) -> list[Outcome]:
    return [o for o in outcomes if (o["curve"], o["at"]) == (curve, at) and "skipped" not in o]


def confidently_wrong(o: Outcome) -> bool:
    return any(c >= CONFIDENT and name not in o["true"] for name, c in o.get("names", {}).items())


def share(hits: Sequence[bool]) -> tuple[float, float, float]:
    """Share of hits with its 68 % interval (Wilson)."""
    n, p = len(hits), float(np.mean(hits))
    middle, half = (p + 0.5 / n) / (1 + 1 / n), np.sqrt(p * (1 - p) / n + 0.25 / n**2) / (1 + 1 / n)
    return p, max(float(middle - half), 0.0), min(float(middle + half), 1.0)


def table(outcomes: Sequence[Outcome]) -> str:
    """A line for each point: cases, share right, share confidently wrong."""
    lines = [f"{'varied':<12}{'at':>7}{'cases':>7}{'right':>8}{'confident wrong':>17}"]
    for curve, (_, points) in CURVES.items():
        for at in sorted(points):
            these = at_point(outcomes, curve, at)
            if these:
                good, bad = (np.mean([f(o) for o in these]) for f in (right, confidently_wrong))
                lines.append(f"{curve:<12}{at:>7g}{len(these):>7}{good:>8.0%}{bad:>17.0%}")
    return "\n".join(lines)


def picture(outcomes: Sequence[Outcome]) -> go.Figure:
    """Four charts: share of cases named right, and of cases with a confident wrong name, with their intervals."""
    figure = make_subplots(rows=2, cols=2, horizontal_spacing=0.08, vertical_spacing=0.16)
    for k, (curve, (title, points)) in enumerate(CURVES.items()):
        place = {"row": k // 2 + 1, "col": k % 2 + 1}
        of = {at: at_point(outcomes, curve, at) for at in sorted(points)}
        seen = [at for at in of if of[at]]
        for name, hit, colour in (
            ("named right", right, _COLOURS["right"]),
            (f"a wrong name at confidence ≥ {CONFIDENT}", confidently_wrong, _COLOURS["wrong"]),
        ):
            values = [share([hit(o) for o in of[at]]) for at in seen]
            figure.add_trace(go.Scatter(
                x=[f"{at:g}" for at in seen], y=[100 * p for p, _, _ in values], name=name, mode="lines+markers",
                showlegend=k == 0, marker={"color": colour, "size": 9}, line={"color": colour, "width": 2.5},
                error_y={"type": "data", "symmetric": False, "thickness": 1.2, "width": 4,
                         "array": [100 * (high - p) for p, _, high in values],
                         "arrayminus": [100 * (p - low) for p, low, _ in values]}), **place)  # fmt: skip
        counts = sorted({len(of[at]) for at in seen}) or [0]
        cases = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
        figure.update_xaxes(title=f"{title} ({cases} cases a point)", type="category", **place)
        figure.update_yaxes(title="% of cases" if k % 2 == 0 else "", range=[-4, 104], **place)
    figure.update_layout(
        template="plotly_white", width=1200, height=820, margin={"t": 70, "b": 60, "l": 70, "r": 20},
        legend={"orientation": "h", "y": 1.09, "x": 0.0, "font": {"size": 15}}, font={"size": 13},
    )  # fmt: skip
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.explain.breakdown", description=__doc__)
    parser.add_argument("--seeds", default="7000:7024", help="FIRST:END")
    parser.add_argument("-o", "--output", type=Path, default=Path("bench-explain"))
    parser.add_argument("--workers", type=int, help="cases at once; without it, DAMPER_RIG_WORKERS or one a processor")
    arguments = parser.parse_args()
    path = arguments.output / "breakdown.jsonl"
    seeds = range(*(int(n) for n in arguments.seeds.split(":")))
    done = read(path)
    todo = [(seed, *point) for seed in seeds for point in points_left(seed, done)]
    with closing(executor_for_cases(arguments.workers)) as executor:
        collect(judged, todo, path, executor, in_a_line)
    outcomes = [o for o in read(path) if o["seed"] in seeds]
    print(table(outcomes))
    page = arguments.output / "breakdown.html"
    picture(outcomes).write_html(page, include_plotlyjs=True, config={"displayModeBar": False})


if __name__ == "__main__":
    main()
