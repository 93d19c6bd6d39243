"""A committee of networks: structure and weight decay by cross-validation, then training on all courses."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from identification.blackbox.band import LeftOut
from identification.blackbox.choose import Candidate, Judged, beyond, committee, judge, left_out
from identification.blackbox.model import BlackBox, Member
from identification.blackbox.recipes import Recipe
from identification.blackbox.rests import lacks_rest
from identification.blackbox.samples import Course
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import FORCE, Structure
from identification.blackbox.training import scales_of

Told = Callable[[float, str], None]

MOST_DECADES = 1  # of weight decay beyond those that a kind begins with
FURTHER = 5  # structures, the best ones, that are tried with it


def networks(
    recipe: Recipe, candidates: Sequence[Candidate], courses: Sequence[Course], say: Told
) -> tuple[BlackBox, list[Judged], list[LeftOut]]:
    """The committee of the best candidates, how all were judged, and what was left out shows of it."""
    scales, dt = scales_for(courses, [one.structure for one in candidates]), courses[0].motion.dt
    rested = lacks_rest(courses)
    judged = judge(
        candidates, courses, scales, dt, stages=recipe.quick, rested=rested, best=recipe.best,
        tell=lambda done, of: say(0.4 * done / of, "cross-validation"),
    )  # fmt: skip
    for _ in range(MOST_DECADES):
        further = beyond(judged, min(recipe.best, FURTHER))
        judged = judge(further, courses, scales, dt, stages=recipe.quick, rested=rested, best=recipe.best, known=judged)
    best = [one.candidate for one in judged[: recipe.best] if isinstance(one.candidate, Candidate)]
    trained = committee(
        best * recipe.starts, courses, scales, stages=recipe.full, rested=rested,
        tell=lambda done, of: say(0.5 + 0.5 * done / of, "training"),
    )  # fmt: skip
    seen = dict.fromkeys([FORCE, *(signal for one in best for signal in one.structure.signals)])
    members = _forgetting([member for member, _ in trained], courses, scales)
    parts = left_out([one for one in judged[: recipe.best] if one.members], courses, scales, dt)
    network = BlackBox(name="", kind="", dt=dt, scales={name: scales[name] for name in seen}, members=members)
    return network, judged, parts


def scales_for(courses: Sequence[Course], structures: Sequence[Structure]) -> Scales:
    """Scales of the force and of every signal that a structure sees; raises DataError for a constant one."""
    return scales_of(courses, list(dict.fromkeys(name for one in structures for name in one.signals)))


def _forgetting(members: Sequence[Member], courses: Sequence[Course], scales: Scales) -> tuple[Member, ...]:
    """The members that forget where a free run began, on every course; all of them where none does."""
    alone = [
        BlackBox(name="", kind="", dt=courses[0].motion.dt, scales=scales, members=(member,)) for member in members
    ]
    stable = [one.members[0] for one in alone if all(math.isfinite(one.memory(c)) for c in courses)]
    return tuple(stable or members)
