"""The analysis of measured runs: which of their periods and channels it is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from excitation.analysis import Analysis, Measurement, Realisation, analyse, designed_lines
from identification.errors import DataError
from identification.measured import label_of
from identification.period import SHORTEST, with_period_seen
from rigctl.runfile import Run

__all__ = ["analyse_runs", "measurement_of"]

Floats = NDArray[np.float64]

# Rms of the current's mean period below which it rests: coils take tenths of an ampere to amperes, a sensor picks up
# less than this.
_PICK_UP_A = 0.01


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
    return float(np.std(_periods(run, "current").mean(axis=0))) > _PICK_UP_A


def _periods(run: Run, channel: str) -> Floats:
    """The whole periods of a channel, (P, N)."""
    count = run.samples // run.period_samples
    return run.channels[channel][: count * run.period_samples].reshape(count, run.period_samples)


def _realisation(run: Run, inputs: Sequence[str]) -> Realisation:
    missing = [name for name in inputs if name not in run.channels]
    if missing:
        raise DataError(
            f"{label_of(run)}: no channel '{missing[0]}', which moves in other runs: give runs of one design"
        )
    return Realisation(
        name=label_of(run),
        inputs=np.array([_periods(run, name) for name in inputs]),
        force=_periods(run, "force"),
    )
