"""Limited-memory BFGS without BLAS: scipy's uses it, and its last bits depend on the processor."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Minimum", "Pairs", "minimise"]

Vector: TypeAlias = NDArray[np.float64]
Pairs: TypeAlias = Sequence[tuple[Vector, Vector, float]]


@dataclass(frozen=True, slots=True, eq=False)
class Minimum:
    """Where the search ended and why: "converged", "iterations" (none left), "flat" (no descent found) or "enough"
    (the caller's criterion).
    """

    x: Vector
    value: float
    iterations: int
    evaluations: int
    reason: str
    pairs: Pairs  # steps, changes of the gradient and their products: what the search learned of the curvature


def minimise(
    function: Callable[[Vector], tuple[float, Vector]],
    start: Vector,
    *,
    iterations: int,
    first_step: float,
    memory: int = 20,
    tolerance: float = 1e-9,
    enough: Callable[[int, Vector], bool] | None = None,
    pairs: Pairs = (),
) -> Minimum:
    """A local minimum of ``function``, which gives value and gradient, by the two-loop recursion.

    ``first_step``: length of the first step, unit of x, where no ``pairs`` of an earlier search of nearly the same
    function tell it. Ends when the value falls by less than ``tolerance`` of itself in one iteration, or when
    ``enough(iteration, x)`` says so. The line search halves by a safeguarded parabola until the value falls by 1e-4 of
    the decrease predicted by the slope, and lengthens the step once while the slope is still steep.

    References
    ----------
    Nocedal & Wright, Numerical Optimization, 2nd ed., 2006, algorithms 7.4 and 3.5 (simplified).
    """
    x = start
    value, gradient = function(x)
    known = deque(pairs, maxlen=memory)
    evaluations = 1
    for iteration in range(1, iterations + 1):
        direction = _direction(gradient, known, first_step)
        slope = _dot(gradient, direction)
        if not slope < 0.0:
            known.clear()
            direction = _direction(gradient, known, first_step)
            slope = _dot(gradient, direction)
            if not slope < 0.0:
                return Minimum(x, value, iteration, evaluations, "flat", known)
        found = _line_search(function, x, value, direction, slope)
        evaluations += found[3]
        new_x, new_value, new_gradient = found[:3]
        if not new_value < value:
            if not known:
                return Minimum(x, value, iteration, evaluations, "flat", known)
            known.clear()
            continue
        step, change = new_x - x, new_gradient - gradient
        curvature = _dot(step, change)
        if curvature > 1e-12 * _dot(change, change):
            known.append((step, change, curvature))
        fell = value - new_value
        x, value, gradient = new_x, new_value, new_gradient
        if fell <= tolerance * abs(value):
            return Minimum(x, value, iteration, evaluations, "converged", known)
        if enough is not None and enough(iteration, x):
            return Minimum(x, value, iteration, evaluations, "enough", known)
    return Minimum(x, value, iterations, evaluations, "iterations", known)


def _dot(a: Vector, b: Vector) -> float:
    return float((a * b).sum())


def _direction(gradient: Vector, pairs: deque[tuple[Vector, Vector, float]], first_step: float) -> Vector:
    """−H·g by the two-loop recursion; the steepest descent of length ``first_step`` without memory."""
    if not pairs:
        length: float = np.sqrt(_dot(gradient, gradient))
        return gradient * (-first_step / max(length, 1e-300))
    direction: Vector = -gradient
    shares = []
    for step, change, curvature in reversed(pairs):
        share = _dot(step, direction) / curvature
        shares.append(share)
        direction = direction - share * change
    _, change, curvature = pairs[-1]
    direction = direction * (curvature / _dot(change, change))
    for (step, change, curvature), share in zip(pairs, reversed(shares), strict=True):
        direction = direction + (share - _dot(change, direction) / curvature) * step
    return direction


def _line_search(
    function: Callable[[Vector], tuple[float, Vector]], x: Vector, value: float, direction: Vector, slope: float
) -> tuple[Vector, float, Vector, int]:
    """Point, value and gradient along the direction, and how often the function was called."""
    length, calls = 1.0, 0
    best: tuple[Vector, float, Vector] | None = None
    for _ in range(20):
        trial = x + length * direction
        new_value, new_gradient = function(trial)
        calls += 1
        if best is not None and not new_value < best[1]:
            break  # the longer step is worse
        if new_value <= value + 1e-4 * length * slope:
            best = (trial, new_value, new_gradient)
            if _dot(new_gradient, direction) >= 0.9 * slope:
                break
            length *= 2.5
        elif best is not None:
            break
        else:
            parabola = -0.5 * slope * length * length / (new_value - value - slope * length)
            length = min(0.5 * length, max(0.1 * length, parabola))
    return (*(best or (x, value, direction)), calls)
