"""How large odd and even distortion are, with bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.approximation import Approximation, between
from excitation.analysis.criteria import CONFIDENCE, LINES_OF_A_SEGMENT, MOST_SEGMENTS, POOLED, SIGMAS
from excitation.analysis.pooled import pooled, segments
from excitation.analysis.seen_lines import SeenLines
from excitation.analysis.spectra import LineSpectra, noise_beside

__all__ = ["Detected", "Level", "Neighbours", "detected", "direct", "from_neighbours", "from_scatter", "together"]

Floats = NDArray[np.float64]
Lines = NDArray[np.int64]

_LOW, _HIGH = 0.5 * (1.0 - CONFIDENCE), 0.5 * (1.0 + CONFIDENCE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """A mean square of the force, N², with the bounds that hold it with the probability ``CONFIDENCE``.

    It may be negative where it is the small difference of two.
    """

    power: float
    low: float
    high: float

    @property
    def rms(self) -> float:
        """N."""
        return float(np.sqrt(max(self.power, 0.0)))

    @property
    def bounds(self) -> tuple[float, float]:
        """Of the rms, N."""
        return float(np.sqrt(max(self.low, 0.0))), float(np.sqrt(max(self.high, 0.0)))

    @property
    def is_seen(self) -> bool:
        """Whether it is above nothing."""
        return self.low > 0.0


def together(levels: Sequence[Level]) -> Level:
    """The sum of independent levels: distances to the bounds add as squares (Zou & Donner, 2008)."""
    power = sum(one.power for one in levels)
    down = sum((one.power - one.low) ** 2 for one in levels)
    up = sum((one.high - one.power) ** 2 for one in levels)
    return Level(power=power, low=power - float(np.sqrt(down)), high=power + float(np.sqrt(up)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Neighbours:
    """A level on driven lines as their neighbours show it."""

    level: Level
    per_line: Floats  # (K,), N²
    freedom: Floats  # (K,): complex degrees of freedom of that with the noise


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detected:
    """The force on lines that nothing drives, less what the rig's own motion there makes of it, (K,) each, N²."""

    lines: Lines
    power: Floats  # mean over the realisations, without the noise
    variance: Floats  # of that, by the noise
    noise: Floats  # of the mean period, mean over the realisations
    corrected: Floats  # mean square of what was taken off, without the noise of the inputs

    def of(self, lines: Lines) -> Detected:
        """Those of some lines."""
        keep = np.isin(self.lines, lines)
        return Detected(
            lines=self.lines[keep],
            power=self.power[keep],
            variance=self.variance[keep],
            noise=self.noise[keep],
            corrected=self.corrected[keep],
        )


def detected(
    spectra: Sequence[LineSpectra], approximation: Approximation, lines: SeenLines, *, over_rate: bool
) -> Detected:
    """Y − Σ G·U on the lines that no input drives, G from the neighbours, and the noise that is part of it.

    References
    ----------
    Pintelon & Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012: the first-order correction
    for an actuator that excites the detection lines itself.
    """
    at = np.sort(np.concatenate([lines.even, lines.odd, lines.mixed]))
    g = between(approximation, lines, at, over_rate=over_rate)
    count = len(spectra)
    power, noise, variance, corrected = (np.zeros(at.size) for _ in range(4))
    for one in spectra:
        own = np.sum(g * one.inputs[:, at], axis=0)
        nu = noise_beside(one, g, at) / one.periods
        found = np.abs(one.force[at] - own) ** 2
        free = max(one.freedom, 1.0)
        power += (found - nu) / count
        noise += nu / count
        by_noise = np.sum(np.abs(g) ** 2 * one.input_noise[:, at], axis=0) / one.periods
        corrected += (np.abs(own) ** 2 - by_noise) / count
        variance += (2.0 * np.maximum(found - nu, 0.0) * nu + nu**2 * (1.0 + 1.0 / free)) / count**2
    return Detected(lines=at, power=power, variance=variance, noise=noise, corrected=corrected)


def direct(found: Detected) -> Level:
    """The level on the detected lines themselves: they all are measured, only the noise makes it uncertain."""
    power, spread = float(np.sum(found.power)), SIGMAS * float(np.sqrt(np.sum(found.variance)))
    return Level(power=power, low=power - spread, high=power + spread)


def from_neighbours(found: Detected, driven: Lines, driven_noise: Floats, realisations: int) -> Neighbours:
    """The level on driven lines (K,) from detection lines among them; ``driven_noise`` (K,), N², is taken off.

    Distortion of a random-phase multisine is asymptotically circular normal on each line, of a variance that changes
    slowly with frequency (Pintelon & Schoukens, 2012): the mean power of M realisations is a gamma variable of shape M.
    Its logarithm is fitted as straight pieces over frequency, one for ``LINES_OF_A_SEGMENT`` detection lines, by
    maximum likelihood, its dispersion from what the fit leaves, at least that of the gamma variable. The power on the
    driven lines over that of the fit then follows an F distribution of their equivalent degrees of freedom
    (Satterthwaite, 1946).
    """
    from scipy.special import fdtri  # 0.2 s to import: only where lines between the driven ones tell distortion

    knots = _knots(found.lines)
    at, to = _pieces(found.lines, knots), _pieces(driven, knots)
    total = found.power + found.noise
    beta = _gamma_fit(at, np.maximum(total, _TINY * float(np.max(total, initial=0.0)) + np.finfo(np.float64).tiny))
    fitted = np.exp(to @ beta)
    apart = total * np.exp(-(at @ beta)) - 1.0
    dispersion = max(float(apart @ apart) * realisations / max(at.shape[0] - at.shape[1], 1), 1.0) / realisations
    spread = dispersion * np.linalg.pinv(at.T @ at)  # of beta
    per_line = fitted - driven_noise
    power, whole = float(np.sum(per_line)), float(np.sum(fitted))
    slope = to.T @ fitted
    below = whole**2 / float(slope @ spread @ slope)
    own = np.maximum(per_line, 0.0)
    above = whole**2 / max(dispersion * float(np.sum(own**2)), whole**2 * _TINY)
    low, high = (whole * float(fdtri(2.0 * above, 2.0 * below, q)) for q in (_LOW, _HIGH))
    level = Level(power=power, low=power - (whole - low), high=power + (high - whole))
    freedom = 1.0 / np.maximum(np.sum((to @ spread) * to, axis=1), _TINY)
    return Neighbours(level=level, per_line=per_line, freedom=freedom)


_TINY = 1e-12  # of a power: rounding


def _knots(lines: Lines) -> Floats:
    """Ends of the pieces: the middles of segments of detection lines, the outer ones at the ends."""
    middles = [float(np.mean(part)) for part in segments(lines, max(LINES_OF_A_SEGMENT, lines.size // MOST_SEGMENTS))]
    return np.array(middles if len(middles) == 1 else [float(lines[0]), *middles[1:-1], float(lines[-1])])


def _pieces(lines: Lines, knots: Floats) -> Floats:
    """Weights of the knots on each line, (K, number of knots): straight between two of them, constant beyond."""
    return np.column_stack([np.interp(lines, knots, unit) for unit in np.eye(knots.size)])


def _gamma_fit(design: Floats, power: Floats) -> Floats:
    """Maximum likelihood of log means of gamma variables by scoring, whose weights are all 1 for a log link."""
    inverse = np.linalg.pinv(design)
    beta = inverse @ np.full(power.size, np.log(np.mean(power)))
    for _ in range(_MOST_STEPS):
        step = inverse @ (power * np.exp(-(design @ beta)) - 1.0)
        size = float(np.max(np.abs(step)))
        beta = beta + step * min(1.0, _LONGEST / max(size, _LONGEST))
        if size < _CLOSE:
            break
    return np.asarray(beta, dtype=np.float64)


_MOST_STEPS = 100  # it takes 10 to 20
_LONGEST = 1.0  # change of a logarithm in one step
_CLOSE = 1e-6


def from_scatter(approximation: Approximation, noise: Floats, noise_freedom: float, realisations: int) -> Level:
    """The level on driven lines from what differs between M realisations, less the noise of their mean periods, (K,).

    The approximation takes up one of M shares of the distortion for each input: how much, differs from line to line as
    |normal|² does, and the bounds hold it.
    """
    from scipy.special import gammaincinv  # 0.2 s to import: only where there are several realisations

    known = np.isfinite(approximation.scatter)
    scatter, nu = approximation.scatter[known], noise[known]
    spare = approximation.spare
    inputs = realisations - spare
    power = float(np.sum(scatter - nu))
    if not np.any(scatter > 0.0):
        return Level(power=power, low=power, high=power)
    smooth = pooled(scatter, -(-POOLED // spare))
    lines = float(np.sum(smooth)) ** 2 / float(np.sum(smooth**2))
    taken = (float(gammaincinv(inputs * lines, q)) / lines for q in (_HIGH, _LOW))
    total = float(np.sum(scatter))
    high, low = (total * spare / (realisations - share) for share in taken)
    above = np.maximum(scatter - nu, 0.0)
    by_noise = np.sum((2.0 * above * nu + nu**2 * (1.0 + 1.0 / max(noise_freedom, 1.0))) / realisations)
    spread = SIGMAS * float(np.sqrt(by_noise))
    return together(
        [
            Level(power=power, low=power - (total - low), high=power + (high - total)),
            Level(power=0.0, low=-spread, high=spread),
        ]
    )
