"""The part of an effect that a refit of the base cannot absorb, on a coarse copy of the campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.hidden.layout import Elements
from benchmarks.hidden.motion import Experiment, Row
from benchmarks.hidden.rig import Prepared, Specimen, prepared, true_force

PILOT_FINE = 2
PILOT_SAMPLES = 6000
RELATIVE_STEP = 2e-3

Free = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pilot:
    """The middle seconds of each training run, with two steps a sample."""

    runs: tuple[Prepared, ...]
    scales: tuple[float, float, float, float]

    def force(self, elements: Elements) -> Row:
        """True force of all runs in one array, N."""
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
    runs = tuple(
        prepared(e, PILOT_FINE, turns, (e.samples - PILOT_SAMPLES) // 2, PILOT_SAMPLES)
        for e, turns in zip(experiments, hum_turns, strict=True)
    )
    return Pilot(runs=runs, scales=scales)


def _changed(elements: Elements, place: tuple[str, str], factor: float) -> Elements:
    element, name = place
    values = dict(elements[element])
    values[name] *= factor
    return {**elements, element: values}


def basis_of(tangents: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal columns that span the tangents, without nearly dependent ones."""
    norms = np.linalg.norm(tangents, axis=0)
    u, s, _ = np.linalg.svd(tangents[:, norms > 0] / norms[norms > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-6 * s[0]])


def unabsorbed(basis: NDArray[np.float64], difference: Row) -> Row:
    """The part of a force difference outside the span."""
    return np.asarray(difference - basis @ (basis.T @ difference))


def rms(row: Row) -> float:
    return float(np.sqrt(np.mean(np.square(row))))


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """Result of a fit: residual, N, elements, and tangents near them."""

    residual: Row
    elements: Elements
    tangents: NDArray[np.float64]


def refitted(pilot: Pilot, target: Row, start: Elements, free: Free, rounds: int = 3) -> Fit:
    """Gauss–Newton from `start`: new tangents each round, residual never larger, until a round gains under 2 %."""
    elements, residual = start, target - pilot.force(start)
    for _ in range(rounds):
        before = rms(residual)
        tangents = pilot.tangents(elements, free)
        step = _ridge(tangents, residual)
        for shrink in (1.0, 0.4, 0.1):
            trial = _moved(elements, free, shrink * step)
            left = target - pilot.force(trial)
            if rms(left) < rms(residual):
                elements, residual = trial, left
                break
        if rms(residual) > 0.98 * before:
            break
    return Fit(residual=residual, elements=elements, tangents=tangents)


def _ridge(tangents: NDArray[np.float64], residual: Row) -> Row:
    norms = np.maximum(np.linalg.norm(tangents, axis=0), 1e-300)
    step, *_ = np.linalg.lstsq(tangents / norms, residual, rcond=1e-6)
    return np.asarray(step / norms)


def _moved(elements: Elements, free: Free, step: Row) -> Elements:
    moved: Mapping[str, Mapping[str, float]] = elements
    for place, change in zip(free, step, strict=True):
        moved = _changed(moved, place, float(np.clip(1.0 + change, 0.3, 3.0)))
    return moved
