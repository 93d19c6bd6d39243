"""Summary of many outcomes: goals, calibration of the confidence, confusion of names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from benchmarks.explain.judge import Outcome

CONFIDENT = 0.9


def right(o: Outcome) -> bool:
    """Whether the verdict and the set of names are those of the truth.

    Where only the base's curve or gain is wrong, it is right to state no name with confidence.
    """
    names = o.get("names")
    if names is None:
        return False
    if o["kind"] in ("wrong_base", "gain_drift"):
        return not any(c >= CONFIDENT for c in names.values())
    if o["kind"] == "unknown":
        return o["verdict"] in ("unknown_effect", "partly_explained") and not any(
            c >= CONFIDENT for c in names.values()
        )
    if o["kind"] == "null":
        return not names and o["verdict"] == "no_discrepancy"
    return sorted(names) == o["true"]


def statements(outcomes: Sequence[Outcome]) -> tuple[list[float], list[bool]]:
    """Confidence of every name in the reports, and whether it was right."""
    pairs = [(c, n in o["true"]) for o in outcomes for n, c in o.get("names", {}).items()]
    return [c for c, _ in pairs], [ok for _, ok in pairs]


def calibration_error(outcomes: Sequence[Outcome], bins: int = 10) -> float:
    """Expected calibration error over the names in the reports."""
    return expected_calibration_error(*statements(outcomes), bins)


def expected_calibration_error(confidences: Sequence[float], rights: Sequence[bool], bins: int = 10) -> float:
    """Σ nₖ/n·|mean confidence − share right| over equal bins of confidence; nan without a name."""
    confidence, ok = np.array(confidences), np.array(rights)
    if confidence.size == 0:
        return float("nan")
    at = np.minimum((confidence * bins).astype(int), bins - 1)
    gaps = [abs(confidence[at == k].mean() - ok[at == k].mean()) * np.mean(at == k) for k in np.unique(at)]
    return float(np.sum(gaps))


def summary(outcomes: Sequence[Outcome]) -> str:
    """A table in plain text, one line for each kind, then the figures over all of them."""
    lines = [f"{'kind':<12}{'cases':>7}{'right':>9}{'closed 50/10 %':>18}{'truth/noise':>13}{'seconds 50/95 %':>18}"]
    for kind in dict.fromkeys(o["kind"] for o in outcomes):
        these = [o for o in outcomes if o["kind"] == kind]
        closed = _of(these, lambda o: o["held_out"]["closed"] if o["names"] and right(o) else None)
        truth = _of(these, lambda o: o["against_truth"] if o["names"] else None)
        seconds = _of(these, lambda o: o["seconds"])
        lines.append(
            f"{kind:<12}{len(these):>7}{np.mean([right(o) for o in these]):>9.1%}"
            f"{_quantiles(closed, 50, 10):>18}{_quantiles(truth, 50):>13}{_quantiles(seconds, 50, 95):>18}"
        )
    confidence, ok = (np.array(x) for x in statements(outcomes))
    sure = confidence >= CONFIDENT
    if sure.any():
        lines.append(f"names with confidence ≥ {CONFIDENT}: {int(sure.sum())}, right {ok[sure].mean():.2%}")
        lines.append(f"expected calibration error: {calibration_error(outcomes):.3f} over {confidence.size} names")
    return "\n".join(lines)


def _of(outcomes: Sequence[Outcome], value: Callable[[Outcome], float | None]) -> list[float]:
    found = [value(o) for o in outcomes if "names" in o]
    return [v for v in found if v is not None]


def _quantiles(values: Sequence[float], *percents: float) -> str:
    return " / ".join(f"{np.percentile(values, p):.2f}" for p in percents) if values else "–"


def write_picture(outcomes: Sequence[Outcome], path: Path) -> None:
    """Confusion of single effects and the reliability of the confidence, one offline page."""
    titles = ("single effects: hidden against named", "confidence against share right")
    figure = make_subplots(rows=1, cols=2, column_widths=[0.65, 0.35], subplot_titles=titles)
    singles = [o for o in outcomes if o["kind"] == "single" and "names" in o]
    true = sorted({o["true"][0] for o in singles})
    said = [*sorted({n for o in singles for n in o["names"]} | set(true)), "none"]
    counts = np.zeros((len(true), len(said)))
    for o in singles:
        for name in o["names"] or ["none"]:
            counts[true.index(o["true"][0]), said.index(name)] += 1
    text = np.where(counts > 0, counts.astype(int).astype(str), "")
    cells = go.Heatmap(z=counts, x=said, y=true, colorscale="Blues", showscale=False, text=text, texttemplate="%{text}")
    figure.add_trace(cells, 1, 1)
    confidence, ok = (np.array(x, dtype=float) for x in statements(outcomes))
    at = np.minimum((confidence * 10).astype(int), 9)
    bins = [k for k in range(10) if np.any(at == k)]
    figure.add_trace(go.Scatter(x=[0, 1], y=[0, 1], mode="lines", line={"dash": "dot", "color": "grey"}), 1, 2)
    figure.add_trace(go.Scatter(
        x=[confidence[at == k].mean() for k in bins], y=[ok[at == k].mean() for k in bins],
        text=[str(int(np.sum(at == k))) for k in bins], mode="markers+text", textposition="top center",
        marker={"size": 10}), 1, 2)  # fmt: skip
    figure.update_layout(showlegend=False, template="plotly_white", height=760, width=1500)
    figure.write_html(path, include_plotlyjs=True, config={"displayModeBar": False})
