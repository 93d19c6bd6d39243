"""What of an error repeats: noise of the records, drift of the specimen between rounds, and whether a round pays. Pure.

The error of a drive is a state that every round measures with noise, and that the specimen changes between rounds: a
Kalman filter for each line, whose process noise is what the rounds show beyond noise and response.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rigctl.response import Lines

__all__ = ["ErrorState", "History", "after_round", "first_round", "noise_above", "noise_of_periods"]

QUIET = 1.3  # times the bandwidth: above it a record holds noise, and what the rig adds
LEAST_LINES = 20  # above the bandwidth, for a noise floor within ±50 % (95 %)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ErrorState:
    """The error of one drive without the noise, line by line, relative channels."""

    error: NDArray[np.complex128]  # (K, C)
    variance: NDArray[np.float64]  # (K, C)


def first_round(lines: Lines, measured: NDArray[np.complex128], noise: NDArray[np.float64]) -> ErrorState:
    """State after the first round: before it, the error of a line is as large as those of its neighbours."""
    expected = np.maximum(lines.power(measured) - noise, 0.0)
    gain = expected / np.maximum(expected + noise, 1e-300)
    return ErrorState(error=gain * measured, variance=gain * noise)


def after_round(
    before: ErrorState,
    change: NDArray[np.complex128],
    measured: NDArray[np.complex128],
    noise: NDArray[np.float64],
    drifted: NDArray[np.float64],
) -> ErrorState:
    """State after a further round, whose step changed the channels by `change` and left the error `measured`.

    `drifted` is the process noise, the power by which the specimen changed beyond that.
    """
    predicted = before.error - change
    variance = before.variance + drifted
    gain = np.where(variance + noise > 0, variance / np.maximum(variance + noise, 1e-300), 1.0)
    return ErrorState(error=predicted + gain * (measured - predicted), variance=gain * noise)


def noise_of_periods(lines: Lines, periods: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Variance of the mean of periods, from their spectra (P, K, C), P ≥ 2; smoothed, (K, C)."""
    count = periods.shape[0]
    spread = periods - periods.mean(axis=0)
    power = sum(lines.power(one) for one in spread)
    return np.asarray(power / ((count - 1) * count), dtype=np.float64)


def noise_above(
    lines: Lines, spectra: NDArray[np.complex128], bandwidth_hz: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Noise floor, (K, C), of a record that repeats nothing: its power well above each channel's bandwidth.

    It holds the distortion there too, so it is rather too high. Zero where the bandwidth leaves no line for it.
    """
    noise = np.zeros(spectra.shape)
    for channel, limit in enumerate(bandwidth_hz):
        above = lines.frequency_hz > QUIET * limit
        if np.count_nonzero(above) * lines.independent >= LEAST_LINES:
            noise[:, channel] = np.mean(np.abs(spectra[above, channel]) ** 2)
    return noise


@dataclass(slots=True)
class History:
    """How much the rounds changed beyond what their steps explain, channel by channel."""

    noise: list[NDArray[np.float64]] = field(default_factory=list)  # (C,) of each round: mean square of a record's
    unexplained: list[NDArray[np.float64]] = field(default_factory=list)  # (C,), mean squares
    explained: list[NDArray[np.float64]] = field(default_factory=list)  # (C,), of the steps' own effect

    def add(self, unexplained: NDArray[np.float64], explained: NDArray[np.float64]) -> None:
        """Keep what one round changed."""
        self.unexplained.append(unexplained)
        self.explained.append(explained)

    def drift(self, channel: int) -> float:
        """Mean square by which a channel changes from round to round though nothing is changed.

        What is in proportion to the step is an error of the response, not drift: the smallest share that any round
        shows. Of the rest the smaller one of the last two rounds, so that one sudden change is not taken for the
        rule; 0 before the second round, since one cannot be told from the other.
        """
        if len(self.unexplained) < 2:
            return 0.0
        return min(rest for rest, _ in self._parts(channel)[-2:])

    def response_error(self, channel: int) -> float:
        """Share of a step's mean square that is missed, since the response is not exact; 0 … 1."""
        return self._parts(channel)[0][1] if len(self.unexplained) >= 2 else 0.0

    def _parts(self, channel: int) -> list[tuple[float, float]]:
        pairs = [(float(q[channel]), float(g[channel])) for q, g in zip(self.unexplained, self.explained, strict=True)]
        share = min((q / g if g > 0 else 1.0 for q, g in pairs), default=0.0)
        share = min(share, 1.0)
        return [(max(q - share * g, 0.0), share) for q, g in pairs]

    def repeatability(self, channel: int) -> float:
        """Mean square by which two rounds of one drive differ in a channel: noise and drift."""
        noise = float(np.mean([one[channel] for one in self.noise])) if self.noise else 0.0
        return noise + self.drift(channel)

    def pays(self, channel: int, removable: float) -> bool:
        """Whether a step that can remove this mean square gains more than the rounds differ by."""
        return removable * (1.0 - self.response_error(channel)) > self.repeatability(channel)
