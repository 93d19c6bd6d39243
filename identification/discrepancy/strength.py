"""How strong a named effect is in every run: a true one has one strength."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.criteria import CHANCE
from identification.discrepancy.signatures import orthonormal
from identification.errors import SimulationError
from identification.fitting.leastsquares import evaluate, free_parameters
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record

Floats = NDArray[np.float64]


def strengths(model: Model, name: str, records: Sequence[Record]) -> tuple[Floats, Floats]:
    """Strength of an element, by its id, in every record, relative to the common fit, and its precision, (R,) each.

    λ_r = 1 + s⊥·r / s⊥·s⊥ over the samples of record r, with s⊥ the element's contribution less all that the other
    parameters could absorb; the precision is 1/variance, zero where the model can't run without the
    element.
    """
    without = model.without(name)
    free = free_parameters(without, records)
    try:
        base = evaluate(without, records, free)
    except SimulationError:
        return np.full(len(records), np.nan), np.zeros(len(records))
    columns, contributions, residuals = [], [], []
    for r, gradient in zip(records, base.gradients, strict=True):
        force, _ = predict(model, r)
        columns.append(gradient / r.sigma)
        contributions.append((force - predict(without, r)[0]) / r.sigma)
        residuals.append((r.measured - force) / r.sigma)
    basis = orthonormal(np.concatenate(columns))
    stacked = np.concatenate(contributions)
    own = stacked - basis @ (basis.T @ stacked)
    edges = np.cumsum([0] + [r.size for r in residuals])
    values, precision = [], []
    for k, residual in enumerate(residuals):
        s = own[edges[k] : edges[k + 1]]
        energy = float(s @ s)
        values.append(1.0 + float(s @ residual) / energy if energy > 0.0 else np.nan)
        precision.append(energy)
    return np.array(values), np.array(precision)


def seen_by(precision: Floats) -> int:
    """Number of records that see an effect."""
    return int(np.sum(_is_seen(precision)))


def spread_of(values: Floats, precision: Floats) -> float:
    """Scatter of strengths beyond their noise, weighted by the precision of each record."""
    known = _is_seen(precision)
    if np.sum(known) < 2:
        return 0.0
    v, w = values[known], precision[known]
    mean = float(np.sum(w * v) / np.sum(w))
    variance = float(np.sum(w * (v - mean) ** 2) / np.sum(w)) - (v.size - 1) / float(np.sum(w))
    return float(np.sqrt(max(variance, 0.0)))


def _is_seen(precision: Floats) -> NDArray[np.bool_]:
    return np.asarray(precision > CHANCE.visible * np.max(precision, initial=0.0))
