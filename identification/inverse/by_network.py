"""The inversion of a network sample by sample, its state carried along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.model import BlackBox, Member, check_rate
from identification.blackbox.network import Network, network
from identification.blackbox.samples import Samples, course_along, samples_of
from identification.blackbox.structure import FORCE
from identification.inverse.reach import LEVELS, Limits
from identification.inverse.wanted import Wanted

Floats = NDArray[np.float64]

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
    for t in range(n):
        count = min(AHEAD, n - t)
        forces = np.median([one.tried(t, count, levels) for one in past], axis=0)
        before = _least(forces, levels, wanted.force[t : t + count], stillness * count, before)
        current[t] = before
        for one in past:
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
    currents: tuple[tuple[int, int], ...]  # column and delay of each regressor of the current
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
            currents=tuple(columns),
            scale=(scale.centre, scale.size),
            unit=(force.centre, force.size),
        )

    def tried(self, t: int, count: int, levels: Floats) -> Floats:
        """The force, N, of every level held from sample t on, (K, count)."""
        longest, at = self.net.structure.longest, self.lead + t
        rows = np.repeat(self.inputs[None, at - longest : at + count], levels.size, axis=0)
        for column, delay in self.currents:
            rows[:, longest + delay :, column] = ((levels - self.scale[0]) / self.scale[1])[:, None]
        known = np.zeros((levels.size, longest + count))
        known[:, :longest] = self.force[at - longest : at]
        size = longest + count
        begin = np.repeat(np.arange(levels.size) * size + longest, size)
        flat = Samples(rows.reshape(-1, rows.shape[2]), known.ravel(), begin, np.ones(begin.size, dtype=np.bool_))
        scaled = self.net.simulate(self.weights, flat).reshape(levels.size, size)[:, longest:]
        return np.asarray(scaled * self.unit[1] + self.unit[0])

    def go_on(self, t: int, current: float) -> None:
        """Take a current for sample t, and the force that the member then gives."""
        at, scaled = self.lead + t, (current - self.scale[0]) / self.scale[1]
        for column, delay in self.currents:
            self.inputs[at + delay : at + delay + 1, column] = scaled
        longest = self.net.structure.longest
        window = slice(at - longest, at + 1)
        begin = np.full(longest + 1, longest)
        one = Samples(self.inputs[window], self.force[window].copy(), begin, np.ones(longest + 1, dtype=np.bool_))
        self.force[at] = self.net.simulate(self.weights, one)[-1]


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
