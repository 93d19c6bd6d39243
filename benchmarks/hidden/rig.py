"""The rig: simulates the specimen and the sensor path in an experiment and records the channels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from benchmarks.hidden.layout import Elements, Values, pack
from benchmarks.hidden.machine import force_of
from benchmarks.hidden.motion import LEAD_SAMPLES, RATE_HZ, Experiment, Row, fine_motion
from rigctl.runfile import Run

DISPLACEMENT_NOISE = 1e-5  # of the stroke range
CURRENT_NOISE = 1e-4  # of the current range
TEMPERATURE_NOISE_C = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Specimen:
    """A real machine: elements with their departures, and the scales of the departures."""

    elements: Elements
    scales: tuple[float, float, float, float]  # m/s, m, A, N


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """One experiment on a fine grid, ready to be simulated repeatedly."""

    motion: tuple[Row, Row, Row]
    current: Row
    temperature: Row
    fine: int
    start: int  # sample of the record at which it begins
    samples: int
    hum_turns: float  # phase of the mains at the start of the record, in turns


def prepared(experiment: Experiment, fine: int, hum_turns: float, start: int = 0, samples: int = 0) -> Prepared:
    """The experiment, or `samples` of it from `start`, on a grid of `fine` steps a sample."""
    samples = samples or experiment.samples
    part = slice(start, start + LEAD_SAMPLES + samples)
    return Prepared(
        motion=fine_motion(experiment, fine, start, samples),
        current=experiment.current[part] if experiment.current.size else np.zeros(LEAD_SAMPLES + samples),
        temperature=experiment.temperature[part],
        fine=fine,
        start=start,
        samples=samples,
        hum_turns=hum_turns,
    )


def true_force(specimen: Specimen, run: Prepared) -> Row:
    """Noise-free force at the load cell, (samples,), N."""
    p = pack(specimen.elements, specimen.scales)
    fine_force = force_of(p, run.motion, run.current, run.temperature, run.fine, RATE_HZ)
    return _sensed(specimen.elements, fine_force, run)


def _sensed(elements: Elements, fine_force: Row, run: Prepared) -> Row:
    t = (run.start + np.arange(run.samples)) / RATE_HZ
    force = _sampled(elements.get("force_delay"), fine_force, run)
    if "load_cell_creep" in elements:
        force = _crept(elements["load_cell_creep"], force)
    force = force[LEAD_SAMPLES:]
    if "moving_mass" in elements:
        force = force + _inertia(elements["moving_mass"], run)
    if "force_offset" in elements:
        zero = elements["force_offset"]
        force = force + zero["F0"] * (1.0 + zero.get("departure", 0.0) * np.sin(2 * np.pi * run.hum_turns))
    if "force_drift" in elements:
        force = force + _drift(elements["force_drift"], t)
    if "mains_hum" in elements:
        force = force + _hum(elements["mains_hum"], t, run.hum_turns)
    return np.ascontiguousarray(force)


def _sampled(delay: Values | None, fine_force: Row, run: Prepared) -> Row:
    """Every `fine`-th value, delayed by the channel's skew; the departure smears it like a filter."""
    at = np.arange(LEAD_SAMPLES + run.samples) * float(run.fine)
    if delay is None:
        return fine_force[:: run.fine]
    grid = np.arange(fine_force.size, dtype=np.float64)
    tau, spread = delay["tau"] * RATE_HZ * run.fine, delay.get("departure", 0.0)
    early, late = (np.interp(at - tau * (1.0 + s), grid, fine_force) for s in (-spread, spread))
    return np.asarray(0.5 * (early + late))


def _crept(creep: Values, force: Row) -> Row:
    gain, decay = creep["gain"], np.exp(-1.0 / (creep["tau"] * RATE_HZ))
    slow, _ = lfilter([1.0 - decay], [1.0, -decay], force, zi=[decay * float(np.mean(force))])
    return np.asarray(force + gain * slow)


def _inertia(mass: Values, run: Prepared) -> Row:
    """m·a, the departure is the effect of a slightly loose fixture."""
    a = run.motion[2][LEAD_SAMPLES * run.fine :: run.fine]
    q = mass.get("departure", 0.0)
    return np.asarray(mass["m"] * a * (1.0 + q * np.tanh(a / (np.std(a) + 1e-300))))


def _drift(drift: Values, t: Row) -> Row:
    """An amplifier that warms up: exponential with a falling rate; departure 0 is a straight line."""
    rate, q = drift["rate"], drift.get("departure", 0.0)
    return np.asarray(rate * t if q == 0.0 else rate * -np.expm1(-q * t / 20.0) * 20.0 / q)


def _hum(hum: Values, t: Row, turns: float) -> Row:
    """Mains with a small third harmonic; the frequency varies slightly from run to run."""
    q = hum.get("departure", 0.0)
    frequency = hum["frequency"] + 0.02 * q * np.cos(17.0 * turns)
    angle = 2 * np.pi * (frequency * t + turns)
    return np.asarray(hum["amplitude"] * (np.sin(angle) + q * np.sin(3 * angle + 0.7)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors:
    """Standard deviations of the noise of the channels, and the name of the specimen."""

    specimen: str
    force_n: float
    stroke_m: float
    current_a: float


def recorded(
    rng: np.random.Generator, sensors: Sensors, experiment: Experiment, run: Prepared, truth: Row, run_id: str
) -> Run:
    """The run as measured: noise on every channel, no current channel for a passive machine."""
    x = run.motion[0][LEAD_SAMPLES * run.fine :: run.fine]
    size = experiment.samples
    channels = {
        "displacement": x + rng.normal(0.0, DISPLACEMENT_NOISE * 2 * sensors.stroke_m, size),
        "force": truth + rng.normal(0.0, sensors.force_n, size),
        "temperature": experiment.temperature[LEAD_SAMPLES:] + rng.normal(0.0, TEMPERATURE_NOISE_C, size),
    }
    if experiment.current.size:
        noise = rng.normal(0.0, CURRENT_NOISE * sensors.current_a, size)
        channels["current"] = experiment.current[LEAD_SAMPLES:] + noise
    units = {"displacement": "m", "force": "N", "temperature": "degC", "current": "A"}
    return Run(
        run_id=run_id,
        created="2026-01-01T00:00:00+00:00",
        specimen=sensors.specimen,
        sample_rate_hz=RATE_HZ,
        period_samples=experiment.period_samples if experiment.periodic else 0,
        excitation_kind=experiment.kind,
        status="complete",
        channels=channels,
        units={name: units[name] for name in channels},
    )
