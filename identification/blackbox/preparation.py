"""Runs as courses for a black box: one rate, the measured motion where there is one, and nothing that can't be used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np

from identification.blackbox.folds import FOLDS, SHORTEST, stretch_of
from identification.blackbox.samples import Course
from identification.errors import DataError, SimulationError
from identification.force_faults import bridged, spike_fault
from identification.models.inputs import MEASURED, with_measured
from identification.models.protocol import SimulationModel
from identification.models.simulation import force_along, name_of
from identification.motion_faults import jump_fault, jumps_in, velocity_fault
from identification.record import compact, record_from_run
from identification.signals import SIGNALS
from rigctl.runfile import Run

_LARGEST_PART = 1000  # of the ratio of two rates
_SIMPLE = 20  # that of a ratio that is proposed
# Times the rate of a run that it may be resampled to: at a higher rate no more is known, and time and memory grow.
# Half or double: nothing, a run of another machine has a rate within a few times.
_MOST_UP = 20
_VARIES = 1e-9  # of the highest value: rounding is no variation
_HELD = ("current",)  # between samples it is held: a filter would put its step elsewhere


def measured_signals(runs: Sequence[Run]) -> tuple[str, ...]:
    """Velocity and acceleration, where every run holds them as measured, and no velocity is another one's."""
    named = [name for name in MEASURED if all(name in one.channels for one in runs)]
    return tuple(name for name in named if name != "velocity" or not any(map(velocity_fault, runs)))


def velocity_notes(runs: Sequence[Run]) -> list[str]:
    """A line for each run with a velocity that is not used, and why."""
    found = ((one, velocity_fault(one)) for one in runs)
    return [
        f"{name_of(one)}: velocity: {fault}; the derivative of the displacement takes its place"
        for one, fault in found
        if fault is not None
    ]


def learnable(runs: Sequence[Run]) -> tuple[list[Run], list[str]]:
    """The runs without the faults of their sensors, and a line for each: spikes of the force bridged, no jump left.

    Raises DataError, one line, where no piece between jumps is long enough to learn from.
    """
    faults = ((one, spike_fault(one)) for one in runs)
    notes = [f"{name_of(one)}: force: {fault}; the mean of its neighbours is learned" for one, fault in faults if fault]
    pieces, more = between_jumps(list(map(bridged, runs)))
    return pieces, [*notes, *more]


def between_jumps(runs: Sequence[Run]) -> tuple[list[Run], list[str]]:
    """The runs, those whose displacement jumps in pieces between the jumps; and a line for each of those.

    Raises DataError, one line, where none of the pieces is long enough to learn from.
    """
    out, notes = list[Run](), list[str]()
    for run in runs:
        fault = jump_fault(run) if "displacement" in run.channels else None
        if fault is None:
            out.append(run)
            continue
        parts = [part for part in _pieces(run, [jump.at for jump in jumps_in(run)]) if part.samples >= SHORTEST]
        if not parts:
            raise DataError(f"{name_of(run)}: displacement: {fault}; no piece between the jumps has {SHORTEST} samples")
        out += parts
        kept = sum(part.samples for part in parts)
        learned = f"{kept} of {run.samples} samples are learned, in {len(parts)} pieces"
        notes.append(f"{name_of(run)}: displacement: {fault}; {learned}")
    return out, notes


def _pieces(run: Run, cuts: Sequence[int]) -> list[Run]:
    ends = [0, *cuts, run.samples]
    return [
        replace(run, channels={name: one[first:last] for name, one in run.channels.items()}, period_samples=0)
        for first, last in pairwise(ends)
    ]


def course_of(run: Run, measured: Sequence[str], base: SimulationModel | None = None) -> Course:
    """One run as a course; of a run that repeats its mean period; with a base, what that leaves.

    Of any other run every sample is learned, also those at rest, which naming leaves out: a run to be simulated rests
    too. The prediction of the fit is about the motion only: the start of a test is often the only rest of a training,
    and what does not learn from it knows none. Raises DataError as `record_from_run` does, SimulationError where the
    base gives a force that no machine has.
    """
    record = compact(record_from_run(run))
    motion = with_measured(record.motion, run, measured)
    moving = np.zeros(motion.x.size, dtype=np.bool_)
    moving[record.window] = True
    counted = moving if record.period else np.ones_like(moving)
    everywhere = all(part.any() for part in np.array_split(moving, FOLDS))  # else a part that is left out tells nothing
    course = Course(motion, record.force, counted, moving=moving if everywhere else None)
    if base is not None:
        try:
            model = force_along(base, motion)
        except SimulationError as error:
            raise SimulationError(f"{name_of(run)}: {error}") from error
        course = replace(course, force=record.force - model, model=model)
    return _settled(course) if record.period else course


def _settled(course: Course) -> Course:
    """A course that repeats with no more than one period before what is learned: two thirds of it must not be empty."""
    period = course.motion.period
    first = int(np.argmax(course.counted)) - period
    if first <= 0:
        return course
    part = stretch_of(course, first, course.force.size)
    return replace(part, motion=replace(part.motion, period=period, settle=1))


def is_constant(low: float, high: float) -> bool:
    """Whether a signal from its lowest to its highest value does not vary, but for rounding."""
    return bool(high - low <= _VARIES * max(abs(low), abs(high)))


def absent_signals(runs: Sequence[Run], courses: Sequence[Course]) -> list[str]:
    """Current and temperature, where they do not vary over the runs; raises DataError where only some runs have one."""
    return [channel for channel in ("current", "temperature") if not _varies(channel, runs, courses)]


def _varies(channel: str, runs: Sequence[Run], courses: Sequence[Course]) -> bool:
    """Whether a channel varies over the runs; raises DataError where some have it and others do not."""
    having = [one for one in runs if channel in one.channels]
    if not having:
        return False
    low, high = (f([f(getattr(one.motion, SIGNALS[channel])) for one in courses]) for f in (np.min, np.max))
    if is_constant(low, high):
        return False
    if len(having) < len(runs):
        lacking = next(one for one in runs if channel not in one.channels)
        raise DataError(f"{name_of(lacking)} has no {channel}, {name_of(having[0])} has: give runs that all have it")
    return True


def at_one_rate(runs: Sequence[Run], rate_hz: float | None) -> list[Run]:
    """The runs, resampled where a rate is asked for; raises DataError where theirs differ and none is."""
    if rate_hz is not None:
        return [resampled(one, rate_hz) for one in runs]
    for one in runs:
        if abs(one.sample_rate_hz / runs[0].sample_rate_hz - 1.0) > 1e-6:
            raise DataError(
                f"{name_of(one)} has {one.sample_rate_hz:.6g} Hz, {name_of(runs[0])} {runs[0].sample_rate_hz:.6g} Hz: "
                "a black box has one sample rate; leave out those of another, or have all resampled (--rate)"
            )
    return list(runs)


def resampled(run: Run, rate_hz: float) -> Run:
    """A run at another rate, through a low-pass at half the lower one; its period is sought anew."""
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise DataError(f"rate is {rate_hz:g} Hz: it must be above 0")
    if rate_hz > _MOST_UP * run.sample_rate_hz:
        raise DataError(
            f"rate is {rate_hz:g} Hz and {name_of(run)} has {run.sample_rate_hz:g} Hz: at most {_MOST_UP} times its own"
        )
    ratio = Fraction(rate_hz / run.sample_rate_hz).limit_denominator(_LARGEST_PART)
    up, down = ratio.numerator, ratio.denominator
    if ratio == 1:
        return run
    if not 0 < up <= _LARGEST_PART or abs(float(ratio) * run.sample_rate_hz / rate_hz - 1.0) > 1e-9:
        near = max(ratio.limit_denominator(_SIMPLE), Fraction(1, _LARGEST_PART))
        raise DataError(
            f"{name_of(run)}: {run.sample_rate_hz:g} Hz can't be brought to {rate_hz:g} Hz by a simple ratio: ask for "
            f"{float(near) * run.sample_rate_hz:.12g} Hz, {near} of it"
        )
    from scipy.signal import resample_poly  # 0.3 s to import: only where it is needed

    count = -(-run.samples * up // down)
    nearest = np.minimum(np.arange(count) * down // up, run.samples - 1)
    channels = {
        name: values[nearest] if name in _HELD else resample_poly(values, up, down, padtype="line")
        for name, values in run.channels.items()
    }
    return replace(run, sample_rate_hz=rate_hz, channels=channels, period_samples=0)
