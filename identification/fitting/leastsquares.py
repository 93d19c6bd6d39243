"""Nonlinear least squares over several records: Levenberg–Marquardt with exact gradients inside physical bounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identification.compute import run_here
from identification.errors import SimulationError
from identification.models.series import is_beyond
from identification.physical.model import Model
from identification.physical.predict import RUNAWAY, Prediction, prediction_of
from identification.record import Record

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_SHRINK = 5.0  # a parameter that must stay above zero decreases by at most this factor in a step
_DAMPINGS = 10
_UNSEEN = 1e-200  # a sum of squares from which no finite variance follows
# Parts of all records together, for the scatter of what their samples pull the parameters by: for each parameter and in
# total at least; of one record at least. Half: a variance is known to 40 % of itself and not 29; double: noise that
# remembers a fiftieth of a record counts as white.
_PARTS_OF_ONE, _PARTS, _PARTS_OF_RECORD = 4, 24, 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """A fitted model with its uncertainty.

    `residuals` are measured minus simulated, N, one array per record's window. `covariance` (K, K) is that of the free
    parameters in the units of the model, scaled by the misfit where that exceeds the noise. `converged` is False with
    a `reason` when the search stopped early: a result, not an exception.
    """

    model: Model
    residuals: tuple[Floats, ...]
    rms: float
    chi2: float
    samples: int
    covariance: Floats
    jacobian_gram: Floats
    iterations: int
    evaluations: int  # of the force and its gradient, on all records
    converged: bool
    reason: str


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Residuals and, per record, the gradient by the free parameters."""

    residuals: tuple[Floats, ...]
    gradients: tuple[Floats, ...]


def evaluate(model: Model, records: Sequence[Record], free: Mask) -> Evaluation:
    """Residuals (M,), N, and gradients of the force (M, K) for every record, computed in parallel.

    Raises
    ------
    SimulationError
        when the model gives no finite force on one of the records.
    """
    pairs = run_here(partial(_residual, prediction_of(model, gradient=free)), records)
    return Evaluation(tuple(r for r, _ in pairs), tuple(g for _, g in pairs))


def _residual(prediction: Prediction, record: Record) -> tuple[Floats, Floats]:
    """Residual (M,), N, and gradient of the force (M, K) on one record."""
    force, gradient = prediction.on(record)
    assert gradient is not None
    if is_beyond(gradient, RUNAWAY):
        raise SimulationError(f"'{prediction.model.name}' runs away on {record.name}: its gradient overflows")
    return record.measured - force, gradient


def free_parameters(model: Model, records: Sequence[Record]) -> Mask:
    """Which parameters these records can determine, (P,): not fixed ones, not those of a signal that no record has."""
    current = any(r.has_current for r in records)
    free = model.free()
    for k, (e, index) in enumerate(model.slots()):
        spec = e.spec.parameters[index]
        if spec.of_run or (spec.gain and not current):
            free[k] = False
    return free


def fit_records(
    model: Model,
    records: Sequence[Record],
    *,
    max_iterations: int = 40,
    tolerance: float = 1e-5,
    robust: float | None = None,
    on_step: Callable[[int, float], None] | None = None,
) -> Fit:
    """Fit the free parameters of `model` to all records at once, each weighted by its own noise.

    Minimises Σ ‖(F − M(θ))/σ‖² by Levenberg–Marquardt with Marquardt's scaling and a projected active set for the
    bounds. Stops when a step promises less than `tolerance` of the cost twice running. With `robust` = c, samples whose
    residual exceeds c·σ count by their size rather than its square: Σ 2c²(√(1 + (r/cσ)²) − 1), the smooth l1 loss.
    """
    free = free_parameters(model, records)
    weights = [1.0 / r.sigma for r in records]
    theta = model.values()
    low, high = (b[free] for b in model.bounds())
    current = evaluate(model, records, free)
    cost = _cost(current, weights, robust)
    damping, quiet, reason, converged, iteration, evaluations = 1e-3, 0, "the iteration limit was reached", False, 0, 1
    solve = partial(_bounded_step, low=low, high=high)
    while iteration < max_iterations and not converged:
        iteration += 1
        gram, slope = _normal(current, weights, robust)
        accepted, gain = False, 0.0
        for _ in range(_DAMPINGS):
            step = solve(theta[free], gram, slope, damping)
            if not np.any(step):
                break
            trial = theta.copy()
            trial[free] = np.clip(theta[free] + step, low, high)  # the sum may round past a bound
            evaluations += 1
            try:
                candidate = evaluate(model.with_values(trial), records, free)
                new = _cost(candidate, weights, robust)
            except SimulationError:
                new = np.inf
            promised = float(2.0 * slope @ step - step @ gram @ step)
            if new < cost:
                damping = _less_or_more(damping, (cost - new) / promised if promised > 0.0 else 0.0)
                accepted, gain = True, (cost - new) / cost
                theta, current, cost = trial, candidate, new
                break
            if 0.0 <= promised < 0.1 * tolerance * cost:
                break  # a step that a bound has changed may predict a rise: then only more damping helps
            damping *= 8.0
        quiet = 0 if accepted and gain > tolerance else quiet + 1
        converged = quiet >= 2 or not accepted
        if on_step is not None:
            on_step(iteration, cost)
    if converged:
        reason = "no step lowers the misfit any further"
    counts = (iteration, evaluations)
    return _result(model.with_values(theta), current, weights, robust, free, counts, converged, reason)


def _less_or_more(damping: float, kept: float) -> float:
    """The damping after a step, by the ratio of the actual to the predicted decrease (Nocedal & Wright 2006,
    algorithm 4.1). With less damping after every success, every second step would fail."""
    if kept > 0.75:
        return max(damping / 6.0, 1e-9)
    return damping if kept > 0.25 else 3.0 * damping


def _cost(evaluation: Evaluation, weights: Sequence[float], robust: float | None = None) -> float:
    pairs = zip(evaluation.residuals, weights, strict=True)
    if robust is None:
        return float(sum(np.dot(r, r) * w * w for r, w in pairs))
    return float(sum(2.0 * robust**2 * np.sum(np.sqrt(1.0 + (r * w / robust) ** 2) - 1.0) for r, w in pairs))


def _normal(evaluation: Evaluation, weights: Sequence[float], robust: float | None = None) -> tuple[Floats, Floats]:
    """Gram matrix (K, K) and slope (K,) of the weighted problem."""
    width = evaluation.gradients[0].shape[1]
    gram, slope = np.zeros((width, width)), np.zeros(width)
    for g, r, w in zip(evaluation.gradients, evaluation.residuals, weights, strict=True):
        if robust is None:
            gram += w * w * (g.T @ g)
            slope += w * w * (g.T @ r)
        else:
            counts = 1.0 / np.sqrt(1.0 + (r * w / robust) ** 2)
            gram += w * w * (g.T @ (counts[:, None] * g))
            slope += w * w * (g.T @ (counts * r))
    return gram, slope


def at_bound(theta: Floats, slope: Floats, *, low: Floats, high: Floats) -> Mask:
    """Which parameters (K,) are on a bound and would leave it where the misfit falls along `slope`."""
    return ((theta <= low) & (slope < 0.0)) | ((theta >= high) & (slope > 0.0))


def _bounded_step(theta: Floats, gram: Floats, slope: Floats, damping: float, *, low: Floats, high: Floats) -> Floats:
    """Damped Gauss–Newton step within the bounds: parameters that would leave them are held."""
    move = ~at_bound(theta, slope, low=low, high=high) & (np.diag(gram) > _UNSEEN)
    step = np.zeros_like(theta)
    if np.any(move):
        scale = np.sqrt(np.diag(gram)[move])
        scaled = gram[np.ix_(move, move)] / np.outer(scale, scale)
        scaled[np.diag_indices_from(scaled)] += damping
        step[move] = np.linalg.solve(scaled, slope[move] / scale) / scale
    # A positive parameter approaches zero by factors; it reaches a bound only where zero has a meaning.
    positive = (low > 0.0) & (theta > low)
    nearest = np.where(positive, theta / _SHRINK, low)
    return np.clip(theta + step, np.maximum(low, nearest), high) - theta


def _result(
    model: Model,
    evaluation: Evaluation,
    weights: Sequence[float],
    robust: float | None,
    free: Mask,
    counts: tuple[int, int],
    converged: bool,
    reason: str,
) -> Fit:
    gram, _ = _normal(evaluation, weights, robust)
    chi2 = _cost(evaluation, weights, robust)
    samples = sum(r.size for r in evaluation.residuals)
    excess = max(chi2 / max(samples - int(free.sum()), 1), 1.0)
    inverse = inverse_gram(gram)
    covariance = _widened(excess * inverse, inverse, _pulls(evaluation, weights, robust))
    std = np.full(free.size, np.nan)
    std[free] = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    total = sum(float(np.dot(r, r)) for r in evaluation.residuals)
    return Fit(
        model=model.with_std(std),
        residuals=evaluation.residuals,
        rms=float(np.sqrt(total / samples)),
        chi2=chi2,
        samples=samples,
        covariance=covariance,
        jacobian_gram=gram,
        iterations=counts[0],
        evaluations=counts[1],
        converged=converged,
        reason=reason,
    )


def _pulls(evaluation: Evaluation, weights: Sequence[float], robust: float | None) -> Floats:
    """What each part of each record pulls the parameters by, (B, K): Σ ∇f·e/σ² over the samples of the part."""
    pulls, records = [], len(evaluation.residuals)
    wanted = max(_PARTS, _PARTS_OF_ONE * evaluation.gradients[0].shape[1])
    parts = max(-(-wanted // records), _PARTS_OF_RECORD)
    for g, r, w in zip(evaluation.gradients, evaluation.residuals, weights, strict=True):
        counts = 1.0 if robust is None else 1.0 / np.sqrt(1.0 + (r * w / robust) ** 2)
        each = g * (w * w * counts * r)[:, None]
        edges = np.linspace(0, r.size, min(parts, r.size), endpoint=False).astype(int)
        pulls.append(np.add.reduceat(each, edges, axis=0))
    return np.concatenate(pulls)


def _widened(covariance: Floats, inverse: Floats, pulls: Floats) -> Floats:
    """The covariance, each parameter's deviation no less than the scatter of the pulls says, (K, K).

    Residuals that remember (coloured noise, an effect that the model lacks) pull a parameter the same way for a while:
    H⁻¹·Σ s·sᵀ·H⁻¹ over parts (White 1980, Liang and Zeger 1986), with s the pull of a part and H the Gram matrix.
    """
    parts, width = pulls.shape
    steps = pulls @ inverse
    scatter = np.sum(steps**2, axis=0) * parts / max(parts - width, 1)
    wider = np.sqrt(np.maximum(scatter / np.maximum(np.diag(covariance), 1e-300), 1.0))
    return covariance * np.outer(wider, wider)


def inverse_gram(gram: Floats) -> Floats:
    """Inverse of a Gram matrix in its own scaling; what the data do not determine gets a huge variance, not a nan."""
    scale = np.sqrt(np.where(np.diag(gram) > _UNSEEN, np.diag(gram), 1.0))
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    inverse = (vectors / np.maximum(values, 1e-12)) @ vectors.T
    out: Floats = inverse / np.outer(scale, scale)
    return out
