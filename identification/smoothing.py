"""Motion from a displacement that does not repeat: what stands above its noise, differentiated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.derivatives import Kinematics, draw, rounding_of
from identification.noise import below_filter, step_of

Floats = NDArray[np.float64]

_WIDEST = 0.85  # of the Nyquist frequency: above it the transition of the filter would not fit
_LEAST_NEIGHBOURS = 31  # lines whose quartile is a floor: known to a fifth
_QUARTILE = 0.2877  # lower quartile of an exponential, of its mean: ln(4/3)
_BETWEEN_LINES = 0.02  # of the velocity's power: where more lies between lines, a motion is not of lines
_HIDDEN = 10.0  # times the noise: side lobes, more than chance
_DEEP = 20.0  # of Kaiser's window: its side lobes, 155 dB below a line, hide no noise; Hann's lines are narrower
_COLOURED = 3.0  # times white noise: a quartile of 31 lines of it is higher once in a million
_LINE_POWER = 25.0  # times the floor, mean of three lines: by chance one line in 10¹⁵
_SKIRT_POWER = 4.0  # beside a line: what is lower is as much noise as motion
_LOWEST = 2  # lines that are always kept: the mean travel is no noise
_BLURRED = 2.0  # times its variance between lines: rounding that noise makes white
_END_ANGLE = 2.0  # rad of the motion: there a parabola of fourth degree knows the curvature of its end to 7 %
_SHORTEST_END = 8  # samples
_BENDING = 3.0  # times that stretch the bending reaches
_CURVED = 4.0  # times its variance: a curvature of an end that is known


def smooth_kinematics(x: Floats, sample_rate_hz: float) -> Kinematics:
    """Motion from a record without a period: what stands above the noise of the displacement, differentiated.

    A motion whose spectrum is of lines (a sine, a triangle: between its lines there is nothing but noise) keeps the
    lines that stand above what lies between them, however that noise is coloured. Any other motion keeps all up to
    where its spectrum falls to that of its noise. `noise` is what is let through of the noise; within some samples of
    its ends a motion is known less well than that.

    Parameters
    ----------
    x : (N,) float64, m
    """
    roughs = [(_differentiated(x, _straight(x), noise), noise) for noise in _noises_of(x)]
    rough, noise = min(roughs, key=lambda one: float(np.std(one[0].noise[1])))
    stretch = int(min(_END_ANGLE * float(np.std(rough.x)) / max(float(np.std(rough.v)), 1e-300), x.size / 4))
    over_samples = _differentiated(x, _bent(x, stretch), noise) if stretch >= _SHORTEST_END else rough
    return _per_second(over_samples, sample_rate_hz)


def _differentiated(x: Floats, trend: tuple[Floats, Floats, Floats], noise: _Noise) -> Kinematics:
    """A `trend` with its two derivatives, over samples, and what stands above the noise of the rest."""
    n = x.size
    rest = x - trend[0]
    spectrum = np.fft.rfft(np.concatenate([rest, -rest[-2:0:-1]]))  # odd about both ends: no step, no corner
    freq: Floats = np.fft.rfftfreq(2 * n - 2).astype(np.float64)
    power = np.abs(spectrum) ** 2 / (2 * n - 2)
    floor = np.interp(freq, np.linspace(0.0, 0.5, noise.power.size), noise.power)
    gain = _lines_above(power, floor, noise.least) if noise.between_lines else _low_pass(power, freq, float(floor[0]))

    def derivative(signal: NDArray[np.complex128], k: int) -> Floats:
        return np.fft.irfft(gain * signal * (2j * np.pi * freq) ** k, 2 * n - 2)[:n]

    drawn = draw(floor * (2 * n - 2))
    dx, dv, da = (derivative(drawn, k)[None, :] for k in range(3))
    x, v, a = (derivative(spectrum, k) + trend[k] for k in range(3))
    return Kinematics(x, v, a, float(freq[np.flatnonzero(gain > 0.5)[-1]]), (dx, dv, da))


def _per_second(motion: Kinematics, rate: float) -> Kinematics:
    """A motion over samples as one over seconds."""
    dx, dv, da = motion.noise
    noise = (dx, dv * rate, da * rate**2)
    return Kinematics(motion.x, motion.v * rate, motion.a * rate**2, motion.bandwidth_hz * rate, noise)


def _straight(x: Floats) -> tuple[Floats, Floats, Floats]:
    """The line between the ends of a signal, and its two derivatives over samples."""
    slope = np.full(x.size, (x[-1] - x[0]) / (x.size - 1))
    return np.linspace(x[0], x[-1], x.size, dtype=np.float64), slope, np.zeros(x.size)


def _bent(x: Floats, stretch: int) -> tuple[Floats, Floats, Floats]:
    """The line with the values of a signal at its ends, bent near these as its first and last `stretch` samples are.

    What is left has neither value nor curvature at its ends: continued oddly it is smooth to its third derivative, so
    that its spectrum falls with the fifth power of frequency and little is lost with the lines below the noise.
    """
    n = x.size
    bend, bend_at_end = _curvature(x[:stretch]), _curvature(x[: -stretch - 1 : -1])
    line, bump = _straight(x), _bump(n, min(_BENDING * stretch, n / 9.0))
    signs = (1.0, -1.0, 1.0)
    value, slope, curvature = (bend * g + bend_at_end * sign * g[::-1] for g, sign in zip(bump, signs, strict=True))
    return line[0] + value, line[1] + slope, curvature


def _bump(samples: int, scale: float) -> tuple[Floats, Floats, Floats]:
    """½t²·exp(−½t²/s²) and its two derivatives: a unit of curvature at the first sample that ends after `scale`."""
    t = np.arange(samples, dtype=np.float64)
    u = (t / scale) ** 2
    fall = np.exp(-0.5 * u)
    return 0.5 * t**2 * fall, t * (1.0 - 0.5 * u) * fall, (1.0 - 2.5 * u + 0.5 * u**2) * fall


def _curvature(x: Floats) -> float:
    """Curvature over samples at the first of some samples; within its noise it counts little."""
    basis = np.vander(np.linspace(0.0, 1.0, x.size), 5, increasing=True)
    spread = np.linalg.inv(basis.T @ basis)
    found = spread @ (basis.T @ x)
    variance = float(np.sum((x - basis @ found) ** 2)) / (x.size - 5) * float(spread[2, 2])
    known = max(0.0, 1.0 - _CURVED * variance / max(float(found[2]) ** 2, 1e-300))
    return 2.0 * known * float(found[2]) / (x.size - 1) ** 2


@dataclass(frozen=True, slots=True)
class _Noise:
    """Power of the noise of a displacement up to half the sample rate, m², and what a line must have to be none."""

    power: Floats
    between_lines: bool  # whether the motion is of lines
    least: float = 0.0  # power of a line: what is lower may be rounding


def _noises_of(x: Floats) -> list[_Noise]:
    """The noise of a displacement as its high frequencies show it and, of a motion of lines, as it is between these.

    Between lines the lower quartile of the power is that of the noise, which is exponential there: 0.288 of its mean.
    Of any other motion that quartile holds much of its velocity.
    Rounding that noise does not blur makes lines of a simple motion, each of less power than all of the rounding.
    """
    from scipy.ndimage import percentile_filter  # 0.2 s to import: only where a record does not repeat

    power, deep = _power(x, np.hanning(x.size)), _power(x, np.kaiser(x.size, _DEEP))
    rounding = max(step_of(x) ** 2 / 12.0, rounding_of(x))
    white = max(float(np.median(below_filter(power))) / np.log(2.0), rounding)
    width = max(_LEAST_NEIGHBOURS, power.size // 100 | 1)
    sharp, low = (percentile_filter(p, 25, size=w, mode="mirror") for p, w in ((power, width), (deep, 3 * width)))
    between = np.where(_HIDDEN * low < sharp, low, sharp) / _QUARTILE
    least = rounding * x.size / 6.0 if float(np.median(between)) < _BLURRED * rounding else 0.0
    between = np.maximum(between, rounding)
    shown = _lines_above(power, between, least)
    speed = power * np.arange(power.size, dtype=np.float64) ** 2
    lost = float(np.sum(np.where(between > _COLOURED * white, (1.0 - shown) * speed, 0.0)))
    above = [_Noise(np.full(power.size, white), between_lines=False)]
    if lost > _BETWEEN_LINES * float(np.sum(shown * speed)):
        return above
    return [*above, _Noise(between, between_lines=True, least=least)]


def _power(x: Floats, window: Floats) -> Floats:
    """Power of a windowed signal for each of its frequencies, in its unit squared: white noise has its variance."""
    return np.asarray(np.abs(np.fft.rfft((x - x.mean()) * window)) ** 2 / float(window @ window), dtype=np.float64)


def _lines_above(power: Floats, floor: Floats, least: float) -> Floats:
    """1 at the lines that stand far above the floor and at their skirts, 0 elsewhere."""
    from scipy.ndimage import (
        binary_dilation,
        binary_propagation,
    )  # 0.2 s to import: only where a record does not repeat

    level = np.convolve(np.pad(power, 1, mode="edge"), np.full(3, 1.0 / 3.0), "valid")
    peaks = level > np.maximum(_LINE_POWER * floor, least)
    shown = binary_propagation(peaks, mask=level > _SKIRT_POWER * floor)
    shown[: _LOWEST + 1] = True
    return np.asarray(binary_dilation(shown), dtype=np.float64)


def _low_pass(power: Floats, freq: Floats, floor: float) -> Floats:
    """1 up to the edge of a band, from there a raised cosine to 0 at one and a half times that.

    At the edge the velocity that is cut off and the noise that is let through are least together: the sum over what is
    kept of (P − 2N)·f² is highest, with the power P and the noise N of each line.
    """
    speed = (power - 2.0 * floor) * freq**2
    edge = float(np.clip(freq[int(np.argmax(np.cumsum(speed)))], 4.0 * freq[1], _WIDEST * freq[-1]))
    roll = np.clip((freq - edge) / min(0.5 * edge, freq[-1] - edge), 0.0, 1.0)
    gain: Floats = 0.5 * (1.0 + np.cos(np.pi * roll))
    return gain
