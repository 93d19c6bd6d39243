"""A model at a fixed step in real time: how long each step takes, and what a momentary bad input does."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.models.protocol import SimulationModel
from identification.models.stepping import Moment, Stepper, steppable

Floats = NDArray[np.float64]

_WARM = 200  # steps before the clock is read: the first of them compile and load
_TONES = 12
_RECOVERED = 0.01  # of the range of the force: nearer than this to the undisturbed run a model has recovered
_SPIKE = 10.0  # times the displacement and velocity of the motion, for one step


class Clock(Protocol):
    """Time in whole nanoseconds."""

    def __call__(self) -> int:
        """Now."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Realtime:
    """Durations of the steps, (N,), s, against the step, s; `late` counts the steps that began after their time.

    `recovery_s` is how long the force stays apart from the undisturbed run after one step of ten times the motion;
    NaN: to the end of the run. `finite` is whether every force was a finite number, also at inputs that were not.
    `force` and `disturbed` are the force of the undisturbed run and of that with the bad inputs, (N + 1,), N, which
    begin at sample `bad` and at sample `no_number`.
    """

    name: str
    step_s: float
    durations_s: Floats
    late: int
    paced: bool
    recovery_s: float
    finite: bool
    force: Floats
    disturbed: Floats
    bad: int
    no_number: int

    @property
    def mean_s(self) -> float:
        """Mean duration of a step, s."""
        return float(np.mean(self.durations_s))

    @property
    def worst_s(self) -> float:
        """The longest step, s."""
        return float(np.max(self.durations_s))

    @property
    def over(self) -> int:
        """Steps that took longer than the step."""
        return int(np.sum(self.durations_s > self.step_s))


class Guarded:
    """A stepper for a loop with hardware: inputs that are not finite are held at their last finite value."""

    def __init__(self, stepper: Stepper) -> None:
        """Around a stepper before its start."""
        self._stepper, self._last = stepper, Moment()

    @property
    def dt(self) -> float:
        """The step, s."""
        return self._stepper.dt

    def start(self, at: Moment) -> float:
        """Begin at a moment that has lasted; the force there, N."""
        return self._stepper.start(self._held(at))

    def force(self, at: Moment) -> float:
        """The force if `at` were the next sample, N."""
        last = self._last
        force = self._stepper.force(self._held(at))
        self._last = last
        return force

    def advance(self, at: Moment) -> float:
        """Go on to the next sample; the force there, N."""
        return self._stepper.advance(self._held(at))

    def _held(self, at: Moment) -> Moment:
        if not all(map(math.isfinite, at)):
            pairs = zip(at, self._last, strict=True)
            at = Moment(*[value if math.isfinite(value) else last for value, last in pairs])
        self._last = at
        return at


def realtime(
    model: SimulationModel,
    step_s: float,
    *,
    seconds: float = 10.0,
    stroke_m: float = 0.01,
    current: float | None = None,
    seed: int = 1,
    paced: bool = False,
    clock: Clock = time.perf_counter_ns,
    on_progress: Callable[[float, str], None] | None = None,
) -> Realtime:
    """Steps a model along a random-phase motion of 0.5 … 10 Hz and measures every step.

    `stroke_m` is the peak of the motion; `paced` waits for the time of each step, as a loop with hardware does, else
    the steps follow each other. A model that needs a current gets `current`, by default the middle of its training.

    Raises
    ------
    DataError
        one line: no such step, a model that can't be stepped or lacks its current.
    SimulationError
        where a black box was identified at another rate.
    """
    check_realtime(model, step_s, seconds=seconds, stroke_m=stroke_m, current=current)
    moments = _moments(step_s, seconds, stroke_m, current_of(model, current), seed)
    make = steppable(model).stepper
    durations, late, plain = _timed(Guarded(make(step_s)), moments, paced, clock, on_progress)
    half = len(moments) // 2
    disturbed = list(moments)
    at = moments[half]
    disturbed[half] = at._replace(x=_SPIKE * stroke_m, v=_SPIKE * at.v)
    disturbed[half + len(moments) // 4] = Moment(math.nan, math.nan, math.nan, math.nan, math.nan)
    bumped = _forces(Guarded(make(step_s)), disturbed)
    quarter = slice(half, half + len(moments) // 4)
    apart = np.flatnonzero(np.abs(bumped - plain)[quarter] > _RECOVERED * np.ptp(plain))
    last = int(apart[-1]) + 1 if apart.size else 0
    return Realtime(
        name=model.name,
        step_s=step_s,
        durations_s=durations,
        late=late,
        paced=paced,
        recovery_s=math.nan if last >= len(moments) // 4 else last * step_s,
        finite=bool(np.all(np.isfinite(bumped)) and np.all(np.isfinite(plain))),
        force=plain,
        disturbed=bumped,
        bad=half,
        no_number=half + len(moments) // 4,
    )


def check_realtime(
    model: SimulationModel,
    step_s: float,
    *,
    seconds: float = 10.0,
    stroke_m: float = 0.01,
    current: float | None = None,
) -> None:
    """Raise DataError or SimulationError, one line, where `realtime` cannot begin."""
    if not (np.isfinite(step_s) and 0.0 < step_s <= 0.02):
        raise DataError(f"step is {step_s:g} s: it must lie within (0, 0.02]")
    if not 0.5 <= seconds <= 3600.0:
        raise DataError(f"seconds is {seconds:g}: it must lie within [0.5, 3600]")
    if not (np.isfinite(stroke_m) and 0.0 < stroke_m <= 1.0):
        raise DataError(f"stroke is {stroke_m:g} m: it must lie within (0, 1]")
    current_of(model, current)
    steppable(model).stepper(step_s)


def current_of(model: SimulationModel, current: float | None) -> float:
    """The current that a run is held at, A; raises DataError where a model needs one that nobody states."""
    if current is not None or "current" not in model.inputs:
        return current or 0.0
    known = model.training_range
    if known is None or "current" not in known.limits:
        raise DataError(f"'{model.name}' needs a current ({model.inputs['current']}): give one")
    return float(np.mean(known.limits["current"]))


def realtime_data(found: Realtime) -> dict[str, Any]:
    """The figures as JSON data, s. Any: what JSON can say."""
    return {
        "model": found.name,
        "step": found.step_s,
        "steps": int(found.durations_s.size),
        "paced": found.paced,
        "mean": found.mean_s,
        "median": float(np.median(found.durations_s)),
        "percentile_99_9": float(np.percentile(found.durations_s, 99.9)),
        "worst": found.worst_s,
        "over": found.over,
        "late": found.late,
        "recovery": found.recovery_s if math.isfinite(found.recovery_s) else None,
        "finite": found.finite,
    }


def realtime_text(found: Realtime) -> str:
    """What came out, in a few lines."""
    step = found.step_s
    recovered = (
        f"has recovered {1e3 * found.recovery_s:.3g} ms after it"
        if math.isfinite(found.recovery_s)
        else "does not recover from it within the run"
    )
    return (
        f"{found.name}: {found.durations_s.size} steps of {1e3 * step:g} ms: mean {1e6 * found.mean_s:.1f} µs "
        f"({100.0 * found.mean_s / step:.2g} % of the step), 99.9 % within "
        f"{1e6 * float(np.percentile(found.durations_s, 99.9)):.1f} µs, worst {1e6 * found.worst_s:.1f} µs "
        f"({100.0 * found.worst_s / step:.2g} %); {found.over} longer than the step"
        + (f", {found.late} begun late" if found.paced else "")
        + f"\none step of {_SPIKE:g} times the motion: the force {recovered}; "
        + ("always a finite number" if found.finite else "NOT always a finite number")
    )


def _moments(step_s: float, seconds: float, stroke_m: float, current: float, seed: int) -> list[Moment]:
    """Inputs of every step: a sum of tones with the same velocity each."""
    rng = np.random.default_rng(seed)
    frequencies = np.linspace(0.5, min(10.0, 0.1 / step_s), _TONES)
    w, phase = 2.0 * np.pi * frequencies[:, None], rng.uniform(0.0, 2.0 * np.pi, (_TONES, 1))
    angle = w * np.arange(round(seconds / step_s)) * step_s + phase
    x, v, a = (np.sum(part, axis=0) for part in (np.sin(angle) / w, np.cos(angle), -np.sin(angle) * w))
    scale = stroke_m / np.max(np.abs(x))
    rows = (scale * np.column_stack([x, v, a])).tolist()
    return [Moment(x, v, a, current) for x, v, a in rows]


def _forces(stepper: Stepper, moments: list[Moment]) -> Floats:
    return np.array([stepper.start(moments[0]), *(stepper.advance(at) for at in moments[1:])])


def _timed(
    stepper: Stepper,
    moments: list[Moment],
    paced: bool,
    clock: Clock,
    on_progress: Callable[[float, str], None] | None,
) -> tuple[Floats, int, Floats]:
    """Durations, s, how many steps began late, and the forces, N."""
    stepper.start(moments[0])
    for at in moments[1 : _WARM + 1]:
        stepper.advance(at)
    forces, spent, late = np.empty(len(moments)), np.empty(len(moments) - 1), 0
    forces[0] = stepper.start(moments[0])
    begin, step = clock(), round(1e9 * stepper.dt)
    for k, at in enumerate(moments[1:]):
        if paced:
            due = begin + k * step
            late += clock() > due + step
            while clock() < due:
                pass
        before = clock()
        forces[k + 1] = stepper.advance(at)
        spent[k] = 1e-9 * (clock() - before)
        if on_progress is not None and k % 1000 == 0:
            on_progress(k / len(moments), "stepping")
    return spent, late, forces
