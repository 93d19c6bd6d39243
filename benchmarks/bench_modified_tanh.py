"""The modified hyperbolic tangent model of 13 parameters beside the one of the current only, on measured runs.

`python -m benchmarks.bench_modified_tanh FOLDER [PAGE.html]`: the folder holds runs named I<current>A_<stroke><hertz>,
such as those of D. Maurel E. (UTFSM): four sines at five currents. The current-only model is the other with α3, α4 and
β2 at 0. Both are fitted to all runs, and with each stroke and each current left out in turn.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from identification.blackbox.preparation import resampled
from identification.fitting import fit_from_many
from identification.physical.literature import literature
from identification.physical.model import Model, element
from identification.physical.predict import predict
from identification.record import Record, record_from_run
from rigctl.runfile import read_run

RATE_HZ = 200.0
STARTS, SPREAD = 6, 3.0
MODIFIED = literature("modified hyperbolic tangent")
_OURS, _OLD = "#00798c", "#d1495b"
Row = tuple[str, str, float, float]  # split, what is shown, rms of the current-only and of the modified model, N


def main(paths: Sequence[str] = ()) -> int:
    """Prints a line for each split."""
    if not paths:
        print("  no folder of measured runs was given: python -m benchmarks.bench_modified_tanh FOLDER")
        return 0
    began = time.process_time()
    records = [record_from_run(resampled(read_run(path), RATE_HZ)) for path in sorted(Path(paths[0]).glob("I*.h5"))]
    rows = [*shown("all runs are fitted", records, records, current_of), *held_out(records)]
    print(f"  {'split':32s} {'shown':12s} current only   modified    lower by")
    for split, label, old, new in rows:
        print(f"  {split:32s} {label:12s} {old:8.1f} N  {new:8.1f} N  {100 * (1 - new / old):6.1f} %")
    print(f"  {time.process_time() - began:.0f} s of the processor", flush=True)
    for page in (Path(one) for one in paths[1:]):
        draw(rows, page)
        print(page)
    return 0


def held_out(records: Sequence[Record]) -> list[Row]:
    """Every stroke and every current left out in turn."""
    rows = []
    for what, label_of in (("stroke", stroke_of), ("current", current_of)):
        for label in dict.fromkeys(map(label_of, records)):
            training = [one for one in records if label_of(one) != label]
            rows += shown(f"{what} held out", training, [one for one in records if label_of(one) == label], label_of)
    return rows


def shown(
    split: str, training: Sequence[Record], records: Sequence[Record], label_of: Callable[[Record], str]
) -> list[Row]:
    """Both models on some records, by a label, and on all of them where there are several labels."""
    models = [
        fit_from_many(one, list(training), STARTS, spread=SPREAD, seed=1).best.model for one in (start(), MODIFIED)
    ]
    rows = []
    labels = list(dict.fromkeys(map(label_of, records)))
    for label in [*labels, *(["all"] if len(labels) > 1 else [])]:
        chosen = [one for one in records if label in ("all", label_of(one))]
        rows.append((split, label, *(rms(model, chosen) for model in models)))
    return rows


def start() -> Model:
    """The current-only model: the modified one whose loop does not follow the motion."""
    held = {"alpha2": 1.0, "alpha3": 0.0, "alpha4": 0.0, "beta2": 0.0}  # α2: a matter of scale beside α5
    free = {"alpha1": 0.0, "alpha5": 300.0, "beta1": 40.0, "delta1": 0.0, "delta2": 0.3}
    loop = element("modulated_tanh_hysteresis", held | free, fixed=tuple(held))
    rest = [one for one in MODIFIED.elements if one.name != loop.name]
    return Model(name="current only", elements=(*rest, loop))


def rms(model: Model, records: Sequence[Record]) -> float:
    """Rms error of a model over some records together, N."""
    error = np.concatenate([one.measured - predict(model, one)[0] for one in records])
    return float(np.sqrt(np.mean(error**2)))


def stroke_of(record: Record) -> str:
    """Such as 10mm2Hz."""
    return record.name.removesuffix(".h5").split("_")[1]


def current_of(record: Record) -> str:
    """Such as I0p5A."""
    return record.name.split("_")[0]


def draw(rows: Sequence[Row], page: Path) -> None:
    """A pair of bars for each split."""
    figure = go.Figure()
    names = [f"{split}: {label}" for split, label, _, _ in rows]
    series: Mapping[str, tuple[list[float], str]] = {
        "current only": ([old for _, _, old, _ in rows], _OLD),
        "modified, 13 parameters": ([new for _, _, _, new in rows], _OURS),
    }
    for name, (values, colour) in series.items():
        figure.add_bar(y=names, x=values, name=name, orientation="h", marker={"color": colour})
    figure.update_yaxes(autorange="reversed")
    figure.update_xaxes(title="rms error of the force, N")
    figure.update_layout(template="plotly_white", barmode="group", width=1000, height=700, margin={"l": 230})
    figure.write_html(page, include_plotlyjs=True, config={"displayModeBar": False})


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
