"""Selects regressors by the simulation error: extend by the best one, drop those without which it is no higher.

Piroddi and Spinelli (2003), as Witters and Swevers (2009) use it for an output-error network. They train every
structure that one regressor more or less makes. With a `shortlist` only those are trained whose error promises most:
what a step of least squares would gain from a regressor's weights, or lose without them, follows from the gradient of
the free run at hand (`promise`). The search ends only where no regressor at all lowers the error.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.levenberg import train
from identification.blackbox.model import Member
from identification.blackbox.network import network
from identification.blackbox.promise import gains, inherited, losses
from identification.blackbox.samples import Course, samples_of
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import Regressor, Structure
from identification.blackbox.training import FULL, train_member
from identification.compute import run

Floats = NDArray[np.float64]

MOST_STEPS = 40  # of least squares for one structure, from the weights of the one it was made of
LEAST_GAIN = 0.01  # of the error: less is the chance of a start
DECAY = 0.02


@dataclass(frozen=True, slots=True)
class Tried:
    """A structure, its mean square scaled error in free run on the training, and its weights."""

    structure: Structure
    error: float
    weights: Floats = field(compare=False)

    @property
    def rrmsse(self) -> float:
        """Root of the error, % of the force about its mean."""
        return 100.0 * float(np.sqrt(self.error))


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the path: what was done (`start`, `+v1`, `−F2`), the structure after it, and how many were tried."""

    act: str
    tried: Tried
    count: int


Known = Mapping[str, Tried]
"""What was tried before, by the text of the structure: it is not tried again."""


def candidates(symbols: Sequence[str], longest: int) -> list[Regressor]:
    """Every regressor of some signals up to a delay; of the force from 1 on."""
    return [Regressor(one, delay) for one in symbols for delay in range(1 if one == "F" else 0, longest + 1)]


def select(
    courses: Sequence[Course],
    scales: Scales,
    start: Structure,
    offered: Sequence[Regressor],
    *,
    known: Known | None = None,
    most: int = 12,
    shortlist: int | None = None,
    on_step: Callable[[Step, Known], None] | None = None,
) -> list[Step]:
    """The path of the search from a start to where no regressor lowers the error by `LEAST_GAIN`, or `most` are used.

    `on_step` is told each step with all that was tried so far; given back as `known`, an interrupted search goes on
    where it was. A structure begins from the weights of the one it was made of. Of a `shortlist` so many regressors are
    tried at once, the most promising first; the next ones where none of these lowers the error.
    """
    data = _Data(courses, scales, shortlist)
    memory = dict(known or {})
    say = on_step or (lambda step, tried: None)
    first = memory.get(str(start)) or _from_nothing(start, courses, scales)
    memory[str(start)] = first
    path = [Step("start", first, 1)]
    say(path[0], memory)
    while len(path[-1].tried.structure.regressors) < most:
        now = path[-1].tried
        best, count = _extended(now, offered, data, memory)
        if best is None:
            break
        added = next(one for one in best.structure.regressors if one not in now.structure.regressors)
        path.append(Step(f"+{added}", best, count))
        say(path[-1], memory)
        path += _pruned(best, added, data, memory, say)
    return path


@dataclass(frozen=True, slots=True)
class _Data:
    """What every structure is trained on, and of how many at once the best is taken; None: of all."""

    courses: Sequence[Course]
    scales: Scales
    shortlist: int | None


def _extended(
    now: Tried, offered: Sequence[Regressor], data: _Data, memory: dict[str, Tried]
) -> tuple[Tried | None, int]:
    """The best structure with one regressor more, where one is better by `LEAST_GAIN`; and how many were tried."""
    new = [one for one in offered if one not in now.structure.regressors]
    step = data.shortlist or len(new) or 1
    if data.shortlist:
        promised = gains(now.structure, now.weights, new, data.courses, data.scales, DECAY)
        new = _best_of_each_signal_first(sorted(new, key=lambda one: -promised[one]))
    for first in range(0, len(new), step):
        some = [now.structure.with_regressor(one) for one in new[first : first + step]]
        best = _best(some, now, data.courses, data.scales, memory)
        if best is not None and best.error <= (1.0 - LEAST_GAIN) * now.error:
            return best, min(first + step, len(new))
        step = len(new)  # where no regressor promised rightly, all others are tried
    return None, len(new)


def _best_of_each_signal_first(ranked: Sequence[Regressor]) -> list[Regressor]:
    """The regressors in their order, but the first of every signal before all others.

    What a signal promises can be compared among its own delays; a force that is fed back changes more than its gradient
    says.
    """
    first = list({one.symbol: one for one in reversed(ranked)}.values())[::-1]
    return [*first, *(one for one in ranked if one not in first)]


def _pruned(
    now: Tried, added: Regressor, data: _Data, memory: dict[str, Tried], say: Callable[[Step, Known], None]
) -> list[Step]:
    """Drop what the error does not need, one by one; never what was just added, nor the last regressor."""
    steps: list[Step] = []
    while len(now.structure.regressors) > 1:
        old = [one for one in now.structure.regressors if one != added]
        if data.shortlist:
            lost = losses(now.structure, now.weights, data.courses, data.scales, DECAY)
            old = sorted(old, key=lambda one: lost[one])[: data.shortlist]
        best = _best([now.structure.without(one) for one in old], now, data.courses, data.scales, memory)
        if best is None or best.error > now.error:
            break
        gone = next(one for one in now.structure.regressors if one not in best.structure.regressors)
        now = best
        steps.append(Step(f"−{gone}", best, len(old)))
        say(steps[-1], memory)
    return steps


def without_each(
    found: Tried, courses: Sequence[Course], scales: Scales, *, symbols: Sequence[str] = ("F", "x", "v", "a", "i")
) -> dict[str, Tried]:
    """The same structure without all regressors of one signal, trained anew, for each signal that it has."""
    parts = {
        symbol: Structure(kept, found.structure.nodes)
        for symbol in symbols
        if (kept := tuple(one for one in found.structure.regressors if one.symbol != symbol))
        and len(kept) < len(found.structure.regressors)
    }
    trained = run(partial(_from_nothing, courses=courses, scales=scales), list(parts.values()))
    return dict(zip(parts, trained, strict=True))


def _best(
    structures: Sequence[Structure], parent: Tried, courses: Sequence[Course], scales: Scales, memory: dict[str, Tried]
) -> Tried | None:
    """The structure of the smallest error; all are remembered."""
    new = [one for one in structures if str(one) not in memory]
    for one in run(partial(_from_parent, parent=parent, courses=courses, scales=scales), new):
        memory[str(one.structure)] = one
    return min((memory[str(one)] for one in structures), key=lambda one: one.error, default=None)


def _from_nothing(structure: Structure, courses: Sequence[Course], scales: Scales) -> Tried:
    member, trained = train_member(structure, scales, courses, decay=DECAY, seed=0, stages=FULL)
    return Tried(structure, trained.error, member.weights)


def _from_parent(structure: Structure, parent: Tried, courses: Sequence[Course], scales: Scales) -> Tried:
    """The structure trained from the weights of its parent: new regressors begin with none."""
    samples = samples_of(courses, structure, scales)
    weights = inherited(structure, parent.structure, parent.weights)
    trained = train(
        network(structure, scales), weights, samples, decay=DECAY, most_steps=MOST_STEPS, tolerance=1e-3
    )  # fmt: skip
    return Tried(structure, trained.error, trained.weights)


def member_of(found: Tried) -> Member:
    """The network of what was tried."""
    return Member(found.structure, found.weights)
