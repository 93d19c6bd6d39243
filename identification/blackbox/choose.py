"""The choice of structure and weight decay by cross-validation inside the training, and the committee that follows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.band import LeftOut
from identification.blackbox.folds import Fold, folds_of
from identification.blackbox.leftout import left_out_of
from identification.blackbox.model import BlackBox, Member
from identification.blackbox.rounds import Part, in_rounds
from identification.blackbox.samples import Course
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import FORCE, Structure
from identification.blackbox.terms import Polynomial
from identification.blackbox.training import FULL, QUICK, Stage, train_member
from identification.compute import run

Floats = NDArray[np.float64]
_DECADE = 10.0

# A force that is fed back may drift where the training never was, such as at rest, and no part that is left out of the
# training shows it. So feedback is preferred only where the mean square error without it is larger by this factor.
# On 34 cuts of measured and simulated records, mean and lowest fit of the committee: 1: 94.0 and 77.4 %, lost where the
# record ends at rest; 1.2: 94.4 and 89.1; 1.35 and 1.5: 94.4 and 90.2; 3: 94.4 and 90.2; without any feedback the same.
FED_BACK = 1.35
Told = Callable[[float, str], None]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A structure with a weight decay, of the squared scaled weights beside the sum of squared scaled errors."""

    structure: Structure
    decay: float

    def __str__(self) -> str:
        return f"{self.structure}, weight decay {self.decay:g}"


class Shaped(Protocol):
    """Anything else that was tried: it has regressors, and says what it is."""

    @property
    def structure(self) -> Structure: ...


@dataclass(frozen=True, slots=True)
class Judged:
    """What was tried, and its mean square scaled error in free run on the parts that it had not learned from.

    `members` are the networks that did not learn from each part in turn; none where it was given up before the last
    part: its error is then at least that which is stated.
    """

    candidate: Candidate | Polynomial | Shaped
    error: float
    members: tuple[Member, ...] = field(default=(), repr=False, compare=False)

    @property
    def fit(self) -> float:
        """The fit that it predicts for unseen runs of the same kind, %."""
        return 100.0 * (1.0 - float(np.sqrt(self.error)))


def judge(
    candidates: Sequence[Candidate],
    courses: Sequence[Course],
    scales: Scales,
    dt: float,
    *,
    stages: Sequence[Stage] = QUICK,
    rested: bool = False,
    best: int,
    known: Sequence[Judged] = (),
    tell: Callable[[int, int], None] | None = None,
) -> list[Judged]:
    """These candidates and those that are `known` by their error in cross-validation, the smallest first.

    Each is trained from one start without each part in turn. On each part its squared error is cut at that of the mean
    force: a free run that is lost is no worse than no model, and does not decide alone. One that cannot be among the
    `best` any more is given up.
    """
    if not candidates:
        return list(known)
    folds, done = folds_of(courses), 0
    square = partial(_squares, scales=scales, dt=dt, stages=stages, rested=rested)

    def work(tasks: Sequence[tuple[int, Fold]]) -> list[Part]:
        nonlocal done
        before, every = done, len(candidates) * len(folds)
        parts = run(
            square, [(candidates[k], fold) for k, fold in tasks],
            on_done=None if tell is None else lambda count, _: tell(before + count, every),
        )  # fmt: skip
        done += len(tasks)
        return parts

    bound = _weighted(known[best - 1]) if len(known) >= best else math.inf
    shown = in_rounds(folds, [_weight(one) for one in candidates], best, bound, work)
    count = sum(int(one.counted.sum()) for fold in folds for one in fold.after)
    judged = [
        Judged(
            one,
            sum(part.squares for part in parts) / count,
            tuple(part.member for part in parts) if len(parts) == len(folds) else (),
        )
        for one, parts in zip(candidates, shown, strict=True)
    ]
    return in_order([*known, *judged])


def left_out(judged: Sequence[Judged], courses: Sequence[Course], scales: Scales, dt: float) -> list[LeftOut]:
    """Errors and spreads, N, on each part of the networks of some candidates together that had not learned from it."""
    parts = []
    for k, fold in enumerate(folds_of(courses)):
        model = BlackBox(name="", kind="", dt=dt, scales=scales, members=tuple(one.members[k] for one in judged))
        parts.append(left_out_of(model.with_spread, model.signals, fold))
    return parts


def in_order(judged: Sequence[Judged]) -> list[Judged]:
    """The smallest error first, that of a structure with feedback times `FED_BACK`."""
    return sorted(judged, key=_weighted)


def _weighted(judged: Judged) -> float:
    return judged.error * _weight(judged.candidate)


def _weight(tried: Candidate | Polynomial | Shaped) -> float:
    return FED_BACK if tried.structure.fed_back else 1.0


def beyond(judged: Sequence[Judged], count: int) -> list[Candidate]:
    """Candidates with the next decay, ten times less or more, where that of a best structure is at its edge.

    Only the best `count` structures are taken further.
    """
    decays: dict[Structure, list[float]] = {}
    for one in judged:
        if isinstance(one.candidate, Candidate):
            decays.setdefault(one.candidate.structure, []).append(one.candidate.decay)
    more = []
    for structure, tried in list(decays.items())[:count]:  # in the order of their best, which comes first
        if tried[0] == min(tried):
            more.append(Candidate(structure, tried[0] / _DECADE))
        elif tried[0] == max(tried):
            more.append(Candidate(structure, tried[0] * _DECADE))
    return more


def _squares(task: tuple[Candidate, Fold], scales: Scales, dt: float, stages: Sequence[Stage], rested: bool) -> Part:
    """What a fold shows of a network."""
    candidate, fold = task
    member, _ = train_member(
        candidate.structure, scales, fold.learned, decay=candidate.decay, seed=0, stages=stages, rested=rested
    )
    return Part(*errors_on([member], fold.after, scales, dt), member)


def errors_on(members: Sequence[Member], shown: Sequence[Course], scales: Scales, dt: float) -> tuple[float, int]:
    """Sum of the squared scaled errors of some members together, and of how many samples."""
    model = BlackBox(name="", kind="", dt=dt, scales=scales, members=tuple(members))
    squares, count = 0.0, 0
    for course in shown:
        error = (course.force - model.along(course))[course.counted] / scales[FORCE].size
        spread = (course.force[course.counted] - scales[FORCE].centre) / scales[FORCE].size
        squares += min(float(error @ error), float(spread @ spread))
        count += error.size
    return squares, count


def committee(
    chosen: Sequence[Candidate],
    courses: Sequence[Course],
    scales: Scales,
    *,
    stages: Sequence[Stage] = FULL,
    rested: bool = False,
    tell: Callable[[int, int], None] | None = None,
) -> list[tuple[Member, float]]:
    """A network for each candidate, each from a start of its own, on all courses; and its error there."""
    tasks = list(enumerate(chosen, start=1))
    return run(partial(_member, courses=courses, scales=scales, stages=stages, rested=rested), tasks, on_done=tell)


def _member(
    task: tuple[int, Candidate], courses: Sequence[Course], scales: Scales, stages: Sequence[Stage], rested: bool
) -> tuple[Member, float]:
    seed, candidate = task
    member, trained = train_member(
        candidate.structure, scales, courses, decay=candidate.decay, seed=seed, stages=stages, rested=rested
    )
    return member, trained.error
