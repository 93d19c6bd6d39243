"""A run prepared for identification: clean inputs, the compared window, and the noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind
from identification.criteria import CHANCE, FORM
from identification.derivatives import Kinematics, band_of_drive, low_pass_lines
from identification.errors import DataError
from identification.models.inputs import (
    free_motion,
    is_periodic,
    motion_from,
    periodic_motion,
    periods,
    settling_periods,
)
from identification.models.motion import Motion
from identification.noise import between_periods, from_cycles, high_frequency
from identification.period import with_period_seen
from identification.rests import resting
from identification.smoothing import smooth_kinematics
from rigctl.runfile import Run

Floats = NDArray[np.float64]
Window = slice | NDArray[np.int64]

ROUNDING = 1e-6  # of rms force: rounding of a noise-free record and of the solver that made it
_MIN_SAMPLES = 64
# SI: a channel that moves by less is frozen. No sensor resolves a picometre or a piconewton. Half or double: nothing.
_LEAST_SPAN = 1e-12
_REPEATABLE_FLOOR = 2e-4  # of rms force: neither a rig nor a solver is more exact


_ROUGH = 1.5  # mean square of the steps over the variance: 2 for white noise, near 0 for a well sampled signal
_STANDS = 1e-4  # of the highest velocity: what moves no faster rests
_SOME = 0.02  # share of a record at rest from which it is left out
_KNOWN = 2  # periodic records from which the noise of the load cell is known
_SAME_LEVEL = 1.15
_MEDIAN_AND_MEAN = 3.6  # variance of σ² from a share of the lines of Hann's window, times the share; read off draws


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One run as identification sees it.

    `window` selects the samples that count: without the transient periods of a periodic run, or the edges of another.
    `sigma` is the rms, N, that no model can explain. `route` says in words how it and the derivatives were found.
    """

    name: str
    motion: Motion
    force: Floats  # (N,), N, whole run
    window: Window
    period: int
    sigma: float
    has_current: bool
    has_temperature: bool
    route: str
    bandwidth_hz: float
    tones_hz: tuple[float, ...] = ()
    notes: tuple[str, ...] = field(default=())
    kind: str = Kind.CUSTOM
    simulated: Floats | None = None  # (N,), N: what another program simulates, to which a model adds
    modelled: float = 0.0  # share of the noise variance that follows from a model instead of the measured force
    band_hz: float | None = (
        None  # force and model are compared up to this frequency only: the motion is not known above it
    )
    mean_sigma: float | None = None  # rms noise of the mean period, N, where it is not that of one by √P
    floor_variance: float = CHANCE.floor_variance  # of χ² over that with a known noise floor
    independent: float = 1.0  # share of the samples whose noise is independent, below 1 where it is coloured
    again: Motion | None = None  # the motion with another realisation of the sensor noise

    @property
    def dt(self) -> float:
        """Sample interval, s."""
        return self.motion.dt

    @property
    def measured(self) -> Floats:
        """Measured force within the window, (M,), N."""
        return self.force[self.window]

    def seen(self, signal: Floats) -> Floats:
        """A simulated force (N,) or its gradient (N, K) in the compared window and band."""
        if self.band_hz is None:
            return signal[self.window]
        return low_pass_lines(signal[self.window], 1.0 / self.dt, self.band_hz)


def compact(record: Record, foreign: Floats | None = None) -> Record:
    """The mean settled period of a periodic record, for a search that uses only what repeats; other records unchanged.

    Time and temperature become their means over the periods, so that a drift keeps its exact share. `foreign`
    (N,), N, is taken from the force first (mains hum, which the mean would only blur).
    """
    force = record.force if foreign is None else record.force - foreign
    if not record.period:
        return replace(record, force=force)
    assert isinstance(record.window, slice)  # periods count whole
    motion, period, start = record.motion, record.period, record.window.start
    count = (record.window.stop - start) // period
    head = motion.head(start + period)
    time, temperature = head.t.copy(), head.temperature.copy()
    time[start:] = motion.t[record.window].reshape(count, period).mean(axis=0)
    temperature[start:] = float(np.mean(motion.temperature[record.window]))
    temperature[:start] = temperature[-1]
    mean = force[record.window].reshape(count, period).mean(axis=0)
    simulated = record.simulated
    if simulated is not None:
        repeated = simulated[record.window].reshape(count, period).mean(axis=0)
        simulated = np.concatenate([simulated[:start], repeated])
    floor = _REPEATABLE_FLOOR * float(np.sqrt(np.mean(mean**2)))
    return replace(
        record,
        motion=replace(head, t=time, temperature=temperature),
        force=np.concatenate([force[:start], mean]),
        window=slice(start, start + period),
        simulated=simulated,
        sigma=float(np.hypot(record.mean_sigma or record.sigma / np.sqrt(count), floor)),
        mean_sigma=None,
        again=None,
    )


def on_top_of_simulation(record: Record, run: Run) -> Record:
    """The record with the force that another program simulated for it, the channel `force_simulated`.

    Raises DataError when the run has no such channel.
    """
    simulated = run.channels.get("force_simulated")
    if simulated is None:
        raise DataError(
            f"{record.name}: no channel 'force_simulated': write the force of your own simulation into it, N, "
            "or give a model file"
        )
    if record.band_hz is not None:
        simulated = simulated.copy()
        simulated[record.window] = low_pass_lines(simulated[record.window], run.sample_rate_hz, record.band_hz)
    return replace(record, simulated=simulated[: record.force.size].copy())


def check_measured(run: Run) -> str:
    """The name of a run in messages, where it can be learned from or compared with.

    Raises DataError when it lacks displacement or force, is too short, or its force or motion is frozen.
    """
    name = run.path.name if run.path is not None else run.run_id
    for channel in ("displacement", "force"):
        if channel not in run.channels:
            raise DataError(f"{name}: no channel '{channel}': identification needs measured displacement and force")
        if run.samples >= _MIN_SAMPLES and np.ptp(run.channels[channel]) <= _LEAST_SPAN:
            raise DataError(f"{name}: channel '{channel}' is frozen at {run.channels[channel][0]:g}: check its sensor")
    if run.samples < _MIN_SAMPLES:
        raise DataError(f"{name}: only {run.samples} samples: at least {_MIN_SAMPLES} are needed")
    return name


def record_from_run(run: Run) -> Record:
    """Prepare a run.

    Raises
    ------
    DataError
        when the run lacks displacement or force, is too short, or its force or motion is frozen.
    """
    name = check_measured(run)
    seen = with_period_seen(run)
    record = _periodic(seen.run, name) if is_periodic(seen.run) else _free(seen.run, name)
    return record if seen.differs or not seen.note else replace(record, notes=(*record.notes, seen.note))


def record_to_come(
    displacement: Floats,
    sample_rate_hz: float,
    *,
    current: Floats | None = None,
    period: int = 0,
    settle: int = 0,
    sigma: float,
    kind: str = Kind.CUSTOM,
) -> Record:
    """The record of a planned run with this displacement (N,), m, and current, A, without its force.

    After `settle` periods of `period` samples it repeats; `sigma` is the expected noise of the force, N.
    """
    n = displacement.size
    given = 0.0 if current is None else current
    motion = motion_from(displacement, sample_rate_hz, current=given, period=period, settle=settle)
    band = 0.5 * sample_rate_hz if period else smooth_kinematics(displacement, sample_rate_hz).bandwidth_hz
    window: Window = slice(settle * period, n)
    if not period:
        window = _moving(motion.x, 0.0, motion, _edge(sample_rate_hz, band, n))[0]
    return Record(
        name="to come",
        motion=motion,
        force=np.zeros(n),
        window=window,
        period=period,
        sigma=sigma,
        has_current=_varies(motion.i),
        has_temperature=False,
        route="no run yet",
        bandwidth_hz=band,
        kind=kind,
    )


def _periodic(run: Run, name: str) -> Record:
    force = periods(run, "force")
    drop = settling_periods(force)
    motion, kinematics = periodic_motion(run, drop)
    motion = _without_noise_of_current(motion)
    settled, period = force[drop:], run.period_samples
    narrow, limited, share = band_of_drive(kinematics, settled, run.sample_rate_hz), "", 1.0
    sigma, tones = high_frequency(settled.ravel())[0], list[float]()
    if narrow is not None:
        share = min(1.0, 2.0 * narrow / run.sample_rate_hz)
        settled = low_pass_lines(settled.ravel(), run.sample_rate_hz, narrow).reshape(settled.shape)
        force = np.concatenate([force[:drop], settled])
        limited = f"; the force ends at {narrow:.3g} Hz, where the motion does not: compared up to that frequency only"
    if settled.shape[0] >= 2:
        sigma, tones = between_periods(settled)
        route = f"{settled.shape[0]} periods of {period} samples averaged, noise from their differences"
    else:
        sigma *= np.sqrt(share)
        route = f"one settled period of {period} samples, noise from its highest frequencies"
    return Record(
        name=name,
        motion=motion,
        force=force.ravel(),
        window=slice(drop * period, force.size),
        period=period,
        sigma=_at_least(sigma, force),
        has_current=_varies(run.channels.get("current")),
        has_temperature="temperature" in run.channels,
        route=route + limited,
        bandwidth_hz=kinematics.bandwidth_hz,
        tones_hz=tuple(q * run.sample_rate_hz for q in tones),
        kind=run.excitation_kind,
        again=_again(motion, kinematics, drop * period),
        band_hz=narrow,
        independent=share,
    )


def _again(motion: Motion, kinematics: Kinematics, settled: int) -> Motion:
    """The motion with the noise of its sensor on it, from sample `settled` on."""
    dx, dv, da = (np.concatenate([np.zeros(settled), d.ravel()]) for d in kinematics.noise)
    return replace(motion, x=motion.x + dx, v=motion.v + dv, a=motion.a + da, period=0, settle=0)


def _free(run: Run, name: str) -> Record:
    x, force, current = run.channels["displacement"], run.channels["force"], run.channels.get("current")
    motion, kinematics = free_motion(run)
    motion = _without_noise_of_current(motion)
    steady = current is None or is_steady(current)
    sigma, unsure, how = _noise_of(x, force, run.sample_rate_hz, kinematics.bandwidth_hz, steady)
    again = _again(motion, kinematics, 0)
    edge = _edge(run.sample_rate_hz, kinematics.bandwidth_hz, force.size)
    window, resting = _moving(x, high_frequency(x)[0], motion, edge)
    return Record(
        name=name,
        motion=motion,
        force=force,
        window=window,
        period=0,
        sigma=_at_least(sigma, force),
        has_current=_varies(current),
        has_temperature="temperature" in run.channels,
        route=f"no whole periods: derivatives up to {kinematics.bandwidth_hz:.3g} Hz, noise from {how}",
        bandwidth_hz=kinematics.bandwidth_hz,
        notes=resting,
        kind=run.excitation_kind,
        floor_variance=1.0 + unsure,
        again=again,
    )


def _noise_of(x: Floats, force: Floats, rate: float, bandwidth_hz: float, steady: bool) -> tuple[float, float, str]:
    """Noise of the force of a record without periods, N, how unsure it is, and where it was seen.

    Unsure is the variance of an estimated σ² over that of one from as many samples of white noise.
    """
    edge = _edge(rate, bandwidth_hz, force.size)
    inner = slice(edge, force.size - edge)
    cycles = from_cycles(force[inner], x[inner], rate) if steady else None
    if cycles is not None:
        return cycles[0], _MEDIAN_AND_MEAN / cycles[1], "what lies between the harmonics of the motion"
    sigma, share = high_frequency(force[inner])
    return sigma, _MEDIAN_AND_MEAN / share, "the highest frequencies that its filter lets through"


def _edge(rate: float, bandwidth_hz: float, samples: int) -> int:
    """Samples at each end within which the filter of the motion has not settled."""
    return int(np.clip(rate / bandwidth_hz, 4, samples // 20))


def _moving(x: Floats, noise: float, motion: Motion, edge: int) -> tuple[Window, tuple[str, ...]]:
    """The compared samples: without the ends, and without rests, where friction can hold any force.

    What rests is seen in the displacement (N,), m, as it was measured: its filtered velocity rings beside corners.
    """
    first = _forgotten(motion.x, edge)
    creep = _STANDS * float(np.max(np.abs(motion.v))) * motion.dt
    rests = resting(x, noise, creep, 2 * edge + 1)
    share = float(np.mean(rests))
    if not _SOME < share < 0.9:
        return slice(first, x.size - edge), ()
    rests[:first] = rests[x.size - edge :] = True
    return np.flatnonzero(~rests), (
        f"{100 * share:.0f} % of it is at rest, where friction can hold any force: left out",
    )


def _forgotten(x: Floats, edge: int) -> int:
    """Samples at the start in which a machine may remember what it did before the record.

    A hysteresis forgets over a path, here that of the whole travel, but no more than the largest edge is left out.
    """
    path = np.cumsum(np.abs(np.diff(x)))
    return max(edge, min(int(np.searchsorted(path, np.ptp(x))), x.size // 20))


def is_off(current: Floats) -> bool:
    """Whether the current is off: only noise of its sensor about zero."""
    return _is_noise(current) and abs(float(np.mean(current))) <= float(np.std(current))


def _without_noise_of_current(motion: Motion) -> Motion:
    """The motion with its mean, or zero, in the place of a current that is only the noise of its sensor about that.

    Runs at one current tell a force from its growth with the current by nothing but that noise: a fit would take the
    two apart by it, and be far off at any other current.
    """
    mean, scatter = float(np.mean(motion.i)), float(np.std(motion.i))
    if is_off(motion.i):
        return replace(motion, i=np.zeros_like(motion.i))
    alone = _is_noise(motion.i) and scatter < FORM.minor * abs(mean)
    return replace(motion, i=np.full_like(motion.i, mean)) if alone else motion


def is_steady(current: Floats, share: float = 0.05) -> bool:
    """Whether a current is constant but for sensor noise, or varies by less than a share of its highest value."""
    return _is_noise(current) or float(np.ptp(current)) < share * float(np.max(np.abs(current)))


def _is_noise(signal: Floats) -> bool:
    """Whether a signal varies as fast as white noise, whatever its size and unit (von Neumann 1941)."""
    return float(np.mean(np.diff(signal) ** 2)) >= _ROUGH * float(np.var(signal))


def _varies(current: Floats | None) -> bool:
    return current is not None and bool(np.any(current != 0.0))


def _at_least(sigma: float, force: Floats) -> float:
    """A noise-free record (a simulation) still has the rounding of its numbers and of its solver."""
    return max(sigma, ROUNDING * float(np.sqrt(np.mean(force**2))), np.finfo(np.float64).tiny)


def noise_without(record: Record, tone: Floats) -> Record:
    """The record with its noise estimated again without a foreign tone (N,), N; its force is unchanged."""
    if record.period == 0 or record.measured.size < 2 * record.period:
        return record
    sigma, _ = between_periods((record.force - tone)[record.window].reshape(-1, record.period))
    return replace(record, sigma=min(record.sigma, sigma)) if sigma > 0.0 else record


def same_load_cell(records: Sequence[Record]) -> list[Record]:
    """The records with the noise that periodic records show, where the estimate of another record is higher.

    In a run without whole periods an edge or a tone can be mistaken for noise; all runs have the same load cell.
    """
    known = [r.sigma for r in records if r.period and r.measured.size >= 2 * r.period]
    if len(known) < _KNOWN:
        return list(records)
    level = float(np.median(known))
    return [r if r.sigma <= _SAME_LEVEL * level else _with_noise(r, level) for r in records]


def _with_noise(record: Record, sigma: float) -> Record:
    return replace(record, sigma=sigma, route=f"{record.route}; the noise is that of the other runs")
