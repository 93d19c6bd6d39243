"""Nonlinear least squares over several records: Levenberg–Marquardt with exact gradients inside physical bounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.physical.control import effective_current
from identification.physical.elements import TONE
from identification.physical.model import Element, Model, Parameter
from identification.physical.motion import Motion
from identification.physical.simulate import simulate, without_hum
from identification.record import Record

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_SHRINK = 5.0  # a parameter that must stay above zero may lose at most this factor in a step
_DAMPINGS = 10
_RUNAWAY = 1e100  # a gradient that squares to infinity
_UNSEEN = 1e-200  # a sum of squares from which no finite variance follows
_FORGOTTEN = 1e-3  # of the width of a magnet's hysteresis
_FEWEST = 2  # samples: one is no motion
_WORKERS = 2  # the solver releases the interpreter lock


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """A fitted model and how far it can be trusted.

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


def predict(model: Model, record: Record, *, gradient: bool | Mask = False) -> tuple[Floats, Floats | None]:
    """Simulated force in the record's window, (M,), N, and, where asked, its gradient (M, P); see `simulate`.

    A model on top of another program's simulation adds to that. Mains hum has a phase of its own in every run: it is
    set to the one that fits this record best. So is what the current before the run left in a magnetic circuit with
    hysteresis.
    """
    if model.has(TONE.name):
        model = in_phase(model, record)
    motion = record.motion
    if any(e.spec.remanent for e in model.elements) and record.has_current:
        motion = _as_left(model, record)
    response = simulate(model, motion, gradient=gradient)
    full, whole = response.gradient, response.force
    with np.errstate(over="ignore", invalid="ignore"):  # what runs away is told by the sums of its gradient
        force = record.seen(whole)
        full = None if full is None else record.seen(full)
    if record.simulated is not None:
        force = force + record.simulated[record.window]
    return force, full


def _as_left(model: Model, record: Record) -> Motion:
    """The record's motion with the remanence that fits it best: −1 for a current from far below, 1 from far above."""
    low, high = (replace(record.motion, remanence=r) for r in (-1.0, 1.0))
    control = model.on("control")
    after = [effective_current(control, m.i, m.dt, m.period, m.remanence)[0] for m in (low, high)]
    window = _until_forgotten(after[1] - after[0], record)
    if window.size == 0:
        return record.motion
    shown = max(int(window[-1]) + 1, _FEWEST)
    down, up = (simulate(model, m if m.period else m.head(shown)).force[window] for m in (low, high))
    half, rest = 0.5 * (up - down), record.force[window] - 0.5 * (up + down)
    if record.simulated is not None:
        rest = rest - record.simulated[window]
    if not 0.0 < np.max(np.abs(half)) < _RUNAWAY:
        return record.motion
    share = float(np.dot(rest, half) / np.dot(half, half))
    return replace(record.motion, remanence=min(max(share, -1.0), 1.0))


def _until_forgotten(apart: Floats, record: Record) -> NDArray[np.int64]:
    """The samples of the record's window up to the last in which what was left in the magnet shows in the current."""
    shows = np.flatnonzero(np.abs(apart) > _FORGOTTEN * np.max(np.abs(apart)))
    samples = np.arange(apart.size)[record.window]
    return samples[samples <= (shows[-1] if shows.size else -1)]


def in_phase(model: Model, record: Record) -> Model:
    """The model with the phase of its mains hum as it is in `record`."""
    rest = record.force - simulate(without_hum(model), record.motion).force
    if record.simulated is not None:
        rest = rest - record.simulated
    elements = [replace(e, parameters=_turned(e, rest, record)) if e.spec.tone else e for e in model.elements]
    return replace(model, elements=tuple(elements))


def _turned(hum: Element, rest: Floats, record: Record) -> tuple[Parameter, ...]:
    turn = 2.0 * np.pi * hum.value("frequency") * record.motion.t[record.window]
    late = rest[record.window]
    phase = float(np.arctan2(np.dot(late, np.cos(turn)), np.dot(late, np.sin(turn))))
    amplitude, frequency, old = hum.parameters
    return amplitude, frequency, replace(old, value=phase)


@cache
def _pool() -> ThreadPoolExecutor:
    """One pool for all evaluations: to start its threads anew for each took an eighth of a search."""
    return ThreadPoolExecutor(_WORKERS, thread_name_prefix="evaluate")


def evaluate(model: Model, records: Sequence[Record], free: Mask) -> Evaluation:
    """Residuals (M,), N, and gradients of the force (M, K) for every record, computed in parallel.

    Raises
    ------
    SimulationError
        when the model gives no finite force on one of the records.
    """

    def one(record: Record) -> tuple[Floats, Floats]:
        force, gradient = predict(model, record, gradient=free)
        assert gradient is not None
        if not np.max(np.abs(gradient), initial=0.0) < _RUNAWAY:
            raise SimulationError(f"'{model.name}' runs away on {record.name}: its gradient overflows")
        return record.measured - force, gradient

    pairs = [one(records[0])] if len(records) == 1 else list(_pool().map(one, records))
    return Evaluation(tuple(r for r, _ in pairs), tuple(g for _, g in pairs))


def free_parameters(model: Model, records: Sequence[Record]) -> Mask:
    """Which parameters these records can move, (P,): not the fixed, not those of a signal that none of them has."""
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
                break  # a step that a bound has bent may promise a rise: then only more damping helps
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
    """The damping after a step that kept so much of what it promised; less at once after every success would be too
    little every second time (Nocedal & Wright 2006, algorithm 4.1)."""
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


def _bounded_step(theta: Floats, gram: Floats, slope: Floats, damping: float, *, low: Floats, high: Floats) -> Floats:
    """Damped Gauss–Newton step that stays within bounds: what would leave them is held, the others solve again."""
    active = ((theta <= low) & (slope < 0.0)) | ((theta >= high) & (slope > 0.0))
    move = ~active & (np.diag(gram) > _UNSEEN)
    step = np.zeros_like(theta)
    if np.any(move):
        scale = np.sqrt(np.diag(gram)[move])
        scaled = gram[np.ix_(move, move)] / np.outer(scale, scale)
        scaled[np.diag_indices_from(scaled)] += damping
        step[move] = np.linalg.solve(scaled, slope[move] / scale) / scale
    # What must stay positive approaches zero by factors, and lands on a bound only where zero is a meaning of its own.
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
    covariance = excess * _inverse(gram)
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


def _inverse(gram: Floats) -> Floats:
    """Inverse of a Gram matrix in its own scaling; what the data don't see gets a huge variance, not a nan."""
    scale = np.sqrt(np.where(np.diag(gram) > _UNSEEN, np.diag(gram), 1.0))
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    inverse = (vectors / np.maximum(values, 1e-12)) @ vectors.T
    out: Floats = inverse / np.outer(scale, scale)
    return out
