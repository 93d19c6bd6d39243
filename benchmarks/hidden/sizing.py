"""How much of an effect a refit of the base could not absorb, on a coarse copy of the campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.hidden.layout import Elements
from benchmarks.hidden.motion import LEAD_SAMPLES, Experiment, Row
from benchmarks.hidden.rig import Prepared, Specimen, prepared, true_force

PILOT_FINE = 2
PILOT_SAMPLES = 9000
RELATIVE_STEP = 2e-3

Free = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pilot:
    """The first seconds of each training run, on two steps a sample."""

    runs: tuple[Prepared, ...]
    scales: tuple[float, float, float, float]

    def force(self, elements: Elements) -> Row:
        """True force of all runs in one row, N."""
        specimen = Specimen(elements=elements, scales=self.scales)
        return np.concatenate([true_force(specimen, run) for run in self.runs])

    def tangents(self, elements: Elements, free: Free) -> NDArray[np.float64]:
        """Derivatives of the force by each free parameter's relative change, (samples, parameters)."""
        start = self.force(elements)
        columns = [
            (self.force(_changed(elements, place, 1.0 + RELATIVE_STEP)) - start) / RELATIVE_STEP for place in free
        ]
        return np.stack(columns, axis=1)


def pilot_of(experiments: list[Experiment], hum_turns: Row, scales: tuple[float, float, float, float]) -> Pilot:
    """The coarse copy of the training campaign."""
    short = [_shortened(experiment) for experiment in experiments]
    runs = tuple(prepared(e, PILOT_FINE, turns) for e, turns in zip(short, hum_turns, strict=True))
    return Pilot(runs=runs, scales=scales)


def _shortened(experiment: Experiment) -> Experiment:
    end = LEAD_SAMPLES + PILOT_SAMPLES
    return replace(
        experiment, samples=PILOT_SAMPLES, current=experiment.current[:end], temperature=experiment.temperature[:end]
    )


def _changed(elements: Elements, place: tuple[str, str], factor: float) -> Elements:
    element, name = place
    values = dict(elements[element])
    values[name] *= factor
    return {**elements, element: values}


def basis_of(tangents: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal columns that span the tangents, near-dependent ones left out."""
    norms = np.linalg.norm(tangents, axis=0)
    u, s, _ = np.linalg.svd(tangents[:, norms > 0] / norms[norms > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-6 * s[0]])


def unabsorbed(basis: NDArray[np.float64], difference: Row) -> Row:
    """What of a force difference lies outside the span."""
    return np.asarray(difference - basis @ (basis.T @ difference))


def rms(row: Row) -> float:
    return float(np.sqrt(np.mean(np.square(row))))


def refitted(pilot: Pilot, target: Row, start: Elements, free: Free, rounds: int) -> tuple[Row, Elements]:
    """Residual of a Gauss–Newton fit of `start`, and the fitted elements; tangents anew each round, never uphill."""
    elements, residual = start, target - pilot.force(start)
    for _ in range(rounds):
        tangents = pilot.tangents(elements, free)
        step = _ridge(tangents, residual)
        for shrink in (1.0, 0.4, 0.1):
            trial = _moved(elements, free, shrink * step)
            left = target - pilot.force(trial)
            if rms(left) < rms(residual):
                elements, residual = trial, left
                break
        else:
            break
    return residual, elements


def _ridge(tangents: NDArray[np.float64], residual: Row) -> Row:
    norms = np.maximum(np.linalg.norm(tangents, axis=0), 1e-300)
    step, *_ = np.linalg.lstsq(tangents / norms, residual, rcond=1e-6)
    return np.asarray(step / norms)


def _moved(elements: Elements, free: Free, step: Row) -> Elements:
    moved: Mapping[str, Mapping[str, float]] = elements
    for place, change in zip(free, step, strict=True):
        moved = _changed(moved, place, float(np.clip(1.0 + change, 0.3, 3.0)))
    return moved
