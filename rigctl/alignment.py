"""Two clocks: delay and drift between a run and another data acquisition, and channels on the run's own clock.

Model: t = delay + (1 + drift) · u, with t on the rig's clock from sample 0 of the run, and u on the other clock from
its first sample. Both are estimated from events that both have seen: the edges of a synchronisation pulse, or one
trigger.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import AlignmentError

LOCKED: Final = 0.25  # share of the expected scatter below which the errors of the edges are taken as equal, not random
LEAST_EDGES: Final = 3  # two give delay and drift and no check of either
WORST_SCATTER: Final = 25.0  # times the expected variance: the edges are not of one pulse
AMBIGUOUS: Final = 4.0  # times the best sum of squares that any other pairing must exceed
HALF_WIDTH: Final = 24  # of the resampling kernel, in samples of the slower clock; an error of 1e-5 below 0.4 · rate
KAISER_BETA: Final = 10.0
BAND: Final = 0.9  # of the slower Nyquist frequency that the kernel passes


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockRelation:
    """How another clock runs against the rig's, with standard uncertainties."""

    delay_s: float
    drift: float  # 1e-6: a part per million; positive where the other clock runs slow
    delay_u_s: float
    drift_u: float
    covariance_s: float  # of the two
    events: int

    def to_other(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Time on the other clock."""
        other: NDArray[np.float64] = (time_s - self.delay_s) / (1.0 + self.drift)
        return other

    def uncertainty_s(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Standard uncertainty of the alignment at times on the rig's clock."""
        other = self.to_other(time_s)
        variance = self.delay_u_s**2 + 2 * other * self.covariance_s + (other * self.drift_u) ** 2
        return np.sqrt(np.maximum(variance, 0.0))

    def __str__(self) -> str:
        return (
            f"delay {self.delay_s:.6f} s ± {2 * self.delay_u_s:.2g} s, "
            f"drift {self.drift * 1e6:.2f} ppm ± {2e6 * self.drift_u:.2g} ppm (k = 2, {self.events} events)"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Edges:
    """Times at which a signal rises through a level, with the standard uncertainty of one."""

    time_s: NDArray[np.float64]
    u_s: float


def rising_edges(values: NDArray[np.float64], rate_hz: float, level: float | None = None) -> Edges:
    """Rising edges of a pulse or of any signal, with hysteresis.

    Parameters
    ----------
    values : (N,) array
    level : value that is crossed; without one the middle between the lowest and the highest value.

    A pulse that is sampled as two values has edges within one sample, u = T/√12. Where a sample lies on the flank,
    the crossing is interpolated; its uncertainty is that of the noise over the slope, at least a twentieth of T.
    """
    low, high = (float(value) for value in np.quantile(values, (0.001, 0.999)))
    middle = 0.5 * (low + high) if level is None else level
    hysteresis = 0.1 * (high - low)
    if not low + hysteresis < middle < high - hysteresis:
        raise AlignmentError(
            f"level is {middle:g}: the signal goes from {low:g} to {high:g}, the level must lie well inside"
        )
    above = np.flatnonzero(_schmitt(values, middle - hysteresis, middle + hysteresis))
    if not above.size:
        raise AlignmentError("the signal never rises through the level: is this the channel of the pulse?")
    last_below = np.array([int(np.flatnonzero(values[:k] < middle)[-1]) for k in above])
    before, after = values[last_below], values[last_below + 1]
    share = (middle - before) / (after - before)
    on_flank = np.mean((after - before) < 0.8 * (high - low))
    if on_flank < 0.5:
        return Edges(time_s=(last_below + 0.5) / rate_hz, u_s=1.0 / (rate_hz * np.sqrt(12.0)))
    noise = float(np.median(np.abs(np.diff(values, 2)))) / (0.6745 * np.sqrt(6.0))
    slope = float(np.median(after - before)) * rate_hz
    return Edges(time_s=(last_below + share) / rate_hz, u_s=max(noise / slope, 0.05 / rate_hz))


def _schmitt(values: NDArray[np.float64], low: float, high: float) -> NDArray[np.bool_]:
    """Samples at which the signal has come from below `low` and first reaches `high`."""
    state = np.where(values >= high, 1, np.where(values <= low, -1, 0))
    known = np.maximum.accumulate(np.where(state != 0, np.arange(values.size), 0))
    held = state[known]
    rises: NDArray[np.bool_] = np.concatenate([[False], (held[1:] == 1) & (held[:-1] == -1)])
    return rises


def relation_from_pulses(rig: Edges, other: Edges) -> ClockRelation:
    """Delay and drift from the edges that both clocks have seen, by least squares.

    Where one side has seen more edges than the other, the pairing with the smallest residuals is taken, if no
    other comes near it: pulses at irregular intervals make that certain.

    Raises
    ------
    AlignmentError
        With fewer than three edges, with an ambiguous pairing, or with residuals far above the edges' uncertainty.
    """
    a, b = _paired(rig.time_s, other.time_s)
    variance = rig.u_s**2 + other.u_s**2
    design = np.column_stack([np.ones_like(b), b])
    solution = np.linalg.lstsq(design, a, rcond=None)[0]
    scatter = float(np.sum((a - design @ solution) ** 2)) / max(b.size - 2, 1) / variance
    if scatter > WORST_SCATTER:
        raise AlignmentError(
            f"the edges scatter by {np.sqrt(scatter * variance):.3g} s about a common clock, "
            f"{np.sqrt(variance):.3g} s is expected: these are not the same pulses"
        )
    covariance = max(scatter, 1.0) * variance * np.linalg.inv(design.T @ design)
    common = variance if b.size > LEAST_EDGES and scatter < LOCKED else 0.0  # the same error in every edge
    return ClockRelation(
        delay_s=float(solution[0]),
        drift=float(solution[1]) - 1.0,
        delay_u_s=float(np.sqrt(covariance[0, 0] + common)),
        drift_u=float(np.sqrt(covariance[1, 1])),
        covariance_s=float(covariance[0, 1]),
        events=b.size,
    )


def relation_from_trigger(rig_s: float, other_s: float, u_s: float, clock_tolerance: float) -> ClockRelation:
    """Delay from one event; the drift is unknown within the tolerance of both clocks together.

    A rectangular distribution of half-width `clock_tolerance` has the standard uncertainty tolerance/√3.
    """
    if not 0 < clock_tolerance < 1e-2:
        raise AlignmentError(f"clock tolerance is {clock_tolerance:g}: it must lie above 0 and below 0.01 (1 %)")
    drift_u = clock_tolerance / np.sqrt(3.0)
    return ClockRelation(
        delay_s=rig_s - other_s,
        drift=0.0,
        delay_u_s=float(np.hypot(u_s, other_s * drift_u)),
        drift_u=float(drift_u),
        covariance_s=float(-other_s * drift_u**2),
        events=1,
    )


def _paired(a: NDArray[np.float64], b: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The edges of both that belong together."""
    n = min(a.size, b.size)
    if n < LEAST_EDGES:
        raise AlignmentError(
            f"{a.size} edges on the rig, {b.size} on the other clock: {LEAST_EDGES} or more are needed"
        )
    if a.size == b.size:
        return a, b
    shifts = range(abs(a.size - b.size) + 1)
    pairs = [(a[k : k + n], b) if a.size > n else (a, b[k : k + n]) for k in shifts]
    squares = [float(np.sum((np.polyval(np.polyfit(y, x, 1), y) - x) ** 2)) for x, y in pairs]
    order = np.argsort(squares)
    if squares[order[1]] < AMBIGUOUS * squares[order[0]] + 1e-18:
        raise AlignmentError(
            f"{a.size} edges on the rig, {b.size} on the other clock, and more than one pairing fits: "
            "use pulses at irregular intervals, or a trigger"
        )
    return pairs[int(order[0])]


def resampled(
    values: NDArray[np.float64], rate_hz: float, relation: ClockRelation, rig_rate_hz: float, samples: int
) -> NDArray[np.float64]:
    """A channel of the other acquisition at the samples of the run, by one band-limited interpolation.

    y[n] = Σ_k x[k] · h(u_n − k/f), h a sinc in a Kaiser window with its edge at 0.9 of the slower Nyquist frequency,
    its sum made 1 so that a constant stays.

    Raises
    ------
    AlignmentError
        Where the other record does not cover the run.
    """
    at = relation.to_other(np.arange(samples) / rig_rate_hz) * rate_hz  # in samples of the other clock
    if at[0] < -0.5 or at[-1] > values.size - 0.5:
        raise AlignmentError(
            f"the other record covers {relation.delay_s:.3f} … "
            f"{relation.delay_s + (1 + relation.drift) * values.size / rate_hz:.3f} s of the run, "
            f"0 … {samples / rig_rate_hz:.3f} s are needed"
        )
    slower = min(1.0, rig_rate_hz / rate_hz)
    reach = int(np.ceil(HALF_WIDTH / slower))
    padded = np.pad(values, reach + 1, mode="reflect", reflect_type="odd")
    first = np.floor(at).astype(np.intp)
    out = np.zeros(samples)
    weight = np.zeros(samples)
    for k in range(-reach + 1, reach + 1):
        distance = at - (first + k)
        window = np.i0(KAISER_BETA * np.sqrt(np.maximum(1.0 - (distance / reach) ** 2, 0.0)))
        kernel = np.sinc(BAND * slower * distance) * window
        out += kernel * padded[np.clip(first + k + reach + 1, 0, padded.size - 1)]
        weight += kernel
    return out / weight
