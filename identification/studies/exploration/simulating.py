"""The figures of many parameter sets over one test: in lanes where the model is an enriched Maxwell one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.physical.literature import LITERATURE
from identification.physical.model import Model, is_controlled
from identification.studies.exploration import lanes
from identification.studies.exploration.sine_tests import SineTest

Floats = NDArray[np.float64]

CYCLES = 3
"""Fewest cycles of a test that are simulated; the last counts."""
_MOST_CYCLES = 60
_SETTLED = 1e-6  # of the dashpot's force at peak speed: how far the end of a cycle may be from its limit
_SLOWEST = 0.999  # ratio of two steps towards the limit: nearer to 1 they tell nothing of it
_ROWS = (lanes.F1, lanes.S, lanes.D, lanes.F2, lanes.K1, lanes.K2)
_MOUNT, _CURVE = (name for name, _ in LITERATURE["enriched Maxwell"])
_PLACES = (*(f"{_CURVE}.{p}" for p in ("F1", "S", "d", "F2")), *(f"{_MOUNT}.{p}" for p in ("k1", "k2")))


def in_lanes(model: Model) -> bool:
    """Whether the model is an enriched Maxwell model and nothing else."""
    return sorted(model.ids) == sorted((_MOUNT, _CURVE)) and not any(map(is_controlled, model.elements))


def figures_over(model: Model, values: Floats, tests: Sequence[SineTest]) -> Floats:
    """Figures of parameter sets (L, P) over every test, (L, T, 3); not a number where a simulation fails."""
    one = _by_lanes if in_lanes(model) else _by_itself
    return np.stack([one(model, values, test) for test in tests], axis=1)


def _by_itself(model: Model, values: Floats, test: SineTest) -> Floats:
    motion, force = test.motion(), np.full((test.x.size, len(values)), np.nan)
    for k, own in enumerate(values):
        try:
            force[:, k] = model.with_values(own).force(motion)[-test.x.size :]
        except SimulationError:
            continue
    return test.figures(force)


def _by_lanes(model: Model, values: Floats, test: SineTest) -> Floats:
    groups = [values[k : k + lanes.LANES] for k in range(0, len(values), lanes.LANES)]
    return np.concatenate([test.figures(lane_forces(model, g, test))[: len(g)] for g in groups])


def lane_forces(model: Model, values: Floats, test: SineTest) -> Floats:
    """Force of up to LANES parameter sets along a settled cycle, (N, LANES), N; lanes that are left over repeat."""
    names, own = model.names(), np.resize(np.arange(len(values)), lanes.LANES)
    work = np.zeros((lanes.ROWS, lanes.LANES))
    for row, name in zip(_ROWS, _PLACES, strict=True):
        work[row] = values[own, names.index(name)]
    work[lanes.RATE] = work[lanes.K2] / values[own, names.index(f"{_MOUNT}.c2")]
    work[lanes.F1] *= 2.0 / np.pi
    speed = float(np.max(np.abs(test.v)))
    work[lanes.SCALE] = work[lanes.F1] * np.arctan(work[lanes.S] * speed) + work[lanes.D] * speed
    force, state = np.empty((test.x.size, lanes.LANES)), work[[lanes.E, lanes.Y]]
    step = np.zeros_like(state)
    for count in range(1, _MOST_CYCLES + 1):
        lanes.cycle(test.x, test.v, test.dt, work.ravel(), force)
        before, step, state = step, work[[lanes.E, lanes.Y]] - state, work[[lanes.E, lanes.Y]]
        ahead = _still_to_come(before, step)
        off = np.abs(work[lanes.K1] * ahead[0]) + np.abs(ahead[1])
        if count >= CYCLES and np.all(off <= _SETTLED * work[lanes.SCALE]):
            break
        if count % CYCLES == 0:
            state = state + ahead
            work[[lanes.E, lanes.Y]] = state
    return np.roll(force, 1, axis=0)  # row n was that of sample n + 1


def _still_to_come(before: Floats, step: Floats) -> Floats:
    """How far a state is from its end when its steps from cycle to cycle decrease geometrically (Aitken 1926)."""
    ratio = np.divide(step, before, out=np.zeros_like(step), where=before != 0.0)
    ratio = np.clip(ratio, 0.0, _SLOWEST)
    return np.asarray(step * ratio / (1.0 - ratio))
