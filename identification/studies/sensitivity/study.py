"""The sensitivity study: the grid of levels, networks on it, variance-based indices, and local slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.compute import run
from identification.errors import DataError
from identification.physical.model import Model
from identification.physical.simulate import simulate
from identification.steady import steady_cycles
from identification.studies.journal import carry_on
from identification.studies.pace import Tell, silent
from identification.studies.sensitivity.asked import Sensitivity, places_of
from identification.studies.sensitivity.network import Samples, Share, trained_share
from identification.studies.sensitivity.result import Sensitive
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_GROUP = 125  # samples of a task


@dataclass(frozen=True, slots=True)
class _Changes:
    """A task: rms change of the force, N, of relative parameters (G, K), (G,)."""

    model: Model
    places: tuple[int, ...]
    asked: Sensitivity
    force: Floats  # of the model itself over a settled period

    def identity(self) -> bytes:
        """The same for the same task."""
        text = "\0".join([*self.model.names(), repr(self.asked), repr(self.places)])
        return text.encode() + self.model.values().tobytes()

    def __call__(self, factors: Floats) -> Floats:
        motion, changes = self.asked.motion(), np.empty(len(factors))
        for k, own in enumerate(factors):
            values = self.model.values()
            values[list(self.places)] *= own
            force = self.model.with_values(values).force(motion)[-self.force.size :]
            changes[k] = np.sqrt(np.mean((force - self.force) ** 2))
        return changes


@dataclass(frozen=True, slots=True)
class _Training:
    """A task: the share by a network of one seed."""

    samples: Samples
    unseen: Samples
    outputs: tuple[float, float]
    hidden: int

    def __call__(self, seed: int) -> Share:
        return trained_share(self.samples, self.unseen, self.outputs, self.hidden, seed)


def at_run(asked: Sensitivity, runs: Sequence[Run]) -> Sensitivity:
    """The study at amplitude, frequency and mean current of the first run that is a steady sine.

    Raises
    ------
    DataError
        Where none is.
    """
    for one in runs:
        cycles = steady_cycles(one)
        if cycles is not None:
            current = asked.current_a if cycles.current is None else cycles.current
            return replace(asked, amplitude_m=cycles.amplitude_m, frequency_hz=cycles.frequency_hz, current_a=current)
    raise DataError("no run is a steady sine: it would state the operating point of the study")


def check_sensitivity(model: Model, asked: Sensitivity) -> list[int]:
    """Places of what varies; raises as `sensitivity` does, before any grid is simulated."""
    places = places_of(model, asked)
    force = model.force(asked.motion())
    if not np.ptp(force) > 0.0:
        raise DataError(f"'{model.name}' gives a constant force at this operating point: there is nothing to compare")
    return places


def sensitivity(model: Model, asked: Sensitivity, *, tell: Tell = silent, journal: Path | None = None) -> Sensitive:
    """How much each parameter changes the force at one operating point, by four methods.

    The output is S = rms(F' − F) over a settled period. A network K–H–1 learns S from a full grid of levels, and
    Garson's weights share it among the parameters; Sobol's indices of S (Saltelli's estimators) do so by variance over
    the same box; one parameter at a time; and the rms of p·∂F/∂p at the model itself.

    Raises
    ------
    ModelError, DataError
        Before the grid is simulated, see `check_sensitivity`.

    References
    ----------
    Zhang, Shi & Chen, Shock and Vibration, 2021, section 4: the grid and the network. Saltelli et al., Computer Physics
    Communications 181, 2010: the indices.
    """
    places = check_sensitivity(model, asked)
    motion = asked.motion()
    force = model.force(motion)[-motion.period :]
    task = _Changes(model, tuple(places), asked, force)
    grid = np.array(list(product(asked.levels, repeat=len(places))))
    drawn = _saltelli(task, grid, asked, journal, tell)
    changes, (first, total) = drawn
    networks = _networks(grid, changes, asked)
    tell(1.0, "networks trained")
    return Sensitive(
        model=model.name, asked=asked, names=tuple(model.names()[k] for k in places), values=model.values()[places],
        changes=changes, networks=networks, first=first, total=total, alone=_alone(grid, changes),
        slopes=_slopes(model, places, asked),
    )  # fmt: skip


def _saltelli(
    task: _Changes, grid: Floats, asked: Sensitivity, journal: Path | None, tell: Tell
) -> tuple[Floats, tuple[Floats, Floats]]:
    """The changes of the grid, and the indices of first order and total, all simulated in one go."""
    from scipy.stats import sobol_indices, uniform  # 0.3 s to import: only where it is needed

    box: Any = uniform(min(asked.levels), np.ptp(asked.levels))  # Any: the stubs know only scalar quantiles
    taken: list[Floats] = []

    def indices(answers: list[Floats]) -> tuple[Floats, Floats]:
        def function(x: Floats) -> Floats:
            if not answers:
                taken.append(x.T.copy())
                return np.asarray(x.sum(axis=0))
            return answers.pop(0)

        found = sobol_indices(
            func=function, n=asked.base_samples, dists=[box] * grid.shape[1],
            rng=np.random.default_rng(asked.seed),
        )  # fmt: skip
        return np.asarray(found.first_order).ravel(), np.asarray(found.total_order).ravel()

    indices([])  # which points it asks for
    points = np.concatenate([grid, *taken])
    groups = [points[k : k + _GROUP] for k in range(0, len(points), _GROUP)]
    parts = carry_on(task, groups, identity=task.identity(), journal=journal, what="simulating", tell=tell)
    changes = np.concatenate(parts)
    ends = np.cumsum([len(grid), *(len(t) for t in taken)])
    answers = [changes[a:b] for a, b in pairwise(ends)]
    return changes[: len(grid)], indices(answers)


def _networks(grid: Floats, changes: Floats, asked: Sensitivity) -> tuple[Share, ...]:
    low, high = float(changes.min()), float(changes.max())
    span = max(asked.levels) - min(asked.levels)
    inputs = 2.0 * (grid - min(asked.levels)) / span - 1.0
    outputs = 2.0 * (changes - low) / (high - low) - 1.0
    order = np.random.default_rng(asked.seed).permutation(len(grid))
    learned = order[: round(asked.trained * len(grid))]
    unseen = order[learned.size :]
    task = _Training(
        Samples(inputs[learned], outputs[learned]), Samples(inputs[unseen], outputs[unseen]), (low, high), asked.hidden
    )
    return tuple(run(task, [asked.seed + k for k in range(asked.networks)]))


def _alone(grid: Floats, changes: Floats) -> Floats:
    """Greatest change over the levels of one parameter, the others as near to the model as the levels allow, N."""
    levels = np.unique(grid)
    middle = levels[np.argmin(np.abs(levels - 1.0))]
    others = [(np.delete(grid, k, axis=1) == middle).all(axis=1) for k in range(grid.shape[1])]
    return np.array([changes[rows].max() for rows in others])


def _slopes(model: Model, places: list[int], asked: Sensitivity) -> Floats:
    motion = asked.motion()
    gradient = simulate(model, motion, gradient=True).gradient
    assert gradient is not None  # asked for
    return np.asarray(
        np.sqrt(np.mean(gradient[-motion.period :, places] ** 2, axis=0)) * np.abs(model.values()[places])
    )
