"""Checks of a measured run: findings that state the channel, what was found and where."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from identification.force_faults import spike_fault
from identification.motion_faults import jump_fault, velocity_fault
from identification.period import with_period_seen
from rigctl.magnitudes import doubts_of
from rigctl.runfile import Run

Floats = NDArray[np.float64]
Kind = Literal[
    "polarity", "clipping", "frozen", "skew", "drift", "aliasing", "period", "magnitude", "jump", "velocity", "spike"
]

UNITS: Final = {"displacement": "m", "force": "N", "current": "A"}
_IMPORTED = 300_000  # samples of an imported run that are looked at: 5 min at 1 kHz
_AGAINST = -0.3  # correlation of force and velocity below which a damper would drive the rig
_FLAT_SAMPLES = 4  # equal samples at an extreme that are clipping
_STEEP = 6.0  # … if the sample before was this many resolutions away
_STILL_SHARE, _STILL_SAMPLES = 0.02, 50
_LATE_SAMPLES = 1.5
_DRIFT_SHARE, _DRIFT_SIGMAS = 0.01, 6.0
_TOP = 0.9  # of the Nyquist frequency: a signal that repeats above it goes on beyond Nyquist
_ALIAS_RATIO = 10.0  # of repeatable power over noise power in that band


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding in one channel."""

    kind: Kind
    channel: str
    text: str

    def __str__(self) -> str:
        return f"{self.channel}: {self.text}"


def check_run(run: Run) -> tuple[Finding, ...]:
    """Every finding in a run; empty where there is none. Nothing is changed or refused."""
    doubts = [Finding("magnitude", doubt.channel, doubt.text) for doubt in doubts_of(run)]
    channels = [name for name in UNITS if name in run.channels and run.samples >= 64]
    found = [f for name in channels for f in (*_frozen(run, name), *_clipped(run, name))]
    if "displacement" in channels and "force" in channels and not any(f.kind == "frozen" for f in found):
        seen = with_period_seen(run)
        found += [Finding("period", seen.differs, seen.note)] if seen.differs else []
        for look in _LOOKS:
            found += look(seen.run)
    return (*doubts, *found)


def findings_in(runs: Sequence[Run]) -> list[str]:
    """A line for every finding in the runs, with the name of the run."""
    return [f"{run.path.name if run.path else run.run_id}: {finding}" for run in runs for finding in check_run(run)]


def findings_of_import(run: Run) -> tuple[Finding, ...]:
    """The findings in the first samples of an imported run, without the magnitudes, which its import tells."""
    if run.samples > _IMPORTED:
        run = replace(run, channels={name: values[:_IMPORTED] for name, values in run.channels.items()})
    return tuple(found for found in check_run(run) if found.kind != "magnitude")


def _polarity(run: Run) -> Iterator[Finding]:
    """The sign of ∫F dx: a damper takes energy."""
    x, force = run.channels["displacement"], run.channels["force"]
    v, f = np.gradient(x), force - force.mean()
    work = float(v @ f) / max(float(np.linalg.norm(v) * np.linalg.norm(f)), 1e-300)
    energy = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x)))
    if work < _AGAINST:
        text = (
            f"it drives the motion: {energy:.3g} J dissipated, correlation with velocity {work:.2f}: the sign of force "
            "or displacement is reversed (extension and tension are positive)"
        )
        yield Finding("polarity", "force", text)


def _clipped(run: Run, channel: str) -> Iterator[Finding]:
    """Flat stretches at an extreme that the signal reached at speed."""
    values = run.channels[channel]
    if np.unique(values[:2000]).size < 50:
        return
    resolution = _resolution(values)
    for extreme, side in ((values.max(), "top"), (values.min(), "bottom")):
        starts, lengths = _stretches(values == extreme)
        inside = (starts > 0) & (lengths >= _FLAT_SAMPLES)
        steep = np.abs(values[starts[inside] - 1] - extreme) > _STEEP * resolution
        if np.any(steep):
            share = 100.0 * float(np.sum(lengths[inside][steep])) / values.size
            text = f"clipped at its {side}: it stays at {extreme:.4g} {UNITS[channel]} for {share:.2g} % of the run"
            yield Finding(
                "clipping", channel, f"{text}, first at {starts[inside][steep][0] / run.sample_rate_hz:.3f} s"
            )


def _frozen(run: Run, channel: str) -> Iterator[Finding]:
    """A channel that is constant while the piston moves."""
    values, x = run.channels[channel], run.channels.get("displacement")
    if np.ptp(values) == 0.0:
        if channel != "current":  # a constant current is a setting
            yield Finding("frozen", channel, f"frozen at {values[0]:.4g} {UNITS[channel]} throughout: check its sensor")
        return
    if channel == "current" or x is None or np.ptp(x) == 0.0:
        return
    starts, lengths = _stretches(np.concatenate([[False], np.diff(values) == 0.0]))
    starts, lengths = np.maximum(starts - 1, 0), lengths + 1  # the sample before a difference counts
    long = lengths >= max(_STILL_SAMPLES, _STILL_SHARE * values.size)
    for start, length in zip(starts[long], lengths[long], strict=True):
        other = run.channels.get("force") if channel == "displacement" else x
        if other is not None and np.ptp(other[start : start + length]) > 0.05 * np.ptp(other):
            since, until = start / run.sample_rate_hz, (start + length) / run.sample_rate_hz
            yield Finding(
                "frozen", channel, f"frozen at {values[start]:.4g} {UNITS[channel]} from {since:.3f} to {until:.3f} s"
            )
            return


def _skew(run: Run) -> Iterator[Finding]:
    """Force reversals late or early against those of the velocity by a constant time, where the motion is fast.

    A force that is more than an eighth of a period away is mostly that of a spring or a mass.
    """
    x, force, rate = run.channels["displacement"], run.channels["force"], run.sample_rate_hz
    width = max(1, int(rate / 200.0))
    kernel = np.ones(width) / width
    v = np.convolve(np.gradient(x), kernel, mode="same")
    f = np.convolve(force - 0.5 * (np.percentile(force, 99) + np.percentile(force, 1)), kernel, mode="same")
    reversals = _crossings(v)
    if reversals.size < 8:
        return
    span = float(np.median(np.diff(reversals)))
    of_force = _crossings(f)
    if of_force.size < 0.8 * reversals.size:
        return
    nearest = of_force[np.clip(np.searchsorted(of_force, reversals), 1, of_force.size - 1)]
    before = of_force[np.clip(np.searchsorted(of_force, reversals) - 1, 0, of_force.size - 1)]
    late = np.where(np.abs(nearest - reversals) < np.abs(before - reversals), nearest - reversals, before - reversals)
    typical, spread = float(np.median(late)), float(np.percentile(late, 75) - np.percentile(late, 25))
    if abs(typical) > _LATE_SAMPLES + 1.0 * spread and 0.02 * span < abs(typical) < 0.25 * span:
        word = "behind" if typical > 0 else "ahead of"
        text = (
            f"it reverses {1e3 * abs(typical) / rate:.3g} ms {word} the velocity: a time skew between the channels, a "
            "spring or a mass beside the damper, or its compliance or lag; tests at two frequencies distinguish them"
        )
        yield Finding("skew", "force", text)


def _drift(run: Run) -> Iterator[Finding]:
    """Mean force of one period after the other."""
    period = run.period_samples
    if period < 8 or run.samples < 4 * period:
        return
    means = run.channels["force"][: run.samples // period * period].reshape(-1, period).mean(axis=1)[1:]
    time = np.arange(means.size) * period / run.sample_rate_hz
    slope, start = np.polyfit(time, means, 1)
    rest = means - start - slope * time
    sigma = float(
        np.sqrt(np.sum(rest**2) / max(means.size - 2, 1) / max(float(np.sum((time - time.mean()) ** 2)), 1e-300))
    )
    change = slope * run.samples / run.sample_rate_hz
    if abs(change) > _DRIFT_SHARE * float(np.ptp(run.channels["force"])) and abs(slope) > _DRIFT_SIGMAS * sigma:
        yield Finding("drift", "force", f"its mean drifts by {slope:.3g} N/s, {change:.3g} N over the run")


def _aliased(run: Run) -> Iterator[Finding]:
    """A force that repeats from period to period up to the Nyquist frequency goes on beyond it and is folded back."""
    period = run.period_samples
    if period < 64 or run.samples < 4 * period:
        return
    periods = run.channels["force"][: run.samples // period * period].reshape(-1, period)[1:]
    spectra = np.fft.rfft(periods, axis=1)
    mean = spectra.mean(axis=0)
    noise = np.sum(np.abs(spectra - mean) ** 2, axis=0) / (len(periods) - 1) / len(periods)
    top = slice(int(_TOP * mean.size), -1)
    repeats, floor = float(np.sum(np.abs(mean[top]) ** 2)), float(np.sum(noise[top]))
    total = float(np.sum(np.abs(mean[1:]) ** 2))
    if repeats > _ALIAS_RATIO * floor and repeats > 1e-8 * total:
        edge = _TOP * 0.5 * run.sample_rate_hz
        text = (
            f"it repeats above {edge:.4g} Hz, {repeats / max(floor, 1e-300):.2g} times its noise: it goes on beyond "
            f"half the sample rate of {run.sample_rate_hz:g} Hz and is folded back; filter before sampling"
        )
        yield Finding("aliasing", "force", text)


def _jumps(run: Run) -> Iterator[Finding]:
    """A displacement that moves farther within a sample than its motion allows."""
    if (text := jump_fault(run)) is not None:
        yield Finding("jump", "displacement", text)


def _velocity(run: Run) -> Iterator[Finding]:
    """A measured velocity that is not that of the displacement."""
    if (text := velocity_fault(run)) is not None:
        yield Finding("velocity", "velocity", text)


def _spikes(run: Run) -> Iterator[Finding]:
    """Single samples of the force that stand off both of their neighbours."""
    if (text := spike_fault(run)) is not None:
        yield Finding("spike", "force", text)


_LOOKS: Final[tuple[Callable[[Run], Iterator[Finding]], ...]] = (
    _polarity,
    _skew,
    _drift,
    _aliased,
    _jumps,
    _velocity,
    _spikes,
)


def _resolution(values: Floats) -> float:
    """The resolution: the 10 % quantile of the steps between different neighbouring samples."""
    steps = np.abs(np.diff(values))
    return float(np.percentile(steps[steps > 0.0], 10)) if np.any(steps > 0.0) else 0.0


def _stretches(true: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Starts and lengths of the stretches where it is true."""
    edges = np.diff(np.concatenate([[0], true.astype(np.int64), [0]]))
    starts = np.flatnonzero(edges == 1)
    return starts, np.flatnonzero(edges == -1) - starts


def _crossings(signal: Floats) -> Floats:
    """Times of the zero crossings between two excursions beyond 10 % of the signal, in samples, interpolated."""
    level = 0.1 * float(np.percentile(np.abs(signal), 95))
    state = np.where(signal > level, 1, np.where(signal < -level, -1, 0))
    known = np.flatnonzero(state)
    changes = np.flatnonzero(np.diff(state[known]))
    times = []
    for k in changes:
        a, b = known[k], known[k + 1]
        stretch = signal[a : b + 1]
        inside = np.flatnonzero(np.sign(stretch[:-1]) != np.sign(stretch[1:]))
        if inside.size:
            j = a + inside[inside.size // 2]
            times.append(j + signal[j] / (signal[j] - signal[j + 1]))
    return np.array(times)
