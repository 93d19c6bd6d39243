"""The noise floor of a force, from what does not repeat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from excitation.sliding import running_median

Floats = NDArray[np.float64]

_TONE_RATIO = 25.0  # a bin this far above the median of its neighbours is a tone: by chance 3e-8 of bins are
_TONE_NEIGHBOURS = 101
_BANDS = 32  # at most, of equal width, up to half the sample rate
_LEAST_LINES = 8  # in a band
_LEAST_CYCLES = 10.0  # fewer leave too little between their harmonics
_LOBE = 3.0  # lines on either side of a harmonic that Hann's window spreads it over
_LINE_MEDIANS = 6.0  # times the median: what is higher is a line; 1.6 % of noise is
_KEPT = 0.934  # mean of the rest of an exponential over its whole mean: 1 − t/(eᵗ − 1), t = 6·ln 2
_ALIKE = 4.0  # variance of the median of lines of noise through Hann's window, over its square, times their number
_APART = 3.0  # standard deviations of such a median: a band that is higher holds more than noise
_MOST_APART = 0.25
_TAPS = 5.0  # of a Blackman filter, times the width of its band over half the sample rate: it stops what is below
_LEAST_LENGTHS = 4.0  # of that filter in a record, for a median over time
_CHI2_MEDIAN = 0.4549  # median of the square of a normal deviate
_FILTERED = 1.6  # from one band to the next: what a motion makes falls by f⁻⁴ at most, 1.14 there; a filter by more
_DIGITS = 1e-12  # of the highest value: steps of the numbers themselves
_WHOLE = 0.02  # of a step


def between_periods(periods: Floats) -> tuple[float, list[float]]:
    """Noise of a periodic force from the differences between its periods, without drift and without foreign tones.

    Parameters
    ----------
    periods : (P, N) float64, N, P ≥ 2

    Returns
    -------
    sigma : standard deviation, N
    tones : frequencies in cycles per sample of lines that are no noise and not of the period (mains hum)
    """
    count = periods.shape[0]
    rest = _without_slow_change(periods).ravel()
    power = np.abs(np.fft.rfft(rest)) ** 2
    power[0] = 0.0
    comb = np.arange(power.size) % count == 0  # the lines of the period itself: removed with the mean
    local = np.where(comb, np.nan, power)
    level = _running_median(local)
    tone = ~comb & (power > _TONE_RATIO * level)
    tone |= ~comb & (np.roll(tone, 1) | np.roll(tone, -1)) & (power > 8.0 * level)
    quiet = ~comb & ~tone
    variance = float(np.mean(power[quiet])) / rest.size if np.any(quiet) else 0.0
    frequencies = np.arange(power.size) / rest.size
    peaks = [float(frequencies[k]) for k in np.flatnonzero(tone) if power[k] == power[max(k - 2, 0) : k + 3].max()]
    return float(np.sqrt(variance)), peaks


def per_line(periods: Floats) -> Floats:
    """Standard deviation of the amplitude that each line of a channel shows in one period, (N // 2 + 1,), its unit.

    From the P − 1 independent differences of P ≥ 2 periods (P, N) from their mean: white noise of standard deviation σ
    is σ·√(2/N) on every line but the first and, of an even N, the last (Pintelon & Schoukens, 2012).
    """
    spectra = np.fft.rfft(periods, axis=1)
    stray = spectra - spectra.mean(axis=0)
    variance = np.sum(np.abs(stray) ** 2, axis=0) / (periods.shape[0] - 1)
    return np.asarray(np.sqrt(2.0 * variance) / periods.shape[1])


def _without_slow_change(periods: Floats) -> Floats:
    """Differences of each period from the mean one, less an offset, a slope and a gain of its own, (P, N).

    Drift of the load cell and warming of the damper change from period to period, but are not noise.
    """
    n = periods.shape[1]
    mean = periods.mean(axis=0)
    basis = np.linalg.qr(np.column_stack([np.ones(n), np.linspace(-1.0, 1.0, n), mean]))[0]
    rest = periods - mean
    out: Floats = rest - (rest @ basis) @ basis.T
    return out


def _running_median(power: Floats) -> Floats:
    valid = np.flatnonzero(np.isfinite(power))
    if valid.size == 0:
        return np.zeros_like(power)
    size = min(_TONE_NEIGHBOURS, 2 * (valid.size // 2) + 1)
    return np.interp(np.arange(power.size), valid, running_median(power[valid], size))


def from_cycles(force: Floats, displacement: Floats, sample_rate_hz: float) -> tuple[float, float] | None:
    """Noise of a force under a near-sinusoidal motion, N, and the share of its spectrum that tells it.

    What lies between the harmonics of the motion, up to half the sample rate: a friction has hundreds of them. None
    where the motion is not a steady sine or is too short.
    """
    f0 = _fundamental(displacement, sample_rate_hz)
    cycles = 0.0 if f0 is None else force.size * f0 / sample_rate_hz
    if cycles < _LEAST_CYCLES:
        return None
    window = np.hanning(force.size)
    power = np.abs(np.fft.rfft((force - force.mean()) * window)) ** 2 / float(window @ window)
    away = np.abs((np.arange(power.size) + 0.5 * cycles) % cycles - 0.5 * cycles) > _LOBE
    away[: int(cycles)] = away[-1] = False  # a drift is no noise
    noise = power[away]
    kept = noise[noise <= _LINE_MEDIANS * float(np.median(noise))]
    return float(np.sqrt(np.mean(kept) / _KEPT)), noise.size / power.size


def _fundamental(x: Floats, sample_rate_hz: float) -> float | None:
    """Frequency of a steady sine by least squares around its strongest line, Hz."""
    from scipy.optimize import minimize_scalar  # 0.3 s to import: only where a record does not repeat

    n = x.size
    centred = x - x.mean()
    power = np.abs(np.fft.rfft(centred * np.hanning(n))) ** 2
    k = int(np.argmax(power))
    if k < 2:
        return None
    t = np.arange(n) / sample_rate_hz

    def left(q: float) -> float:
        basis = _harmonics(t, q * sample_rate_hz / n, 3)
        return float(np.sum((centred - basis @ _solved(basis, centred)) ** 2) / np.sum(centred**2))

    best = minimize_scalar(left, bounds=(k - 0.7, k + 0.7), method="bounded", options={"xatol": 1e-5})
    return float(best.x) * sample_rate_hz / n if best.fun < 0.02 else None


def _solved(basis: Floats, signal: Floats) -> Floats:
    """Least squares of a signal on columns that are all but orthogonal."""
    return np.asarray(np.linalg.solve(basis.T @ basis, basis.T @ signal), dtype=np.float64)


def _harmonics(t: Floats, f0: float, count: int) -> Floats:
    turn = 2.0 * np.pi * f0 * t[:, None] * np.arange(1, count + 1)
    return np.concatenate([np.ones((t.size, 1)), np.cos(turn), np.sin(turn)], axis=1)


def high_frequency(signal: Floats) -> tuple[float, float]:
    """Noise of any record, in its own unit, and the share of its spectrum that tells it.

    White noise of the level at the highest frequencies that were let through, and at all lower ones down to where more
    than noise is seen. Lines far above it do not count. Impacts and reversals of friction reach these frequencies too,
    but only for some samples each: where the median over time is lower, that is the noise (Donoho and Johnstone 1994).
    Rounding to the steps of a converter is noise as well, of at least a twelfth of their square (Widrow 1956).
    """
    window = np.hanning(signal.size)
    power = np.abs(np.fft.rfft((signal - signal.mean()) * window)) ** 2 / float(window @ window)
    every = _bands(power)
    bands = every[: _let_through(every)]
    highest = len(bands) - max(len(bands) // 4, 1)
    top, level = highest, float(np.median(np.concatenate(bands[highest:])))
    apart = min(_APART * float(np.sqrt(_ALIKE / bands[0].size)), _MOST_APART)
    while top > 0 and float(np.median(bands[top - 1])) < (1.0 + apart) * level:
        top -= 1
    noise = np.concatenate(bands[top:])
    kept = noise[noise <= _LINE_MEDIANS * level]
    quiet = _between_events(signal, highest / len(every), len(bands) / len(every))
    spectral = float(np.sqrt(np.mean(kept) / _KEPT))
    return max(min(spectral, quiet), step_of(signal) / float(np.sqrt(12.0))), noise.size / power.size


def _between_events(signal: Floats, low: float, high: float) -> float:
    """White noise whose median square between two frequencies, shares of half the sample rate, is that of the signal.

    Infinite where the record is too short for a filter that separates them from lower ones.
    """
    taps = 2 * int(np.ceil(0.5 * _TAPS / (high - low))) + 1
    if signal.size < _LEAST_LENGTHS * taps:
        return float("inf")
    m = np.arange(taps) - taps // 2
    kernel = (high * np.sinc(high * m) - low * np.sinc(low * m)) * np.blackman(taps)  # a windowed band-pass
    passed = np.convolve(signal - signal.mean(), kernel, mode="valid")
    return float(np.sqrt(np.median(passed**2) / (_CHI2_MEDIAN * np.sum(kernel**2))))


def step_of(signal: Floats) -> float:
    """The step of a channel whose values are all whole multiples of it apart, in its unit; 0 where there is none."""
    apart = np.diff(np.unique(signal))
    step = float(np.min(apart, initial=np.inf))
    if not _DIGITS * float(np.max(np.abs(signal))) < step < np.inf:
        return 0.0
    return step if float(np.max(np.abs(apart / step - np.rint(apart / step)))) < _WHOLE else 0.0


def below_filter(power: Floats) -> Floats:
    """The highest quarter of a spectrum below the edge of the filter that its recorder had."""
    every = _bands(power)
    bands = every[: _let_through(every)]
    return np.concatenate(bands[-max(len(bands) // 4, 1) :])


def _bands(power: Floats) -> list[Floats]:
    """A spectrum in bands of equal width."""
    return np.array_split(power[1:-1], max(min(_BANDS, power.size // _LEAST_LINES), 1))


def _let_through(bands: list[Floats]) -> int:
    """How many bands, from the lowest, are below the edge of the filter that the recorder had.

    Where a spectrum falls steeply towards half the sample rate, a filter before the sampling has taken the noise away.
    """
    level = [float(np.median(band)) for band in bands]
    last = len(bands)
    while last > len(bands) // 2 + 1 and level[last - 2] > _FILTERED * level[last - 1]:
        last -= 1
    return last
