"""The recording chain: filters, skew, zero, drift, hum, noise, steps of the converter, polarity, clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bessel, butter, lfilter, lfilter_zi

from benchmarks.machines.simulation import Motion
from rigctl.runfile import Run

Row = NDArray[np.float64]

FILTERS = ("none", "rc", "butterworth 2", "butterworth 4", "bessel 4")


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """What stands between the machine and the file; the numbers in `values` are those that an effect may change.

    `values`: filter_hz (cut-off in the force channel, 0: none), delay_s, zero_n, wander_n (of the zero between runs),
    drift_n_s, hum_n, hum_hz, early_hz (cut-off in the displacement channel, 0: none), skew (of the clocks of both
    channels).
    """

    values: Mapping[str, float] = field(default_factory=dict)
    filter_kind: str = "rc"
    force_noise_n: float = 0.0
    force_step_n: float = 0.0
    place_noise_m: float = 0.0
    place_step_m: float = 0.0
    current_noise_a: float = 0.0
    clock_error: float = 0.0  # of the stated rate, drawn within ± for each run
    thermometer: bool = True
    turned: tuple[int, ...] = ()  # runs with the force upside down

    def number(self, name: str) -> float:
        """One of `values`, 0 where it is not given."""
        return self.values.get(name, 0.0)


CHAIN_NAMES = ("filter_hz", "delay_s", "zero_n", "wander_n", "drift_n_s", "hum_n", "hum_hz", "early_hz", "skew")


@dataclass(frozen=True, slots=True, kw_only=True)
class Luck:
    """What differs between the runs of a case and is drawn once: shares in −1 … 1, and the phase of the mains."""

    zero: float
    clock: float
    hum: float


def drawn_luck(rng: np.random.Generator) -> Luck:
    """The luck of one run."""
    zero, clock, hum = rng.uniform(-1.0, 1.0, 3)
    return Luck(zero=float(zero), clock=float(clock), hum=float(np.pi * hum))


def sensed(chain: Chain, luck: Luck, motion: Motion, force: Row) -> Row:
    """Force as the load cell's channel has it at the instants of the record, without noise and steps, N."""
    fine_hz = motion.rate_hz * motion.fine
    if chain.number("filter_hz") > 0.0:
        force = filtered(chain.filter_kind, chain.number("filter_hz"), fine_hz, force)
    t = np.arange(motion.lead, force.size // motion.fine) / motion.rate_hz
    since = t - t[0]
    late = t - chain.number("delay_s") + chain.number("skew") * since
    out = np.interp(late * fine_hz, np.arange(force.size), force)
    out = out + chain.number("zero_n") + chain.number("wander_n") * luck.zero + chain.number("drift_n_s") * since
    return np.asarray(
        out + chain.number("hum_n") * np.sin(2.0 * np.pi * chain.number("hum_hz") * since + luck.hum), dtype=np.float64
    )


def as_measured(chain: Chain, motion: Motion) -> Motion:
    """The motion that the displacement channel tells, with its filter but without noise and steps."""
    cut = chain.number("early_hz")
    if cut == 0.0:
        return motion
    rows = {n: filtered(chain.filter_kind, cut, motion.rate_hz * motion.fine, getattr(motion, n)) for n in "xva"}
    return replace(motion, **rows)


def filtered(kind: str, cut_hz: float, rate_hz: float, row: Row) -> Row:
    """An analogue low-pass, from the steady state of the first sample."""
    share = min(2.0 * cut_hz / rate_hz, 0.9)
    if kind == "bessel 4":
        b, a = bessel(4, share, norm="phase")
    else:
        b, a = butter({"rc": 1, "butterworth 2": 2, "butterworth 4": 4}[kind], share)
    out, _ = lfilter(b, a, row, zi=lfilter_zi(b, a) * row[0])
    return np.asarray(out)


def recorded(
    rng: np.random.Generator, chain: Chain, luck: Luck, motion: Motion, force: Row, number: int, name: str, kind: str
) -> Run:
    """The run as measured. `force` is that of `sensed`, `motion` that of `as_measured`."""
    size = force.size
    x = motion.x[motion.lead * motion.fine :: motion.fine]
    sign = -1.0 if number in chain.turned else 1.0
    channels = {
        "displacement": _stepped(x + rng.normal(0.0, chain.place_noise_m, size), chain.place_step_m),
        "force": sign * _stepped(force + rng.normal(0.0, chain.force_noise_n, size), chain.force_step_n),
    }
    units = {"displacement": "m", "force": "N"}
    if chain.thermometer:
        warm = motion.temperature[motion.lead :] + rng.normal(0.0, 0.05, size)
        channels["temperature"], units["temperature"] = _stepped(warm, 0.1), "degC"
    if chain.current_noise_a > 0.0:
        noise = rng.normal(0.0, chain.current_noise_a, size)
        channels["current"], units["current"] = motion.current[motion.lead :] + noise, "A"
    return Run(
        run_id=f"{name}-{number}",
        created="2026-01-01T00:00:00+00:00",
        specimen=name,
        sample_rate_hz=motion.rate_hz * (1.0 + chain.clock_error * luck.clock),
        period_samples=0,
        excitation_kind=kind,
        status="complete",
        channels=channels,
        units=units,
    )


def _stepped(row: Row, step: float) -> Row:
    return np.rint(row / step) * step if step > 0.0 else row
