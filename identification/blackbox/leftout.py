"""What the parts that a model was not learned from show of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.band import LeftOut, Place
from identification.blackbox.folds import Fold
from identification.blackbox.outside import place_along
from identification.blackbox.samples import Course
from identification.blackbox.structure import MODEL
from identification.models.motion import Motion
from identification.models.protocol import TrainingRange
from identification.models.visited import TOGETHER, visited_in

Floats = NDArray[np.float64]

Simulated = Callable[[Course], tuple[Floats, Floats | float]]
"""Force (N,) and spread of a model along a course, N."""


def left_out_of(simulated: Simulated, signals: Sequence[str], fold: Fold) -> LeftOut:
    """What a fold shows of a model that sees some `signals` and learned from the fold, in the samples that count in the
    prediction of the fit."""
    known = range_of(fold.learned, signals)
    parts = [_of(simulated, known, one) for one in map(Course.judged, fold.shown)]
    errors, *place = (np.concatenate(series) for series in zip(*parts, strict=True))
    return LeftOut(errors, Place(*place), runs=len(fold.shown) if fold.whole else 0)


def range_of(courses: Sequence[Course], signals: Sequence[str]) -> TrainingRange:
    """Where some courses went in the samples that count, in the signals that a model sees and that vary there."""
    limits = {}
    for name in signals:
        values = np.concatenate([one.series(name)[one.counted] for one in courses])
        if name != MODEL and np.ptp(values) > 0.0:
            limits[name] = (float(np.min(values)), float(np.max(values)))
    seen = [name for name in TOGETHER if name in limits]
    return TrainingRange(limits, visited_in([(one.motion, one.counted) for one in courses], seen))


def _of(simulated: Simulated, known: TrainingRange, course: Course) -> tuple[Floats, ...]:
    """Errors, and the columns of their place, of what counts of a course, each (N,).

    What a base gives along a motion that is cut is not asked for: of a hybrid the part of the network alone is added.
    """
    force, spread = simulated(course)
    base = np.zeros(force.size) if course.model is None else course.model

    def again(motion: Motion) -> Floats:
        return base + simulated(replace(course, motion=motion))[0]

    place = place_along(known, course.motion, base + force, spread, again)
    return tuple(one[course.counted] for one in (course.force - force, *place.columns()))
