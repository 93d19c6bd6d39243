"""The analysis of measured runs: which of their periods and channels it is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excitation.analysis import Analysis, Measurement, Realisation, analyse, designed_lines
from identification.analysis.setting import PICK_UP_A, periods_of, same_current
from identification.errors import DataError
from identification.measured import label_of
from identification.period import SHORTEST, with_period_seen
from rigctl.runfile import Run

__all__ = ["analyse_runs", "measurement_of", "repeating"]


def analyse_runs(runs: Sequence[Run]) -> Analysis:
    """Best linear approximation, distortion, noise and time variation of runs of one design.

    The period that a file states is seen in its channels first; so are the lines that its design states.

    Raises
    ------
    DataError, AnalysisError
        one line: where a run lacks displacement, force or a period, where runs do not go together, or where nothing can
        be told of them.
    """
    measurement, notes = measurement_of(runs)
    found = analyse(measurement)
    return replace(found, notes=(*notes, *found.notes))


def measurement_of(runs: Sequence[Run]) -> tuple[Measurement, tuple[str, ...]]:
    """The periods of the runs, and what there is to tell of them. Raises DataError."""
    if not runs:
        raise DataError("no run is given: give at least one with two periods")
    seen = [_with_period(run) for run in runs]
    first = seen[0][0]
    for run, _ in seen:
        if run.sample_rate_hz != first.sample_rate_hz:
            raise DataError(
                f"{label_of(run)} is sampled at {run.sample_rate_hz:g} Hz and {label_of(first)} at "
                f"{first.sample_rate_hz:g} Hz: realisations of one design have the same rate; analyse each by itself"
            )
    _check_held([run for run, _ in seen])
    moving = any("current" in run.channels and _moves(run) for run, _ in seen)
    inputs = ("displacement", "current") if moving else ("displacement",)
    stated = designed_lines(first.design, first.period_samples / first.sample_rate_hz)
    measurement = Measurement(
        sample_rate_hz=first.sample_rate_hz,
        inputs=inputs,
        realisations=tuple(_realisation(run, inputs) for run, _ in seen),
        excited=tuple(stated[name] for name in inputs) if set(inputs) <= set(stated) else None,
    )
    aborted = [f"{label_of(run)} is {run.status}" for run, _ in seen if run.status != "complete"]
    return measurement, (*(note for _, note in seen if note), *aborted)


def repeating(run: Run) -> Run:
    """The run with the period that its inputs show. Raises DataError where it has none."""
    return _with_period(run)[0]


def _check_held(runs: Sequence[Run]) -> None:
    """Raises DataError where the mean currents of two runs differ: their forces are of two settings."""
    held = [None if "current" not in run.channels else float(np.mean(run.channels["current"])) for run in runs]
    moving = min(float(np.std(run.channels["current"])) if "current" in run.channels else 0.0 for run in runs)
    for run, value in zip(runs, held, strict=True):
        if value is not None and held[0] is not None and not same_current(value, held[0], moving):
            raise DataError(
                f"{label_of(run)} has a mean current of {value:.3g} A and {label_of(runs[0])} of {held[0]:.3g} A: "
                "the approximation holds for one; analyse each by itself"
            )


def _with_period(run: Run) -> tuple[Run, str]:
    """The run with a period that its inputs show, and a note where that is not what the file states."""
    name = label_of(run)
    for channel in ("displacement", "force"):
        if channel not in run.channels:
            raise DataError(f"{name}: no channel '{channel}': an analysis needs measured displacement and force")
    found = with_period_seen(run)
    if found.differs:
        raise DataError(f"{name}: {found.differs}: {found.note}; an analysis needs a motion that repeats")
    seen = found.run
    if not SHORTEST <= seen.period_samples <= seen.samples:
        raise DataError(
            f"{name}: no period is stated or seen in {seen.samples} samples: play a multisine with periods = 3 or more"
        )
    return seen, f"{name}: {found.note}" if found.note else ""


def _moves(run: Run) -> bool:
    return float(np.std(periods_of(run, "current").mean(axis=0))) > PICK_UP_A


def _realisation(run: Run, inputs: Sequence[str]) -> Realisation:
    missing = [name for name in inputs if name not in run.channels]
    if missing:
        raise DataError(
            f"{label_of(run)}: no channel '{missing[0]}', which moves in other runs: give runs of one design"
        )
    return Realisation(
        name=label_of(run),
        inputs=np.array([periods_of(run, name) for name in inputs]),
        force=periods_of(run, "force"),
    )
