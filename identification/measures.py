"""Error figures of a simulated force against a measured one."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate, correlation_lags

from identification.errors import DataError
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_MAX_SHIFT = 0.2  # of the record: beyond it two signals are not shifted but different
_BAND = 0.02  # of the record on either side: how far the dynamic warp may reach


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """Figures of one comparison.

    rms in N; rrmsse in %, rms error over the rms of the measured force about its mean; fit in %, 100 is perfect; eearth
    and its three parts from 0 to 1.
    """

    rms: float
    rrmsse: float
    fit: float
    eearth: float
    eearth_phase: float
    eearth_magnitude: float
    eearth_slope: float


def score(run: Run) -> dict[str, float]:
    """Figures of `force_simulated` against `force` of a run, by name.

    Raises
    ------
    DataError
        when one of the two channels is missing, or the measured force is constant.
    """
    name = run.path.name if run.path is not None else run.run_id
    for channel in ("force", "force_simulated"):
        if channel not in run.channels:
            cure = "run `damper-rig simulate` first" if channel == "force_simulated" else "it must be measured"
            raise DataError(f"{name}: no channel '{channel}': {cure}")
    return asdict(score_signals(run.channels["force"], run.channels["force_simulated"]))


def score_signals(measured: Floats, simulated: Floats) -> Score:
    """Figures of a simulated signal (N,) against a measured one (N,), same unit.

    rms = √mean e²; rrmsse = 100·√(Σe²/Σ(F − mean F)²); fit = 100·(1 − ‖e‖/‖F − mean F‖). eearth is
    0.2·magnitude + 0.4·phase + 0.4·slope, after Zhan, Fu & Yang (2011), with linear part scores: phase from the shift
    of greatest correlation, magnitude after a banded dynamic warp of the shifted signals, slope from their derivatives.
    """
    centred = measured - measured.mean()
    size = float(np.linalg.norm(centred))
    if size == 0.0:
        raise DataError("the measured force is constant: there is nothing to compare with")
    error = measured - simulated
    ratio = float(np.linalg.norm(error)) / size
    phase, magnitude, slope = _eearth(measured, simulated)
    return Score(
        rms=float(np.sqrt(np.mean(error**2))),
        rrmsse=100.0 * ratio,
        fit=100.0 * (1.0 - ratio),
        eearth=0.2 * magnitude + 0.4 * phase + 0.4 * slope,
        eearth_phase=phase,
        eearth_magnitude=magnitude,
        eearth_slope=slope,
    )


def _eearth(measured: Floats, simulated: Floats) -> tuple[float, float, float]:
    n = measured.size
    lag = _best_lag(measured, simulated)
    phase = max(0.0, 1.0 - abs(lag) / (_MAX_SHIFT * n))
    a = measured[max(0, lag) : n + min(0, lag)]
    b = simulated[max(0, -lag) : n - max(0, lag)]
    half = max(1, int(_BAND * 0.1 * n))
    magnitude = _relative(a, b, half)
    slope = _relative(_smooth_slope(a), _smooth_slope(b), 0)
    return phase, magnitude, slope


def _best_lag(measured: Floats, simulated: Floats) -> int:
    """Samples by which the measured signal is behind the simulated one."""
    a, b = measured - measured.mean(), simulated - simulated.mean()
    lags = correlation_lags(a.size, b.size)
    inside = np.abs(lags) <= _MAX_SHIFT * a.size
    overlap = a.size - np.abs(lags[inside])
    return int(lags[inside][np.argmax(correlate(a, b, method="fft")[inside] / np.sqrt(overlap))])


def _relative(a: Floats, b: Floats, half: int) -> float:
    """1 − distance/size, where a sample of `a` may meet the nearest value of `b` within `half` samples of it."""
    distance = np.abs(a - b)
    if half > 1:
        low, high = _envelope(b, min(half, 25))
        distance = np.maximum(0.0, np.maximum(low - a, a - high))
    size = float(np.sum(np.abs(a)))
    return max(0.0, 1.0 - float(np.sum(distance)) / size) if size > 0.0 else 0.0


def _envelope(b: Floats, half: int) -> tuple[Floats, Floats]:
    padded = np.pad(b, half, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)
    return windows.min(axis=1), windows.max(axis=1)


def _smooth_slope(a: Floats) -> Floats:
    """Derivative per sample, averaged over intervals of nine samples as the standard's relative does."""
    kernel = np.ones(9) / 9.0
    return np.convolve(np.diff(a), kernel, mode="same")
