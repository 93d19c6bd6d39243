"""A prior for rest: stretches in which a motion of the training stops and stays, where the force must be a static one.

Where a training never rested, what a network gives at rest is chance: two networks that follow the motion within 2 %
lay 1.7 and −2.2 times the rms force beside a rest. A damper that is held at a place x gives a force between those of
its passages to and fro, F₋(x) ≤ F ≤ F₊(x), and nothing says where. So each value between them is taken to be as likely:
the mean is (F₊ + F₋)/2, the variance (F₊ − F₋)²/12.

Only networks without feedback learn it. One that is fed back may remember for seconds, and says itself how it comes to
rest: of three simulated dampers behind a soft bush 85, 85 and 86 % below a linear model became 76, 74 and 62.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.past import begins_at_rest
from identification.blackbox.samples import LEAD, Course
from identification.models.visited import FAR, TOGETHER, visited_in

Floats = NDArray[np.float64]

# Rests of a training, evenly over its displacement. Half: a place between two is a quarter of the stroke away; double:
# more samples than a short training spares.
PLACES = 8

# Samples that a rest lasts: longer than any delay of the default structures, so that they see no motion.
HELD = 100

# A rest weighs, beside a sample, this times the variance of the force over that of the prior: about one where the
# passages are 2 rms forces apart. Fit on three measured records that end at a rest that they never had: without rests
# 63 to 88 %, at a thirtieth of this 73 to 94, at this 79 to 95, at ten times 81 to 94. Records that go on are within
# 0.5 % at all of them, but for two that lost 1.3 and 1.6 %.
WEIGHT = 0.09

_NEAR = 0.05  # of the range of the displacement: samples there are passages of a place
_LEAST = 0.1  # of the rms force: passages are no nearer to each other, or a rest would weigh more than many samples


def lacks_rest(courses: Sequence[Course]) -> bool:
    """Whether no course of a whole training begins at rest: else what a rest is has been measured.

    Asked once of the whole training. Asked of each part that is learned in cross-validation, a record that begins at
    rest is judged with rests wherever its begin is left out, and then trained without: two records of 36 that begin
    so lost 1.1 and 1.3 % by it.
    """
    return not any(begins_at_rest(one.motion) for one in courses)


def rests_of(courses: Sequence[Course]) -> list[Course]:
    """Rests where some courses that are learned never were: `PLACES` in all at most, or one of each course."""
    each = max(1, PLACES // len(courses))
    rests = [rest for k, one in enumerate(courses) for rest in _of(one, each, k)]
    visited = visited_in([(one.motion, one.counted) for one in courses], TOGETHER)
    return [one for one in rests if visited is None or visited.distances(one.motion)[-1] > FAR]


def _of(course: Course, count: int, turn: int) -> list[Course]:
    """Rests at places evenly over the displacement of a course, come to in alternating directions."""
    motion = course.motion
    slowing = float(np.std(motion.a))
    low, high = float(np.min(motion.x)), float(np.max(motion.x))
    if not (slowing > 0.0 and high > low and np.ptp(course.force) > 0.0):
        return []
    ends = motion.x + motion.v * np.abs(motion.v) / (2.0 * slowing)
    rests = []
    for k in range(count):
        place = low + (k + 0.5) / count * (high - low)
        way = np.where(course.counted & (np.sign(motion.v) == (-1.0) ** (k + turn)), np.abs(ends - place), np.inf)
        at = int(np.argmin(way))
        if np.isfinite(way[at]):
            rests.append(_rest(course, at, slowing))
    return rests


def _rest(course: Course, at: int, slowing: float) -> Course:
    """The course up to a sample, then slowed down at an acceleration, m/s², until it stays; its last sample counts."""
    motion, first = course.motion, max(0, at - LEAD)
    way, speed = float(np.sign(motion.v[at])), abs(float(motion.v[at]))
    after = np.arange(1, int(speed / (slowing * motion.dt)) + HELD + 1) * motion.dt
    slowed = np.minimum(after, speed / slowing)
    added = {
        "x": motion.x[at] + way * (speed - 0.5 * slowing * slowed) * slowed,
        "v": way * slowing * (speed / slowing - slowed),
        "a": np.where(after < speed / slowing, -way * slowing, 0.0),
        "i": np.full(after.size, motion.i[at]),
        "temperature": np.full(after.size, motion.temperature[at]),
        "t": motion.t[at] + after,
    }
    series: dict[str, Any] = {
        name: np.concatenate([getattr(motion, name)[first : at + 1], more]) for name, more in added.items()
    }  # Any: beside numbers
    mean, half = _passages(course, float(series["x"][-1]))
    force = np.concatenate([course.force[first : at + 1], np.full(after.size, mean)])
    counted = np.arange(force.size) == force.size - 1
    weight = WEIGHT * float(np.var(course.force)) / (half**2 / 3.0)
    return Course(replace(motion, **series, period=0, settle=0), force, counted, weight=weight)


def _passages(course: Course, place: float) -> tuple[float, float]:
    """The mean of the forces at the passages of a place to and fro, and half of their difference, N."""
    motion, force = course.motion, course.force
    near, size = np.abs(motion.x - place) <= _NEAR * np.ptp(motion.x), float(np.std(force))
    to, fro = (force[near & (way * motion.v > 0.0)] for way in (1.0, -1.0))
    if not (to.size and fro.size):
        return float(np.mean(force)), size
    means = float(np.median(to)), float(np.median(fro))
    return 0.5 * (means[0] + means[1]), max(0.5 * abs(means[0] - means[1]), _LEAST * size)
