"""The experiment on the rig: displacement as a finite Fourier series, current held, temperature slow."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind

Row = NDArray[np.float64]

RATE_HZ = 1000.0
LEAD_SAMPLES = 500  # motion before the record begins


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """The motion of one run: `lines[k]` is the complex amplitude of harmonic k of the displacement, m."""

    kind: Kind
    lines: NDArray[np.complex128]
    period_samples: int
    samples: int
    periodic: bool  # as a whole, the current too
    current: Row  # (LEAD_SAMPLES + samples,), A; empty for a passive machine
    temperature: Row  # (LEAD_SAMPLES + samples,), °C


def fine_motion(experiment: Experiment, fine: int, start: int, samples: int) -> tuple[Row, Row, Row]:
    """Displacement, speed, acceleration at `fine` instants a sample, including the lead; exact derivatives."""
    size = experiment.period_samples * fine
    omega = 2j * np.pi * np.arange(experiment.lines.size) * RATE_HZ / experiment.period_samples
    at = np.arange((start - LEAD_SAMPLES) * fine, (start + samples) * fine) % size
    x, v, a = (np.fft.irfft(_padded(experiment.lines * omega**order, size), n=size)[at] for order in range(3))
    return x, v, a


def _padded(lines: NDArray[np.complex128], size: int) -> NDArray[np.complex128]:
    spectrum = np.zeros(size // 2 + 1, dtype=np.complex128)
    spectrum[: lines.size] = lines * size / 2.0
    return spectrum


def scaled(
    lines: NDArray[np.complex128], period_samples: int, stroke_m: float, speed_m_s: float
) -> NDArray[np.complex128]:
    """Lines scaled until the displacement or the speed reaches its limit."""
    omega = 2j * np.pi * np.arange(lines.size) * RATE_HZ / period_samples
    x = np.fft.irfft(_padded(lines, period_samples), n=period_samples)
    v = np.fft.irfft(_padded(lines * omega, period_samples), n=period_samples)
    return lines * min(stroke_m / np.max(np.abs(x)), speed_m_s / np.max(np.abs(v)))


def multisine_lines(
    rng: np.random.Generator, period_samples: int, low_hz: float, high_hz: float, slope: float
) -> NDArray[np.complex128]:
    """Random phases on every line of the band, amplitudes falling with frequency to the power `slope`."""
    bins = _band(period_samples, low_hz, high_hz)
    lines = np.zeros(bins[-1] + 1, dtype=np.complex128)
    lines[bins] = bins ** (-slope) * np.exp(2j * np.pi * rng.uniform(size=bins.size))
    return lines


def _band(period_samples: int, low_hz: float, high_hz: float) -> NDArray[np.int64]:
    first = max(1, int(np.ceil(low_hz * period_samples / RATE_HZ)))
    last = max(first + 6, int(high_hz * period_samples / RATE_HZ))
    return np.arange(first, last + 1)


def sine_lines(rng: np.random.Generator) -> NDArray[np.complex128]:
    return np.array([0.0, np.exp(2j * np.pi * rng.uniform())])


def triangle_lines(rng: np.random.Generator, corner_harmonic: int) -> NDArray[np.complex128]:
    """A triangle with rounded corners: Lanczos' factors up to `corner_harmonic`."""
    k = np.arange(corner_harmonic + 1)
    odd = k % 2 == 1
    amplitude = np.where(odd, np.sinc(k / (corner_harmonic + 1.0)) / np.maximum(k, 1) ** 2, 0.0)
    return amplitude * np.exp(2j * np.pi * k * rng.uniform())


def multisine_current(rng: np.random.Generator, period_samples: int, samples: int, low: float, high: float) -> Row:
    """A periodic random-phase current that spans [low, high], flat to 10 Hz and falling to 40 Hz; held a sample."""
    bins = _band(period_samples, RATE_HZ / period_samples, rng.uniform(15.0, 40.0))
    weight = 1.0 / np.sqrt(1.0 + (bins * RATE_HZ / period_samples / 10.0) ** 2)
    spectrum = np.zeros(period_samples // 2 + 1, dtype=np.complex128)
    spectrum[bins] = weight * np.exp(2j * np.pi * rng.uniform(size=bins.size))
    wave = np.fft.irfft(spectrum, n=period_samples)
    wave = low + (high - low) * (wave - wave.min()) / np.ptp(wave)
    return wave[np.arange(-LEAD_SAMPLES, samples) % period_samples]


def stepped_current(rng: np.random.Generator, samples: int, low: float, high: float) -> Row:
    """Levels held 0.3 to 1.6 s each, consecutive ones clearly different."""
    row = np.empty(LEAD_SAMPLES + samples)
    at, level = 0, rng.uniform(low, high)
    while at < row.size:
        end = at + (LEAD_SAMPLES if at == 0 else 0) + int(rng.integers(300, 1600))
        row[at:end] = level
        at, before = end, level
        while abs(level - before) < 0.2 * (high - low):
            level = rng.uniform(low, high)
    return row


def drifting_temperature(rng: np.random.Generator, samples: int, start_c: float) -> Row:
    """Warming or cooling by up to a kelvin and a half over the run, plus a slow wave."""
    share = np.arange(-LEAD_SAMPLES, samples) / samples
    wave = rng.uniform(0.0, 0.15) * np.sin(2 * np.pi * (rng.uniform(0.5, 1.5) * share + rng.uniform()))
    return start_c + rng.uniform(-0.5, 1.5) * share + wave


@dataclass(frozen=True, slots=True, kw_only=True)
class Envelope:
    """Limits of the tests of a machine."""

    stroke_m: float
    speed_m_s: float
    current_a: tuple[float, float] | None  # None: passive

    @property
    def corner_hz(self) -> float:
        """Frequency at which a sine of full stroke has full speed."""
        return self.speed_m_s / (2 * np.pi * self.stroke_m)


def campaign(rng: np.random.Generator, envelope: Envelope) -> tuple[list[Experiment], list[Experiment]]:
    """Six training experiments and two held-out ones, of the same kinds with other motions."""
    training = [
        _multisine(rng, envelope, level=rng.uniform(0.25, 0.5), reach=rng.uniform(2.0, 5.0), wave=True),
        _multisine(rng, envelope, level=rng.uniform(0.9, 1.0), reach=rng.uniform(1.5, 4.0), wave=True),
        _multisine(rng, envelope, level=rng.uniform(0.5, 0.85), reach=rng.uniform(0.7, 1.5), wave=rng.random() < 0.5),
        _sine(rng, envelope, level=rng.uniform(0.6, 1.0), wave=False),
        _triangle(rng, envelope)
        if rng.random() < 0.8
        else _sine(rng, envelope, level=rng.uniform(0.1, 0.3), wave=False),
        _stepped(rng, envelope)
        if envelope.current_a
        else _sine(rng, envelope, level=rng.uniform(0.2, 0.6), wave=False),
    ]
    if envelope.current_a and rng.random() < 0.5:
        training[3] = _stepped(rng, envelope)
    held_out = [
        _multisine(rng, envelope, level=rng.uniform(0.7, 0.97), reach=rng.uniform(1.2, 4.0), wave=True),
        _sine(rng, envelope, level=rng.uniform(0.5, 0.95), wave=rng.random() < 0.5)
        if rng.random() < 0.5 or not envelope.current_a
        else _stepped(rng, envelope),
    ]
    return _warmed(rng, training), _warmed(rng, held_out)


def sines(rng: np.random.Generator, envelope: Envelope, count: int) -> list[Experiment]:
    """Sines of different level and frequency, current held, as in a conventional test programme."""
    return _warmed(rng, [_sine(rng, envelope, level=rng.uniform(0.15, 1.0), wave=False) for _ in range(count)])


def extra_run(rng: np.random.Generator, envelope: Envelope) -> Experiment:
    """A multisine or sine in addition to the campaign."""
    if rng.random() < 0.5:
        one = _multisine(rng, envelope, level=rng.uniform(0.3, 1.0), reach=rng.uniform(1.0, 5.0), wave=True)
    else:
        one = _sine(rng, envelope, level=rng.uniform(0.2, 1.0), wave=False)
    return replace(one, temperature=drifting_temperature(rng, one.samples, rng.uniform(15.0, 58.0)))


def _warmed(rng: np.random.Generator, experiments: list[Experiment]) -> list[Experiment]:
    """Body temperatures spread over 15 to 60 °C, one stratum for each run."""
    strata = rng.permutation(len(experiments))
    starts = 15.0 + 43.0 * (strata + rng.uniform(size=strata.size)) / strata.size
    return [
        replace(e, temperature=drifting_temperature(rng, e.samples, start))
        for e, start in zip(experiments, starts, strict=True)
    ]


def _whole_periods(rng: np.random.Generator, period_samples: int) -> int:
    fewest, most = -(-16_000 // period_samples), 20_000 // period_samples
    return period_samples * int(rng.integers(fewest, most + 1))


def _multisine(rng: np.random.Generator, envelope: Envelope, *, level: float, reach: float, wave: bool) -> Experiment:
    period = int(rng.choice([2000, 4000, 5000, 4096]))
    corner = envelope.corner_hz
    low, high = rng.uniform(0.1, 0.5) * corner, min(reach * corner, 35.0)
    lines = multisine_lines(rng, period, low, high, rng.uniform(0.5, 1.5))
    return _finish(rng, envelope, Kind.MULTISINE, lines, period, level, level, wave=wave)


def _sine(rng: np.random.Generator, envelope: Envelope, *, level: float, wave: bool) -> Experiment:
    wanted = envelope.corner_hz * np.exp(rng.uniform(np.log(0.4), np.log(3.0)))
    cycles = 1 if wanted < 1.0 else round(2.0 * wanted)
    period = round(cycles * RATE_HZ / wanted)
    lines = np.zeros(cycles + 1, dtype=np.complex128)
    lines[cycles] = sine_lines(rng)[1]
    return _finish(rng, envelope, Kind.SINE, lines, min(period, 4000), level, level, wave=wave)


def _triangle(rng: np.random.Generator, envelope: Envelope) -> Experiment:
    period = int(rng.choice([4000, 6000, 8000]))
    lines = triangle_lines(rng, int(rng.integers(25, 60)))
    return _finish(
        rng, envelope, Kind.TRIANGLE, lines, period, rng.uniform(0.6, 1.0), rng.uniform(0.1, 0.4), wave=False
    )


def _stepped(rng: np.random.Generator, envelope: Envelope) -> Experiment:
    """A sine or multisine in displacement while the current steps: not periodic as a whole."""
    level = rng.uniform(0.5, 0.9)
    moving = (
        _sine(rng, envelope, level=level, wave=False)
        if rng.random() < 0.5
        else _multisine(rng, envelope, level=level, reach=rng.uniform(1.0, 3.0), wave=False)
    )
    assert envelope.current_a is not None
    current = stepped_current(rng, moving.samples, *envelope.current_a)
    return replace(moving, kind=Kind.STEPS, periodic=False, current=current)


def _finish(
    rng: np.random.Generator,
    envelope: Envelope,
    kind: Kind,
    lines: NDArray[np.complex128],
    period: int,
    stroke_level: float,
    speed_level: float,
    *,
    wave: bool,
) -> Experiment:
    samples = _whole_periods(rng, period)
    lines = scaled(lines, period, stroke_level * envelope.stroke_m, speed_level * envelope.speed_m_s)
    current = np.empty(0)
    if envelope.current_a:
        low, high = envelope.current_a
        constant = np.full(LEAD_SAMPLES + samples, rng.uniform(low, high))
        current = multisine_current(rng, period, samples, low, high) if wave else constant
    return Experiment(
        kind=kind,
        lines=lines,
        period_samples=period,
        samples=samples,
        periodic=True,
        current=current,
        temperature=np.empty(0),
    )
