"""Samples of one or several runs, as the loops take them: scaled regressors and force, one run after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.past import velocity_before, with_past
from identification.blackbox.scaling import Scales, seen
from identification.blackbox.stops import LIMITS, stopped
from identification.blackbox.structure import FORCE, MODEL, Structure
from identification.models.motion import Motion
from identification.signals import SIGNALS

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Samples that are simulated before a run, so that its force does not begin from nothing. A stop operator of 1 rms of
# the displacement forgets within half a cycle or a few. Half: less than a cycle of 1 Hz at 200 Hz.
LEAD = 200


@dataclass(frozen=True, slots=True)
class Course:
    """One run: its motion, the force (N,) that is learned, N, or zeros, and which of its samples count, (N,).

    `model` (N,), N, is the force of the model that a hybrid builds on; the force is then what that leaves. `moving`,
    (N,), are those that count in the prediction of the fit; None: all that count. `weight` is that of each squared
    error.
    """

    motion: Motion
    force: Floats
    counted: Mask
    model: Floats | None = None
    moving: Mask | None = None
    weight: float = 1.0

    def judged(self) -> Course:
        """The same course, of which only the samples count that the prediction of the fit is about."""
        return self if self.moving is None else replace(self, counted=self.counted & self.moving, moving=None)

    def whole(self) -> Course:
        """The same course, of which every sample counts."""
        return replace(self, counted=np.ones(self.force.size, dtype=np.bool_))

    def series(self, signal: str) -> Floats:
        """A signal, (N,), SI."""
        if signal != MODEL:
            series: Floats = getattr(self.motion, SIGNALS[signal])
            return series
        assert self.model is not None  # only a hybrid has regressors of it
        return self.model


def course_along(motion: Motion, model: Floats | None = None) -> Course:
    """A motion whose force nobody has measured."""
    return Course(motion, np.zeros(motion.x.size), np.ones(motion.x.size, dtype=np.bool_), model)


@dataclass(frozen=True, slots=True)
class Samples:
    """N rows: inputs (N, m) and force (N,), scaled; `begin` is the first simulated sample of the run of each row.

    `weights` (N,) are those of the squared errors; None: all weigh 1.
    """

    inputs: Floats
    force: Floats
    begin: NDArray[np.int64]
    counted: Mask
    weights: Floats | None = None

    def alone(self) -> Samples:
        """The rows that count: a network without feedback needs no other."""
        rows = np.flatnonzero(self.counted)
        weights = None if self.weights is None else self.weights[rows]
        begin, counted = np.zeros(rows.size, dtype=np.int64), np.ones(rows.size, dtype=np.bool_)
        return Samples(self.inputs[rows], self.force[rows], begin, counted, weights)

    def since(self, horizon: int | None) -> NDArray[np.int64]:
        """From which sample on each row feeds the simulated force back: every `horizon` samples from the measured one.

        One sample: the force is predicted from measured ones. None: it is simulated from the start of the run on.
        """
        if horizon is None:
            return self.begin
        within = np.arange(self.begin.size) - self.begin
        return np.asarray(self.begin + np.maximum(within // horizon, 0) * horizon)


def samples_of(courses: Sequence[Course], structure: Structure, scales: Scales, *, begun: bool = False) -> Samples:
    """The rows of some runs for a network: its longest delay and `LEAD` samples come before every run.

    Of a run whose first samples do not count those are part of the lead. With `begun` nothing comes before, and the
    force of as many samples as the longest delay is given as it was measured.
    """
    parts = [_rows(course, structure, scales, begun=begun) for course in courses]
    sizes = [force.size for _, force, _ in parts]
    weights = [one.weight for one in courses]
    starts = np.cumsum([0, *sizes[:-1]])
    begin = [np.full(force.size, start + structure.longest) for (_, force, _), start in zip(parts, starts, strict=True)]
    return Samples(
        inputs=np.concatenate([inputs for inputs, _, _ in parts]),
        force=np.concatenate([force for _, force, _ in parts]),
        begin=np.concatenate(begin),
        counted=np.concatenate([counted for _, _, counted in parts]),
        weights=np.repeat(weights, sizes) if set(weights) != {1.0} else None,
    )


def _rows(course: Course, structure: Structure, scales: Scales, *, begun: bool) -> tuple[Floats, Floats, Mask]:
    """Inputs, force and what counts of one run, with what comes before it."""
    motion = course.motion
    ahead = 0 if begun else structure.longest + max(LEAD - int(np.argmax(course.counted)), 0)
    before = velocity_before(motion, ahead)
    signals = {name: with_past(motion, name, course.series(name), before) for name in structure.signals}
    size = course.force.size + ahead
    inputs = np.empty((size, len(structure.inputs)))
    for k, one in enumerate(structure.inputs):
        column = seen(scales[one.signal], signals[one.signal])
        if one.symbol in LIMITS:
            column = stopped(column, LIMITS[one.symbol])
        inputs[one.delay :, k] = column[: size - one.delay]
        inputs[: one.delay, k] = column[0]
    force = (course.force - scales[FORCE].centre) / scales[FORCE].size
    force = np.concatenate([np.full(ahead, force[0]), force])
    if not begun:
        force[: structure.longest] = 0.0  # the simulation of a run begins from its mean force
    counted = np.concatenate([np.zeros(ahead, dtype=np.bool_), course.counted])
    return inputs, force, counted
