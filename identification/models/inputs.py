"""The motion that drives a model: of a measured run, or from arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from excitation.sliding import running_mean
from identification.derivatives import Kinematics, periodic_kinematics
from identification.errors import DataError
from identification.models.motion import Motion
from identification.period import SHORTEST, with_period_seen
from identification.smoothing import smooth_kinematics
from rigctl.runfile import Run

Floats = NDArray[np.float64]

ROOM_TEMPERATURE_DEGC = 25.0  # where a run has none
_SETTLED = 1.5  # a period is settled when it differs from those after it by no more than this multiple of the noise
_REPEATS = 1e-6  # of the highest value: tolerance of a repetition, for the rounding of a file


def motion_of(run: Run) -> Motion:
    """Clean inputs of a run: its mean period repeated where it is periodic, a smoothed record where it is not."""
    run = with_period_seen(run).run
    if not is_periodic(run):
        return free_motion(run)[0]
    shown = periods(run, "force" if "force" in run.channels else "displacement")
    return periodic_motion(run, settling_periods(shown))[0]


MEASURED = {"velocity": "v", "acceleration": "a"}
"""Channels that a run may hold as measured, which else follow from the displacement; and their series in `Motion`."""


def with_measured(motion: Motion, run: Run, channels: Iterable[str]) -> Motion:
    """The motion of a run with those of the named channels that were measured in place of what was derived.

    Of a periodic motion the derived one stays: it is exact.
    """
    named = [name for name in channels if name in MEASURED]
    if motion.period or not named:
        return motion
    series = {MEASURED[name]: run.channels[name][: motion.x.size] for name in named}
    return replace(motion, v=series.get("v", motion.v), a=series.get("a", motion.a))


def motion_from(
    displacement: ArrayLike,
    sample_rate_hz: float,
    *,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    current: ArrayLike = 0.0,
    temperature: ArrayLike = ROOM_TEMPERATURE_DEGC,
    period: int = 0,
    settle: int = 0,
) -> Motion:
    """The motion of arrays (N,), m, m/s, m/s², A and °C; current and temperature may be one number.

    Where no velocity is given it follows from the displacement: exactly, line by line, where the motion repeats after
    `period` samples; else through the low-pass that a measured displacement goes through. After `settle` periods the
    force repeats too, and is simulated no further; 0 simulates all.

    Raises
    ------
    DataError
        one line, where an array has another length or is not finite, the rate is not positive, or nothing repeats.
    """
    x = _series("displacement", displacement, None)
    n = x.size
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0.0):
        raise DataError(f"sample rate is {sample_rate_hz:g} Hz: it must be above 0")
    i, degc = _series("current", current, n), _series("temperature", temperature, n)
    _check_period(n, period, settle)
    v = None if velocity is None else _series("velocity", velocity, n)
    a = None if acceleration is None else _series("acceleration", acceleration, n)
    for name, series in (("displacement", x), ("velocity", v), ("acceleration", a), ("current", i)):
        _check_repeats(name, series, period)
    if v is None:
        found = _kinematics(x, sample_rate_hz, period, settle)
        x, v, a = found.x, found.v, found.a if a is None else a
    elif a is None:
        a = _kinematics(v, sample_rate_hz, period, settle).v if period else np.gradient(v, 1.0 / sample_rate_hz)
    if period:
        i = np.resize(i[settle * period :].reshape(-1, period).mean(axis=0), n)
    time = np.arange(n) / sample_rate_hz
    return Motion(dt=1.0 / sample_rate_hz, x=x, v=v, a=a, i=i, temperature=degc, t=time, period=period, settle=settle)


def _series(name: str, values: ArrayLike, samples: int | None) -> Floats:
    """One input as an array (N,) of its own; raises DataError."""
    try:
        series = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise DataError(f"{name} has a value that is not a number: give an array of numbers, SI units") from error
    if series.ndim == 0 and samples is not None:
        series = np.full(samples, float(series))
    if series.ndim != 1 or series.size < 2:
        raise DataError(f"{name} has the shape {series.shape}: it must be one row of at least 2 samples")
    if samples is not None and series.size != samples:
        raise DataError(f"{name} has {series.size} samples, the displacement {samples}: give equal numbers")
    bad = np.flatnonzero(~np.isfinite(series))
    if bad.size:
        raise DataError(f"{name} is {series[bad[0]]} at sample {bad[0]}: every sample must be a finite number")
    return series


def _check_period(samples: int, period: int, settle: int) -> None:
    if period and not SHORTEST <= period <= samples:
        raise DataError(f"period is {period} samples: it must be 0, or lie within [{SHORTEST}, {samples}]")
    if period and samples % period:
        raise DataError(f"displacement has {samples} samples: not a whole number of periods of {period}")
    count = samples // period if period else 1
    if not 0 <= settle < count:
        raise DataError(f"settle is {settle}: it must lie within [0, {count - 1}], to leave a settled period")


def _check_repeats(name: str, series: Floats | None, period: int) -> None:
    if not period or series is None:
        return
    apart = float(np.max(np.abs(series.reshape(-1, period) - series[-period:])))
    if apart > _REPEATS * float(np.max(np.abs(series))):
        raise DataError(f"{name} does not repeat after {period} samples: periods differ by up to {apart:.3g}")


def _kinematics(x: Floats, sample_rate_hz: float, period: int, settle: int) -> Kinematics:
    """The motion and its derivatives, (N,); of a periodic one every period is the mean of the settled."""
    if not period:
        return smooth_kinematics(x, sample_rate_hz)
    settled = x[settle * period :].reshape(-1, period)
    # From two periods the noise is their difference; from one it would be guessed from lines of the motion.
    one = periodic_kinematics(settled if len(settled) > 1 else np.tile(settled, (2, 1)), sample_rate_hz)
    return replace(one, x=np.resize(one.x, x.size), v=np.resize(one.v, x.size), a=np.resize(one.a, x.size))


def is_periodic(run: Run) -> bool:
    """Whether a run holds two periods or more; whether they repeat is seen by `with_period_seen`."""
    return run.period_samples >= SHORTEST and run.samples >= 2 * run.period_samples


def periods(run: Run, channel: str) -> Floats:
    """The whole periods of a channel, (P, N)."""
    count = run.samples // run.period_samples
    return run.channels[channel][: count * run.period_samples].reshape(count, run.period_samples)


def periodic_motion(run: Run, drop: int) -> tuple[Motion, Kinematics]:
    """The mean period after the first `drop`, repeated over the run's whole periods; and that period."""
    moved, period = periods(run, "displacement")[drop:], run.period_samples
    kinematics = periodic_kinematics(moved, run.sample_rate_hz)
    index = np.arange((moved.shape[0] + drop) * period) % period
    current = periods(run, "current")[drop:].mean(axis=0) if "current" in run.channels else np.zeros(period)
    motion = Motion(
        dt=1.0 / run.sample_rate_hz,
        x=kinematics.x[index],
        v=kinematics.v[index],
        a=kinematics.a[index],
        i=current[index],
        temperature=_temperature(run)[: index.size],
        t=np.arange(index.size) / run.sample_rate_hz,
        period=period,
        settle=drop,
    )
    return motion, kinematics


def free_motion(run: Run) -> tuple[Motion, Kinematics]:
    """The motion of a run without whole periods; and how it was found."""
    kinematics = smooth_kinematics(run.channels["displacement"], run.sample_rate_hz)
    current = run.channels.get("current")
    motion = Motion(
        dt=1.0 / run.sample_rate_hz,
        x=kinematics.x,
        v=kinematics.v,
        a=kinematics.a,
        i=current.copy() if current is not None else np.zeros(run.samples),
        temperature=_temperature(run),
        t=np.arange(run.samples) / run.sample_rate_hz,
    )
    return motion, kinematics


def settling_periods(periods: Floats) -> int:
    """How many leading periods of (P, N) are transient: the first always, then all that differ from the last half."""
    count = periods.shape[0]
    late = periods[count // 2 :]
    reference = late.mean(axis=0)
    noise = float(np.sqrt(np.mean((late - reference) ** 2))) * np.sqrt(late.shape[0] / max(late.shape[0] - 1, 1))
    drop = 1
    while drop < count // 2 and np.sqrt(np.mean((periods[drop] - reference) ** 2)) > _SETTLED * noise * 1.5:
        drop += 1
    return drop


def _temperature(run: Run) -> Floats:
    """Body temperature without its sensor's noise, (N,), °C: a metal body does not change within a second."""
    raw = run.channels.get("temperature")
    if raw is None:
        return np.full(run.samples, ROOM_TEMPERATURE_DEGC)
    width = max(3, min(int(run.sample_rate_hz), run.samples // 4))
    return running_mean(raw, width)
