"""Signatures: what an element would add to the simulation that no refit of the present model could absorb."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identification.compute import run
from identification.criteria import CHANCE
from identification.errors import SimulationError
from identification.fitting.leastsquares import at_bound, evaluate, free_parameters
from identification.physical.model import Element, Model
from identification.physical.predict import prediction_of
from identification.record import Record

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Tangent:
    """Present model on all records, whitened: residual (M,) and an orthonormal basis (M, K) of what a refit absorbs."""

    residual: Floats
    basis: Floats
    weights: tuple[float, ...]
    base: tuple[Floats, ...]  # simulated force per record, N

    def project(self, columns: Floats) -> Floats:
        """Columns (M, L) less what a refit of the present model would absorb."""
        return columns - self.basis @ (self.basis.T @ columns)


@dataclass(frozen=True, slots=True)
class Signature:
    """How much of the whitened residual energy one trial element explains, before any fit; `share` in 0 … 1."""

    trial: Element  # of the sign of the residual, where it may have either
    share: float
    own: float  # share of the signature that is its own


def tangent(model: Model, records: Sequence[Record]) -> Tangent:
    """Whitened residual and tangent space of a fitted model, without what only a step beyond a bound would absorb.

    Of a late force above a spring a refit would make a dashpot below zero, which there is not.
    """
    free = free_parameters(model, records)
    here = evaluate(model, records, free)
    weights = tuple(1.0 / r.sigma for r in records)
    jacobian = _stack(here.gradients, weights)
    residual = _stack_one(here.residuals, weights)
    low, high = (b[free] for b in model.bounds())
    stopped = at_bound(model.values()[free], jacobian.T @ residual, low=low, high=high)
    jacobian = jacobian[:, ~stopped]
    base = tuple(r.measured - e for r, e in zip(records, here.residuals, strict=True))
    return Tangent(residual, orthonormal(jacobian), weights, base)


def orthonormal(columns: Floats) -> Floats:
    """Orthonormal basis of the span of `columns`, (M, K) with K ≤ their number, through their scaled Gram matrix."""
    norms = np.linalg.norm(columns, axis=0)
    columns = columns[:, norms > 0.0] / norms[norms > 0.0]
    if columns.shape[1] == 0:
        return columns
    for _ in range(2):  # a Gram matrix squares the condition: the second pass restores orthogonality
        values, vectors = np.linalg.eigh(columns.T @ columns)
        keep = values > CHANCE.rounding**2 * values[-1]
        columns = columns @ (vectors[:, keep] / np.sqrt(values[keep]))
    return columns


def signature(model: Model, trial: Element, records: Sequence[Record], at: Tangent) -> Signature:
    """Share of the residual that the trial, in its best strength and nearby shape, would explain."""
    extended = model.with_element(trial)
    own = free_parameters(extended, records) & np.array([e.id not in model.ids for e, _ in extended.slots()])
    columns, prediction = [], prediction_of(extended, gradient=own)
    try:
        for record, base, weight in zip(records, at.base, at.weights, strict=True):
            force, gradient = prediction.on(record)
            assert gradient is not None
            with np.errstate(over="ignore", invalid="ignore"):
                columns.append(weight * np.column_stack([force - base, gradient]))
    except SimulationError:
        return Signature(trial, 0.0, 0.0)
    stacked = np.concatenate(columns)
    with np.errstate(over="ignore", invalid="ignore"):
        norms = np.linalg.norm(stacked, axis=0)
    sane = (norms > 0.0) & (norms < np.inf)  # a shape on its limit may run away
    stacked = stacked[:, sane] / norms[sane]
    if stacked.shape[1] == 0:
        return Signature(trial, 0.0, 0.0)
    left = at.project(stacked)
    visible = np.linalg.norm(left, axis=0)
    left = left[:, visible > CHANCE.visible]
    if left.shape[1] == 0:
        return Signature(trial, 0.0, float(np.max(visible)))
    basis = orthonormal(left)
    share = float(np.sum((basis.T @ at.residual) ** 2) / max(float(at.residual @ at.residual), 1e-300))
    away = sane[0] and float(stacked[:, 0] @ at.residual) < 0.0  # the residual is what no refit absorbs
    return Signature(_mirrored(trial) if away else trial, share, float(visible[0]))


def _mirrored(trial: Element) -> Element:
    """The trial with its strength of the other sign, where it has one that may be: a fit that has to cross zero loses
    the shape there."""
    pairs = zip(trial.spec.parameters, trial.parameters, strict=True)
    return replace(trial, parameters=tuple(replace(p, value=-p.value) if s.signed else p for s, p in pairs))


def screen(model: Model, trials: Sequence[Element], records: Sequence[Record], at: Tangent) -> list[Signature]:
    """Signatures of all trials, the largest share first."""
    found = run(partial(signature, model, records=records, at=at), trials)
    return sorted(found, key=lambda s: -s.share)


def _stack(columns: Sequence[Floats], weights: Sequence[float]) -> Floats:
    return np.concatenate([w * c for w, c in zip(weights, columns, strict=True)])


def _stack_one(residuals: Sequence[Floats], weights: Sequence[float]) -> Floats:
    return np.concatenate([w * r for w, r in zip(weights, residuals, strict=True)])
