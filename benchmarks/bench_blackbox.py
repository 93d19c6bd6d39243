"""Loops of recurrent networks compared with C; and black boxes on runs of which a part is learned, a part is shown.

`python -m benchmarks.bench_blackbox [RUN.h5 … [CHART.html]]`: without runs, those of the demonstration (A. N. Vargas,
UTFPR). The chart shows the last run, and what was predicted beside what came out.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from identification.blackbox import KINDS, Base, Structure, identify, regressors
from identification.blackbox.network import Network
from identification.blackbox.samples import Samples
from identification.fitting import simple_base
from identification.models import simulate_run
from identification.physical.modelfile import model_to_json
from rigctl.runfile import Run, read_run

Floats = NDArray[np.float64]

SOURCE = Path(__file__).with_name("blackbox_loops.c")
RUNS = Path(__file__).parents[1] / "api/demo/data/mr_utfpr"
N, NODES = 512, 14  # so many rows of the gradient stay in the cache, as they do in the training
NAMES = "F1 F2 F3 x1 v1 v2 a2 i2"  # the structure that Witters and Swevers (2009) selected
LEARNED = 4 / 7  # of a run: 2000 of 3500 samples


def main(paths: list[str]) -> int:
    """Prints both tables; returns 1 where gcc is missing."""
    if shutil.which("gcc") is None:
        print("gcc is missing: there is no C loop to compare with")
        return 1
    loops()
    chart = next((Path(path) for path in paths if path.endswith(".html")), None)
    runs = [read_run(Path(path)) for path in paths if path.endswith(".h5")]
    figures = measured(runs or [read_run(path) for path in sorted(RUNS.glob("*.h5"))])
    if chart is not None:
        draw(figures, chart)
        print(chart)
    return 0


def loops() -> None:
    """Nanoseconds a sample of the loops, and their ratio to C."""
    structure = Structure(regressors(NAMES), NODES)
    rng = np.random.default_rng(1)
    weights = 0.3 * rng.standard_normal(structure.size)
    weights[-len(structure.regressors) - 1 :] *= 0.2
    inputs, m, fed = rng.standard_normal((N, 5)), 5, 3
    samples = Samples(inputs, np.zeros(N), np.full(N, fed), np.ones(N, dtype=np.bool_))
    network = Network(structure, np.array([-1e3, 1e3]))
    force = network.simulate(weights, samples)
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(Path(folder), structure.lanes)
    y, rows = np.zeros(N), np.zeros((N, weights.size))
    given = [ctypes.c_long(N), ctypes.c_long(m), ctypes.c_long(fed), *map(pointer, (weights, inputs))]
    rows_of_ours = np.zeros((structure.longest + N, weights.size))
    prepared = network.prepared(weights, samples, None)
    ours = {
        "simulation": lambda: prepared.simulate(force),
        "gradient": lambda: prepared.gradient((0, N), force, rows_of_ours),
    }
    theirs = {
        "simulation": lambda: library.simulate(*given, pointer(y)),
        "gradient": lambda: library.gradient(*given, pointer(y), pointer(rows)),
    }
    for name, run in ours.items():
        mine, its = interleaved(run, theirs[name])
        print(f"  {name:12s} {NODES} tanh, 8 regressors, {structure.weights} weights: {mine / N * 1e9:5.0f} ns/sample, "
              f"C {its / N * 1e9:5.0f}, ratio {mine / its:.2f}  goal 1.3")  # fmt: skip
    print(f"  apart: force {np.max(np.abs(force - y)):.1e}, "
          f"gradient {np.max(np.abs(rows_of_ours[structure.longest + 50:] - rows[50:])):.1e}")  # fmt: skip
    step = network.sums
    block = rng.standard_normal((N, weights.size))
    gram, whole = interleaved(lambda: block.T @ block, lambda: step(weights, samples, force))
    alone = sum(interleaved(run, run)[0] for run in ours.values())
    whole += interleaved(ours["simulation"], ours["simulation"])[0]
    print(f"  one step of least squares: {whole / N * 1e6:.2f} µs/sample; JᵀJ, simulation and gradient alone "
          f"{(gram + alone) / N * 1e6:.2f}")  # fmt: skip


def compiled(folder: Path, lanes: int) -> ctypes.CDLL:
    """The C loops as a library."""
    target = folder / "loops.so"
    flags = ["-O3", "-march=native", "-ffast-math", f"-DH={lanes}", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, "-o", str(target), str(SOURCE), "-lm"], check=True)
    library = ctypes.CDLL(str(target))
    library.simulate.restype = library.gradient.restype = None
    return library


def pointer(array: Floats) -> ctypes.c_void_p:
    """Where an array lies."""
    return array.ctypes.data_as(ctypes.c_void_p)


def interleaved(one: Callable[[], object], other: Callable[[], object], times: int = 300) -> tuple[float, float]:
    """Seconds of the fastest of many calls of each, in turn: what a busy machine can still do undisturbed."""
    seconds: tuple[list[float], list[float]] = ([], [])
    for _ in range(times):
        for run, taken in zip((one, other), seconds, strict=True):
            began = time.perf_counter()
            run()
            taken.append(time.perf_counter() - began)
    return min(seconds[0]), min(seconds[1])


@dataclass(frozen=True, slots=True)
class Figures:
    """One kind on one run."""

    run: str
    kind: str
    predicted: float
    fit: float
    shown: Run
    force: Floats


def measured(runs: list[Run]) -> list[Figures]:
    """Every kind on every run: the first four sevenths are learned, the rest is shown in free run."""
    rows = []
    print(f"  {'run':24s} {'kind':6s} predicted  trained    shown   memory  processor time")
    for run in runs:
        middle = round(LEARNED * run.samples)
        learned, shown = part(run, 0, middle), part(run, middle, run.samples)
        for kind in KINDS:
            began = time.process_time()
            base = simple_base([learned]) if kind == "hybrid" else None
            given = None if base is None else Base(base, model_to_json(base))
            found = identify(kind, [learned], held_out=[shown], base=given)
            (fit,) = found.shown.values()
            figures = f"{found.predicted:7.2f} % {found.trained:7.2f} % {fit:7.2f} % {found.memory_s:6.2f} s"
            name = run.path.stem if run.path else run.run_id
            print(f"  {name:24s} {kind:10s} {figures} {time.process_time() - began:6.1f} s", flush=True)
            rows.append(Figures(name, kind, found.predicted, fit, shown, simulate_run(found.model, shown)))
    return rows


def draw(rows: list[Figures], chart: Path) -> None:
    """The force of the last run with that of two kinds, and the fit that came out over the one that was predicted."""
    colours = dict(zip(KINDS, ("#00798c", "#e0a800", "#6a994e", "#8d6e63", "#d1495b", "#7b2d8b"), strict=True))
    figure = make_subplots(1, 2, column_widths=[0.62, 0.38], horizontal_spacing=0.09)
    last = [row for row in rows if row.run == rows[-1].run]
    rate = last[0].shown.sample_rate_hz
    window = slice(0, round(1.2 * rate))
    t = np.arange(last[0].shown.samples)[window] / rate
    measured_force = last[0].shown.channels["force"][window]
    figure.add_scatter(x=t, y=measured_force, name="measured", line={"color": "#1b1b1b", "width": 4}, row=1, col=1)
    for row in last:
        if row.kind in ("nnoe", "arx", "hybrid"):
            line = {"color": colours[row.kind], "width": 2}
            figure.add_scatter(x=t, y=row.force[window], name=row.kind, line=line, showlegend=False, row=1, col=1)
    for kind, colour in colours.items():
        of_kind = [row for row in rows if row.kind == kind]
        x, y = [row.predicted for row in of_kind], [row.fit for row in of_kind]
        figure.add_scatter(x=x, y=y, mode="markers", name=kind, marker={"color": colour, "size": 11}, row=1, col=2)
    ends = [min(min(r.predicted, r.fit) for r in rows), 100.0]
    line = {"color": "#999", "width": 1}
    figure.add_scatter(x=ends, y=ends, mode="lines", line=line, showlegend=False, row=1, col=2)
    figure.update_xaxes(title="time after the first sample that was not learned, s", row=1, col=1)
    figure.update_yaxes(title=f"force in free run on {rows[-1].run}, N", row=1, col=1)
    figure.update_xaxes(title="fit predicted by cross-validation, %", row=1, col=2)
    figure.update_yaxes(title="fit that came out, %", row=1, col=2)
    figure.update_layout(template="plotly_white", width=1150, height=430, margin={"t": 20, "r": 20, "b": 60})
    figure.write_html(chart, include_plotlyjs=True, config={"displayModeBar": False})


def part(run: Run, first: int, last: int) -> Run:
    """A part of a run as one of its own."""
    channels = {name: values[first:last].copy() for name, values in run.channels.items()}
    return replace(run, channels=channels, run_id=f"{run.run_id}-{first}", period_samples=0, path=None)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
