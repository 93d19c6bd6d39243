"""Cross-validation inside the training: parts that are left out in turn, and courses of what remains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.blackbox.samples import Course

FOLDS = 3
SHORTEST = 100  # samples of a course to learn from


@dataclass(frozen=True, slots=True)
class Fold:
    """What is learned from, and what is then simulated and compared."""

    learned: tuple[Course, ...]
    shown: tuple[Course, ...]


def folds_of(courses: Sequence[Course], count: int = FOLDS) -> list[Fold]:
    """Every `count`-th run left out in turn, or, of fewer runs than twice that, a stretch of each run.

    Runs are taken in the order of the size of their force, so that each part has strong and weak ones.
    """
    if len(courses) >= 2 * count:
        ordered = sorted(courses, key=lambda one: float(np.std(one.force[one.counted])))
        return [
            Fold(tuple(one for n, one in enumerate(ordered) if n % count != k), tuple(ordered[k::count]))
            for k in range(count)
        ]
    return [_without_stretch(courses, k, count) for k in range(count)]


def _without_stretch(courses: Sequence[Course], k: int, count: int) -> Fold:
    learned, shown = [], []
    for course in courses:
        size = course.force.size
        first, last = k * size // count, (k + 1) * size // count
        shown.append(stretch_of(course, first, last))
        learned += [stretch_of(course, *ends) for ends in ((0, first), (last, size)) if ends[1] - ends[0] >= SHORTEST]
    return Fold(tuple(learned), tuple(shown))


def stretch_of(course: Course, first: int, last: int) -> Course:
    """A stretch of a course as one of its own: its motion does not repeat."""
    series = {name: getattr(course.motion, name)[first:last] for name in ("x", "v", "a", "i", "temperature", "t")}
    motion = replace(course.motion, **series, period=0, settle=0)
    model = None if course.model is None else course.model[first:last]
    moving = None if course.moving is None else course.moving[first:last]
    return Course(motion, course.force[first:last], course.counted[first:last], model, moving)
