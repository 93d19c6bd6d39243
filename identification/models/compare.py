"""Compares models of any kind on runs: error, cost, parameters, and samples outside the training range."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError, SimulationError
from identification.models.band import covered, half_width_of
from identification.models.inputs import is_periodic, motion_of, periods, settling_periods, with_measured
from identification.models.measures import Score, score_signals
from identification.models.motion import Motion
from identification.models.protocol import OfRuns, SimulationModel
from identification.models.simulation import check_inputs, for_every_sample, force_along, name_of
from identification.noise import between_periods
from identification.period import with_period_seen
from rigctl.runfile import Run

Floats = NDArray[np.float64]
Progress = Callable[[float, str], None]
Clock = Callable[[], int]

_REPEATS = 5  # simulations whose median time is the cost
_ENOUGH_NS = 1_000_000_000  # no further repeat after this time on one run: the median hardly changes


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One model on one run.

    `left` is the share of samples outside the model's training range by signal, None where it states no range.
    `failure` says why there is no score.
    """

    score: Score | None
    cost_ns: float | None  # a sample
    left: Mapping[str, float] | None
    failure: str = ""
    covered: float | None = None  # share of the samples within the model's band of 90 %; None where it has none
    force: Floats | None = field(default=None, repr=False, compare=False)  # (N,), N, for drawings
    half: Floats | None = field(default=None, repr=False, compare=False)  # (N,), N, half of the width of the band


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One model: what it is, and a cell for every run.

    `rms` (N), `rrmsse` and `fit` (%) are over the samples of all runs, `eearth` and `cost_ns` the mean and the median
    over the runs; None where the model failed on one of them.
    """

    label: str
    kind: str
    parameters: int | None  # None: it states none
    free: int | None
    ranged: bool  # whether it states its training range
    cells: tuple[Cell, ...]
    rms: float | None
    rrmsse: float | None
    fit: float | None
    eearth: float | None
    cost_ns: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """One run of a comparison; `noise` is the rms, N, that its periods differ by, None where none repeats."""

    name: str
    run: Run = field(repr=False, compare=False)
    motion: Motion = field(repr=False, compare=False)
    noise: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Models × runs, in the order in which they were given."""

    rows: tuple[Row, ...]
    courses: tuple[Course, ...]

    def best_first(self) -> list[Row]:
        """The rows by their error over all runs; those that failed come last."""
        return sorted(self.rows, key=lambda row: math.inf if row.rms is None else row.rms)


def compare(
    models: Sequence[SimulationModel],
    runs: Sequence[Run],
    *,
    labels: Sequence[str] = (),
    on_progress: Progress | None = None,
    clock: Clock = time.perf_counter_ns,
) -> Comparison:
    """Simulate every model along every run, from the run's inputs alone, and measure error and cost.

    The figures are those of `score` for what `simulate_run` gives. The cost is the median time of repeated simulation
    of all samples over their number. `labels` name the models, in place of their own names.

    Raises
    ------
    DataError
        when there is no model or no run, a run lacks the force or what a model needs, or its force is constant.
    """
    check_comparison(models, runs)
    say = on_progress or (lambda done, text: None)
    courses = tuple(_course(run) for run in runs)
    rows = []
    for k, (label, model) in enumerate(
        zip(_numbered(labels or [m.name or m.kind for m in models]), models, strict=True)
    ):
        cells = []
        for n, course in enumerate(courses):
            say((k + n / len(courses)) / len(models), f"{label} on {course.name}")
            cells.append(_cell(model, course, clock))
        rows.append(_row(label, model, cells, courses))
    return Comparison(rows=tuple(rows), courses=courses)


def comparison_text(found: Comparison) -> str:
    """A line for each model, the smallest error first."""
    rows = found.best_first()
    width = max(len(row.label) for row in rows)
    lines = [f"{'model':<{width}} {'rms, N':>10} {'fit, %':>8} {'EEARTH':>7} {'ns/sample':>10} {'parameters':>10}"]
    for row in rows:
        figures = "fails: " + next((cell.failure for cell in row.cells if cell.failure), "")
        if row.rms is not None:
            count = "not stated" if row.free is None else str(row.free)
            figures = f"{row.rms:>10.4g} {row.fit:>8.2f} {row.eearth:>7.3f} {row.cost_ns:>10,.0f} {count:>10}"
        lines.append(f"{row.label:<{width}} {figures}")
    return "\n".join(lines)


def comparison_data(comparison: Comparison) -> dict[str, Any]:
    """The comparison as JSON data, SI units; null where there is no figure. Any: what JSON can say."""
    names = [course.name for course in comparison.courses]
    return {
        "format": "damper-rig/comparison",
        "format_version": 1,
        "runs": [
            {"run": c.name, "samples": c.run.samples, "sample_rate": c.run.sample_rate_hz, "noise": c.noise}
            for c in comparison.courses
        ],
        "models": [
            {
                "model": row.label,
                "kind": row.kind,
                "parameters": row.parameters,
                "free_parameters": row.free,
                "rms": row.rms,
                "rrmsse": row.rrmsse,
                "fit": row.fit,
                "eearth": row.eearth,
                "cost_ns_per_sample": row.cost_ns,
                "training_range": "stated" if row.ranged else "not stated",
                "runs": [{"run": name} | _cell_data(cell) for name, cell in zip(names, row.cells, strict=True)],
            }
            for row in comparison.rows
        ],
    }


def _cell_data(cell: Cell) -> dict[str, Any]:
    figures = dict.fromkeys(("rms", "rrmsse", "fit", "eearth")) if cell.score is None else asdict(cell.score)
    left = None if cell.left is None else dict(cell.left)
    return figures | {
        "cost_ns_per_sample": cell.cost_ns,
        "outside_training": left,
        "coverage_90": cell.covered,
        "failure": cell.failure or None,
    }


def check_comparison(models: Sequence[SimulationModel], runs: Sequence[Run]) -> None:
    """Raise DataError where `compare` would; nothing is simulated."""
    if not models:
        raise DataError("no model was given: a comparison needs at least one")
    if not runs:
        raise DataError("no run was given: at least one measured run is needed")
    for run in runs:
        force = run.channels.get("force")
        if force is None:
            raise DataError(f"{name_of(run)}: no channel 'force': models are compared with the measured force")
        for model in models:
            check_inputs(model, run)
        if np.ptp(force) == 0.0:
            raise DataError(f"{name_of(run)}: the measured force is constant: a comparison needs a force that varies")


def _numbered(names: Sequence[str]) -> list[str]:
    """The names, numbered where two are the same."""
    return [f"{name} ({names[: k + 1].count(name)})" if names.count(name) > 1 else name for k, name in enumerate(names)]


def _course(run: Run) -> Course:
    noise, run = None, with_period_seen(run).run
    if is_periodic(run):
        force = periods(run, "force")
        settled = force[settling_periods(force) :]
        noise = between_periods(settled)[0] if len(settled) > 1 else None
    return Course(name=name_of(run), run=run, motion=motion_of(run), noise=noise)


def _cell(model: SimulationModel, course: Course, clock: Clock) -> Cell:
    run, motion = course.run, with_measured(course.motion, course.run, model.inputs)
    model = model.bound_to(run) if isinstance(model, OfRuns) else model
    ranged = model.training_range
    left = None if ranged is None else ranged.left(motion)
    try:
        force = for_every_sample(force_along(model, motion), motion, run)
        width = half_width_of(model, motion)
        cost = _cost_ns(model, replace(motion, settle=0), clock)
    except SimulationError as error:
        return Cell(score=None, cost_ns=None, left=left, failure=str(error))
    measured, half = run.channels["force"], None if width is None else for_every_sample(width, motion, run)
    held = None if half is None else covered(measured, force, half)
    return Cell(score=score_signals(measured, force), cost_ns=cost, left=left, covered=held, force=force, half=half)


def _cost_ns(model: SimulationModel, motion: Motion, clock: Clock) -> float:
    """Median time of a simulation of all samples, ns a sample."""
    taken: list[int] = []
    while len(taken) < _REPEATS and sum(taken) < _ENOUGH_NS:
        began = clock()
        model.force(motion)
        taken.append(clock() - began)
    return median(taken) / motion.x.size


def _row(label: str, model: SimulationModel, cells: Sequence[Cell], courses: Sequence[Course]) -> Row:
    scores = [cell.score for cell in cells if cell.score is not None]
    whole = len(scores) == len(cells)
    forces = [course.run.channels["force"] for course in courses]
    squares = math.fsum(s.rms**2 * f.size for s, f in zip(scores, forces, strict=True)) if whole else math.nan
    rrmsse = 100.0 * math.sqrt(squares / math.fsum(float(np.var(f)) * f.size for f in forces))
    count = len(model.names())
    return Row(
        label=label,
        kind=model.kind,
        parameters=count or None,
        free=int(np.sum(model.free())) if count else None,
        ranged=model.training_range is not None,
        cells=tuple(cells),
        rms=math.sqrt(squares / sum(f.size for f in forces)) if whole else None,
        rrmsse=rrmsse if whole else None,
        fit=100.0 - rrmsse if whole else None,
        eearth=sum(s.eearth for s in scores) / len(scores) if whole else None,
        cost_ns=median(cell.cost_ns for cell in cells if cell.cost_ns is not None) if whole else None,
    )
