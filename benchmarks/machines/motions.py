"""Motions as test benches make them: sines, ramps, stepped sines, random roads, with rest before and after.

The displacement is a sum of cosines under an envelope that fades in and out, so that speed and acceleration are exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len

from benchmarks.machines.simulation import Motion

Row = NDArray[np.float64]

STYLES = ("sines", "ramps", "road", "mixed")
RATES_HZ = (50.0, 100.0, 128.0, 200.0, 250.0, 300.0, 400.0, 500.0)
LEAD_S = 0.5  # motion before a record that begins in the middle of it
LEAST_STEPS_HZ = 4000.0  # fine steps per second, at least
RAMP_HARMONICS = 9  # odd ones of a ramp that an actuator follows
MOST_FORCE_CYCLES = 400  # of a force on an oscillator


@dataclass(frozen=True, slots=True, kw_only=True)
class Envelope:
    """What a machine of this kind is tested at."""

    stroke_m: float  # peak; N for a machine that a force drives
    speed_m_s: float  # peak; N/s for a machine that a force drives
    low_hz: float
    high_hz: float
    current_a: tuple[float, float] | None = None
    driven: bool = False  # by a force


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """One run: lines of the displacement, when it moves, where it is centred, its current and temperature."""

    kind: str
    frequency_hz: Row  # (K,)
    amplitude_m: Row  # (K,)
    phase: Row  # (K,)
    seconds: float
    rest_s: float  # before and after the motion; 0: the record begins and ends in motion
    fade_s: float
    centre_m: float
    current_a: Row  # (levels,): held one after the other, each for an equal share of the run
    warm_c: float  # at the beginning
    warming_c: float  # until the end

    @property
    def peak_m(self) -> float:
        """The largest displacement that its lines can add up to."""
        return float(np.sum(np.abs(self.amplitude_m)))

    @property
    def peak_m_s(self) -> float:
        """The largest speed that its lines can add up to."""
        return float(np.sum(np.abs(self.amplitude_m) * 2.0 * np.pi * self.frequency_hz))


def rate_for(rng: np.random.Generator, envelope: Envelope, least_hz: float = 0.0) -> float:
    """One of the usual rates that sees the fastest motion with at least eleven samples a cycle."""
    fit = [r for r in RATES_HZ if r >= max(11.0 * envelope.high_hz, least_hz)] or [RATES_HZ[-1]]
    return float(fit[int(rng.integers(min(len(fit), 4)))])


def plans_of(rng: np.random.Generator, envelope: Envelope, style: str, count: int) -> list[Plan]:
    """`count` runs of a style; the currents and the temperatures differ between them."""
    resting, centre = rng.random() < 0.6, envelope.stroke_m * rng.uniform(-0.25, 0.25) * (rng.random() < 0.4)
    held = rng.random() < 0.5 or style in ("sines", "ramps")
    warm = rng.uniform(18.0, 30.0)
    plans = []
    for number in range(count):
        kind = style if style != "mixed" else ("sines", "ramps", "road", "sweep")[int(rng.integers(4))]
        plan = _plan(rng, envelope, kind, number, count)
        plan = replace(
            plan,
            rest_s=rng.uniform(0.3, 1.5) if resting else 0.0,
            centre_m=0.0 if envelope.driven else centre,
            current_a=_currents(rng, envelope, plan.seconds, held=held, place=(number, count)),
            warm_c=warm + rng.uniform(-2.0, 4.0),
            warming_c=rng.uniform(0.0, 3.0),
        )
        plans.append(plan)
    return plans


def _plan(rng: np.random.Generator, envelope: Envelope, kind: str, number: int, count: int) -> Plan:
    if kind == "road":
        return _road(rng, envelope)
    if kind == "sweep":
        return _steps(rng, envelope)
    return _sine(rng, envelope, number, count, ramp=kind == "ramps")


def _sine(rng: np.random.Generator, envelope: Envelope, number: int, count: int, *, ramp: bool) -> Plan:
    """A sine or a ramp; over the runs the peak speed goes from a tenth to all of what the envelope has."""
    share = 1.0 if count == 1 else 0.1 ** (1.0 - number / (count - 1)) * rng.uniform(0.85, 1.0)
    top = envelope.high_hz * (0.3 if ramp else 1.0)
    speed = envelope.speed_m_s * (0.6 if ramp else 1.0) * share
    stroke = envelope.stroke_m * rng.uniform(0.35, 0.9)
    frequency = float(np.clip(speed / (2.0 * np.pi * stroke), envelope.low_hz, top))
    stroke = min(stroke, speed / (2.0 * np.pi * frequency))
    order = np.arange(1, 2 * RAMP_HARMONICS, 2) if ramp else np.array([1])
    weight = np.sinc(order / (2.0 * RAMP_HARMONICS + 2.0)) * (-1.0) ** ((order - 1) // 2) / order**2
    seconds = float(np.clip(rng.uniform(5.0, 14.0) / frequency, 3.0, 24.0))
    return _blank(
        "triangle" if ramp else "sine", order * frequency, stroke * weight / np.sum(np.abs(weight)),
        np.pi / 2.0 * np.ones(order.size), seconds, 1.0 / frequency,
    )  # fmt: skip


def _road(rng: np.random.Generator, envelope: Envelope) -> Plan:
    """Random phases; amplitudes fall with frequency. Its lines repeat long after the record has ended."""
    seconds = rng.uniform(8.0, 20.0)
    step = 1.0 / (1.37 * seconds)
    frequency = np.arange(max(int(envelope.low_hz / step), 1), int(envelope.high_hz / step) + 1) * step
    weight = frequency ** -rng.uniform(1.1, 1.9) * rng.rayleigh(1.0, frequency.size)
    phase = rng.uniform(0.0, 2.0 * np.pi, frequency.size)
    t = np.arange(0.0, seconds, 0.1 / envelope.high_hz)
    angle = 2.0 * np.pi * np.outer(frequency, t) + phase[:, None]
    x, v = weight @ np.cos(angle), (weight * 2.0 * np.pi * frequency) @ np.sin(angle)
    size = min(envelope.stroke_m / np.max(np.abs(x)), envelope.speed_m_s / np.max(np.abs(v)))
    return _blank("road", frequency, size * weight * rng.uniform(0.8, 1.0), phase, seconds, 0.5 / envelope.low_hz)


def _steps(rng: np.random.Generator, envelope: Envelope) -> Plan:
    """Three sines at once, as a bench plays where it wants several speeds in one run."""
    frequency = np.exp(rng.uniform(np.log(envelope.low_hz), np.log(envelope.high_hz), 3))
    weight = 1.0 / frequency
    size = 0.9 * min(envelope.stroke_m / np.sum(weight), envelope.speed_m_s / np.sum(weight * 2.0 * np.pi * frequency))
    seconds = float(np.clip(12.0 / frequency.min(), 5.0, 20.0))
    return _blank("custom", frequency, size * weight, rng.uniform(0.0, 6.28, 3), seconds, 0.5 / envelope.low_hz)


def _blank(kind: str, frequency: Row, amplitude: Row, phase: Row, seconds: float, fade_s: float) -> Plan:
    return Plan(
        kind=kind, frequency_hz=frequency, amplitude_m=amplitude, phase=phase, seconds=seconds, rest_s=0.0,
        fade_s=min(fade_s, 0.2 * seconds), centre_m=0.0, current_a=np.zeros(1), warm_c=25.0, warming_c=0.0,
    )  # fmt: skip


def _currents(
    rng: np.random.Generator, envelope: Envelope, seconds: float, *, held: bool, place: tuple[int, int]
) -> Row:
    """One level for the run, spread over the runs, or a random step every 0.3 to 1 s."""
    if envelope.current_a is None:
        return np.zeros(1)
    low, high = envelope.current_a
    if held:
        levels = np.linspace(low, high, min(max(place[1], 2), 4))
        return np.array([levels[int(rng.integers(levels.size)) if place[1] == 1 else place[0] % levels.size]])
    return np.asarray(rng.uniform(low, high, max(int(seconds / rng.uniform(0.3, 1.0)), 4)))


def steps_for(rate_hz: float) -> int:
    """Fine steps a sample."""
    return max(4, int(np.ceil(LEAST_STEPS_HZ / rate_hz)))


def moved_by(plan: Plan, rate_hz: float, fine: int) -> Motion:
    """Displacement, speed and acceleration on the fine grid, with the lead of a record that begins in motion."""
    lead = 0 if plan.rest_s > 0.0 else int(LEAD_S * rate_hz)
    samples = lead + int((plan.seconds + 2.0 * plan.rest_s) * rate_hz)
    t = (np.arange(samples * fine) / fine - lead) / rate_hz
    g, g1, g2 = _envelope(plan, t)
    s, s1, s2 = _lines(plan, t)
    along = np.arange(samples) / samples
    level = np.minimum((along * plan.current_a.size).astype(int), plan.current_a.size - 1)
    return Motion(
        x=plan.centre_m + g * s, v=g1 * s + g * s1, a=g2 * s + 2.0 * g1 * s1 + g * s2,
        current=plan.current_a[level], temperature=plan.warm_c + plan.warming_c * along, fine=fine, rate_hz=rate_hz,
        lead=lead,
    )  # fmt: skip


def _envelope(plan: Plan, t: Row) -> tuple[Row, Row, Row]:
    """0 at rest, 1 in motion, a polynomial with three continuous derivatives between; and its derivatives."""
    if plan.rest_s == 0.0:
        return np.ones(t.size), np.zeros(t.size), np.zeros(t.size)
    begin, end = plan.rest_s, plan.rest_s + plan.seconds
    r = np.clip(np.minimum(t - begin, end - t) / plan.fade_s, 0.0, 1.0)
    side = np.where(t < 0.5 * (begin + end), 1.0, -1.0) / plan.fade_s
    g = r**4 * (35.0 - 84.0 * r + 70.0 * r**2 - 20.0 * r**3)
    g1 = 140.0 * r**3 * (1.0 - r) ** 3 * side
    g2 = 420.0 * r**2 * (1.0 - r) ** 2 * (1.0 - 2.0 * r) * side**2
    return g, g1, g2


def _lines(plan: Plan, t: Row) -> tuple[Row, Row, Row]:
    if plan.frequency_hz.size <= 2 * RAMP_HARMONICS:
        return _few_lines(plan, t)
    return _many_lines(plan, t)


def _few_lines(plan: Plan, t: Row) -> tuple[Row, Row, Row]:
    s, s1, s2 = np.zeros(t.size), np.zeros(t.size), np.zeros(t.size)
    for frequency, amplitude, phase in zip(plan.frequency_hz, plan.amplitude_m, plan.phase, strict=True):
        omega = 2.0 * np.pi * frequency
        cosine, sine = np.cos(omega * t + phase), np.sin(omega * t + phase)
        s, s1, s2 = s + amplitude * cosine, s1 - amplitude * omega * sine, s2 - amplitude * omega**2 * cosine
    return s, s1, s2


def _many_lines(plan: Plan, t: Row) -> tuple[Row, Row, Row]:
    """Lines that are harmonics of their spacing, by a Fourier transform."""
    step = float(plan.frequency_hz[1] - plan.frequency_hz[0])
    harmonic = np.rint(plan.frequency_hz / step).astype(int)
    dt = float(t[1] - t[0])
    size = next_fast_len(int(np.ceil(1.0 / (step * dt))), real=True)
    # The period is made a whole number of fine steps: the lines move by less than one part in the size.
    omega = 2.0 * np.pi * harmonic / (size * dt)
    at = np.rint(t / dt).astype(np.int64) % size
    rows = []
    for order in range(3):
        spectrum = np.zeros(size // 2 + 1, dtype=np.complex128)
        spectrum[harmonic] = plan.amplitude_m * np.exp(1j * plan.phase) * (1j * omega) ** order * size / 2.0
        rows.append(irfft(spectrum, n=size)[at])
    return rows[0], rows[1], rows[2]
