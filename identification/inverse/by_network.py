"""The inversion of a network sample by sample, its state carried along."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.held_input import next_forces
from identification.blackbox.model import BlackBox, Member, check_rate
from identification.blackbox.network import Network, network
from identification.blackbox.samples import course_along, samples_of
from identification.blackbox.structure import FORCE
from identification.inverse.reach import LEVELS, Limits
from identification.inverse.wanted import Wanted

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]

# Samples over which a current is held to see what it does: a network answers a current over several samples, and a
# force that is to be met at the next alone asks for one extreme after the other. Half: the current rings where two of
# its delays nearly cancel; double: it comes earlier and less exactly.
AHEAD = 4


def by_network(forward: BlackBox, wanted: Wanted, limits: Limits, stillness: float) -> Floats:
    """The current (N,), A, of least squares over the next samples, at each sample from the state that it has led to.

    At sample t every member is simulated over `AHEAD` samples from its own past, once for each level of a current that
    is held. With the median force F_j(c) straight between the levels, the root of Σ_j (F_j(c) − F*_j)² +
    `stillness`·(c − c₋)² is known in closed form; c₋ is the current before. Its first sample is kept: the members go
    on by it. Motion and wanted force are seen `AHEAD` samples ahead. `stillness` is in N²/A².

    Raises
    ------
    SimulationError
        when the sample rate is not that of the training.
    """
    check_rate(forward.name, forward.dt, wanted.motion.dt)
    levels, n = limits.levels(LEVELS), wanted.force.size
    past = [_Past.of(forward, member, wanted, limits.low) for member in forward.members]
    current, before = np.empty(n), limits.low
    next_one = [one.ahead(1) for one in past]
    for t in range(n):
        count = min(AHEAD, n - t)
        if t == 0 or count < AHEAD:
            next_ones = [one.ahead(count) for one in past]
        forces = _median([one.tried(t, levels) for one in next_ones])
        before = _least(forces, levels, wanted.force[t : t + count], stillness * count, before)
        current[t] = before
        for one in next_one:
            one.go_on(t, before)
    return current


@dataclass(frozen=True, slots=True)
class _Past:
    """A member along a motion: its inputs, and the scaled forces that it has given so far."""

    net: Network
    weights: Floats
    inputs: Floats  # (lead + N, m)
    force: Floats  # (lead + N,)
    lead: int
    columns: Whole  # of the current and its delays among the inputs
    ages: Whole  # the delay of each, samples
    scale: tuple[float, float]  # centre and size of the current
    unit: tuple[float, float]  # of the force

    @staticmethod
    def of(forward: BlackBox, member: Member, wanted: Wanted, first: float) -> _Past:
        """The member just before the first sample, the lead simulated with the first current."""
        net = network(member.structure, forward.scales)
        samples = samples_of([course_along(wanted.driven(first))], member.structure, forward.scales)
        scale, force = forward.scales["current"], forward.scales[FORCE]
        columns = [(k, one.delay) for k, one in enumerate(member.structure.inputs) if one.signal == "current"]
        return _Past(
            net=net,
            weights=member.weights,
            inputs=samples.inputs,
            force=net.simulate(member.weights, samples),
            lead=samples.force.size - wanted.force.size,
            columns=np.array([k for k, _ in columns], dtype=np.int64),
            ages=np.array([delay for _, delay in columns], dtype=np.int64),
            scale=(scale.centre, scale.size),
            unit=(force.centre, force.size),
        )

    def ahead(self, count: int) -> _Ahead:
        """The member over the next `count` samples at a time."""
        structure = self.net.structure
        size, lanes = structure.longest + count, structure.lanes
        given = (
            np.array(structure.fed_back, dtype=np.int64), self.inputs, self.force, self.columns, self.ages,
            self.net.limits, (0,) * lanes, np.empty((size, self.inputs.shape[1])), np.empty(size, dtype=np.int64),
            np.empty(size), np.empty(size),
        )  # fmt: skip
        return _Ahead(self, count, given)

    def take(self, t: int, current: float) -> None:
        """Take a current for sample t."""
        scaled = (current - self.scale[0]) / self.scale[1]
        for column, age in zip(self.columns.tolist(), self.ages.tolist(), strict=True):
            self.inputs[self.lead + t + age : self.lead + t + age + 1, column] = scaled


@dataclass(frozen=True, slots=True)
class _Ahead:
    """A member with the working space of its loop, so that nothing is made anew at every sample."""

    past: _Past
    count: int
    given: tuple[Any, ...]  # Any: what the compiled loop takes

    def tried(self, t: int, levels: Floats) -> Floats:
        """The force, N, of every level held from sample t on, (K, count)."""
        return self._next(t, (levels - self.past.scale[0]) / self.past.scale[1]) * self.past.unit[1] + self.past.unit[0]

    def go_on(self, t: int, current: float) -> None:
        """Take a current for sample t, and the force that the member then gives."""
        past = self.past
        past.take(t, current)
        scaled = (current - past.scale[0]) / past.scale[1]
        past.force[past.lead + t] = self._next(t, np.array([scaled]))[0, 0]

    def _next(self, t: int, levels: Floats) -> Floats:
        delays, inputs, force, columns, ages, limits, nodes, *space = self.given
        out = np.empty((levels.size, self.count))
        at = self.past.lead + t
        next_forces(
            self.past.weights, delays, inputs, force, at, columns, ages, levels, limits, nodes, *space, out
        )  # fmt: skip
        return out


def _median(forces: Sequence[Floats]) -> Floats:
    """The median of some arrays; numpy's own takes ten times as long for few numbers."""
    ordered, middle = np.sort(forces, axis=0), len(forces) // 2
    return np.asarray(ordered[middle] if len(forces) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle]))


def _least(forces: Floats, levels: Floats, wanted: Floats, stillness: float, before: float) -> float:
    """The current of least cost, forces (K, J) straight between the levels (K,)."""
    step = levels[1] - levels[0]
    slope, off = np.diff(forces, axis=0) / step, wanted - forces[:-1]
    steep = np.einsum("kj,kj->k", slope, slope) + stillness
    best = levels[:-1] + (np.einsum("kj,kj->k", slope, off) + stillness * (before - levels[:-1])) / steep
    best = np.clip(best, levels[:-1], levels[1:])
    rest = off - slope * (best - levels[:-1])[:, None]
    cost = np.einsum("kj,kj->k", rest, rest) + stillness * (best - before) ** 2
    return float(best[np.argmin(cost)])
