"""The gradient of a simulated force, from differences of simulations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion
from identification.physical.model import Element, Model
from identification.physical.simulate import simulate
from tests.identification.motions import motion

Floats = NDArray[np.float64]


def freed(e: Element) -> Element:
    return Element(e.name, tuple(replace(p, fixed=False) for p in e.parameters))


def extrapolated(model: Model, k: int, inputs: Motion | None = None) -> Floats:
    """∂force/∂θ_k, (N,): central differences of step h and h/2, their error of order h² taken out."""
    values, inputs = model.values(), inputs or motion()
    differences = []
    for step in (2e-4, 1e-4):
        h = step * max(abs(values[k]), 1e-3)
        forces = []
        for side in (h, -h):
            moved = values.copy()
            moved[k] += side
            forces.append(simulate(model.with_values(moved), inputs).force)
        differences.append((forces[0] - forces[1]) / (2 * h))
    return np.asarray((4 * differences[1] - differences[0]) / 3)


def gradient_error(model: Model, inputs: Motion) -> float:
    """Largest median deviation of the gradient from central differences, relative to each column's size."""
    gradient = simulate(model, inputs, gradient=True).gradient
    assert gradient is not None
    values, worst = model.values(), 0.0
    for k in np.flatnonzero(model.free()):
        step = 1e-5 * max(abs(values[k]), 1e-2)
        up, down = values.copy(), values.copy()
        up[k] += step
        down[k] -= step
        if down[k] < model.bounds()[0][k]:
            continue
        forces = [simulate(model.with_values(v), inputs).force for v in (up, down)]
        column = (forces[0] - forces[1]) / (2 * step)
        size = float(np.sqrt(np.mean(column**2)))
        if size > 0.0:
            worst = max(worst, float(np.median(np.abs(column - gradient[:, k]))) / size)
    return worst
