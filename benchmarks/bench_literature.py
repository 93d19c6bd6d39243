"""Every model of the literature on the measured runs of a magneto-rheological damper (A. N. Vargas, UTFPR).

Five runs are fitted, two are held out. `python -m benchmarks.bench_literature CHART.html` also draws the comparison.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from identification.fitting import Fit, fit_from_many, warnings
from identification.models.measures import score_signals
from identification.physical.literature import LITERATURE, literature
from identification.physical.predict import predict
from identification.record import Record, record_from_run
from rigctl.runfile import read_run

Floats = NDArray[np.float64]

RUNS = Path(__file__).parents[1] / "api/demo/data/mr_utfpr"
HELD_OUT = ("ensaio_A_4", "ensaio_A_8")
STARTS, SPREAD = 24, 10.0


@dataclass(frozen=True, slots=True)
class Row:
    """Errors of one model."""

    name: str
    fit: Fit
    rms: float  # N, training
    held: float  # N, held out
    rrmsse: float  # %, held out
    eearth: float
    seconds: float


def main(chart: Path | None = None) -> None:
    """Prints the table, the best on the held-out runs first."""
    records = [record_from_run(read_run(path)) for path in sorted(RUNS.glob("*.h5"))]
    held = [r for r in records if r.name.removesuffix(".h5") in HELD_OUT]
    train = [r for r in records if r not in held]
    rows = sorted((_row(name, train, held) for name in LITERATURE), key=lambda r: r.held)
    print(f"{len(train)} runs fitted from {STARTS} starts, {len(held)} held out; noise of the held-out runs "
          f"{np.sqrt(np.mean([r.sigma**2 for r in held])):.1f} N")  # fmt: skip
    print(f"  {'model':32s} free   train     held out         EEARTH  time")
    for r in rows:
        free = sum(p.std is not None for e in r.fit.model.elements for p in e.parameters)
        vague = len(warnings(r.fit))
        print(
            f"  {r.name:32s} {free:4d} {r.rms:6.1f} N  {r.held:6.1f} N {r.rrmsse:5.1f} %  {r.eearth:5.3f}"
            f"  {r.seconds:4.1f} s" + (f"  {vague} warnings" if vague else ""),
            flush=True,
        )
    if chart is not None:
        _draw(rows, held[0], chart)
        print(chart)


def _row(name: str, train: list[Record], held: list[Record]) -> Row:
    began = time.perf_counter()
    found = fit_from_many(literature(name), train, STARTS, spread=SPREAD, seed=1).best
    took = time.perf_counter() - began
    measured = np.concatenate([r.measured for r in held])
    simulated = np.concatenate([predict(found.model, r)[0] for r in held])
    scores = [score_signals(r.measured, predict(found.model, r)[0]) for r in held]
    rms = float(np.sqrt(np.mean((measured - simulated) ** 2)))
    share = float(np.mean([s.rrmsse for s in scores]))
    return Row(name, found, found.rms, rms, share, float(np.mean([s.eearth for s in scores])), took)


def _draw(rows: list[Row], record: Record, chart: Path) -> None:
    """A bar for each model, and the loops of the three best beside the measured one."""
    figure = make_subplots(
        rows=1, cols=2, subplot_titles=("rms on held-out runs, N", f"{record.name}, force over velocity")
    )
    figure.add_bar(x=[r.held for r in rows], y=[r.name for r in rows], orientation="h", row=1, col=1, showlegend=False,
                   text=[f"{r.held:.0f}" for r in rows], marker_color="#00798c")  # fmt: skip
    figure.update_yaxes(autorange="reversed", row=1, col=1)
    v = record.motion.v[record.window]
    figure.add_scattergl(x=v, y=record.measured, mode="markers", marker={"size": 3, "color": "#999"}, name="measured",
                         row=1, col=2)  # fmt: skip
    for row, colour in zip(rows[:3], ("#d1495b", "#e0a800", "#30638e"), strict=False):
        force = predict(row.fit.model, record)[0]
        figure.add_scattergl(
            x=v, y=force, mode="lines", line={"width": 1, "color": colour}, name=row.name, row=1, col=2
        )
    figure.update_xaxes(title="velocity, m/s", row=1, col=2)
    figure.update_layout(template="plotly_white", height=560, title="Models of the literature on measured runs")
    figure.write_html(chart, include_plotlyjs=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
