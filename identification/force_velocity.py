"""The force–velocity diagram of a damper: its tests at peak speed, and a curve for each side through them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.steady import Cycles

Floats = NDArray[np.float64]

_KNEES = 12  # start values: the knee may lie anywhere within the speeds tested
_LEAST_POINTS = 4  # of a side, which has three parameters
_WITHIN = 0.9  # of the peak speeds: there the branches of a loop are apart


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """f(v) = v·(c_far + (c − c_far)/√(1 + (v/w_knee)²)), and the standard deviations of c, w_knee and c_far, (3,).

    c is the slope at rest, c_far that far beyond the knee: smaller, digressive; larger, progressive.
    """

    c: float  # N·s/m
    w_knee: float  # m/s
    c_far: float  # N·s/m
    std: Floats

    def __call__(self, v: Floats) -> Floats:
        """Force at the speeds `v`, (N,), m/s."""
        return np.asarray(v * (self.c_far + (self.c - self.c_far) / np.sqrt(1.0 + (v / self.w_knee) ** 2)))


@dataclass(frozen=True, slots=True, kw_only=True)
class SidedCurve:
    """F(v) = at_rest ± friction + f(v), with f of the side that v is on."""

    at_rest: float  # N
    friction: float  # N
    rebound: Side
    compression: Side
    rms: float  # N, of the residual

    def __call__(self, v: Floats) -> Floats:
        """Force at the speeds `v`, (N,), m/s."""
        moved = np.where(v > 0.0, self.rebound(v), self.compression(v))
        return np.asarray(self.at_rest + self.friction * np.sign(v) + moved)


def at_peak_speed(tests: Sequence[Cycles]) -> tuple[Floats, Floats]:
    """Speeds and forces, (2 M,): of each test at its greatest speed in rebound, and at that in compression.

    With hysteresis or a spring the greatest force is at another speed.
    """
    speeds, forces = [], []
    for test in tests:
        _, v, force = test.loop()
        for k in (int(np.argmax(v)), int(np.argmin(v))):
            speeds.append(v[k])
            forces.append(force[k])
    return np.array(speeds), np.array(forces)


def hysteresis_widths(test: Cycles) -> tuple[float, float]:
    """The greatest difference of force, N, between speeding up and slowing down: in rebound, in compression.

    Looked for within nine tenths of the peak speeds, where the branches of a loop are apart.
    """
    _, v, force = test.loop()
    v, force = np.roll(v, -int(np.argmin(v))), np.roll(force, -int(np.argmin(v)))
    top = int(np.argmax(v))
    grid = np.linspace(_WITHIN * v[0], _WITHIN * v[top], 181)
    up = np.interp(grid, v[: top + 1], force[: top + 1])
    down = np.interp(grid, v[top:][::-1], force[top:][::-1])
    apart = np.abs(up - down)
    return float(apart[grid >= 0.0].max()), float(apart[grid <= 0.0].max())


def sided_fit(v: Floats, force: Floats, *, at_rest: float, friction: float) -> SidedCurve:
    """Least squares of each side by itself, with the forces at rest as given: `identification.static_force`.

    Parameters
    ----------
    v, force : (N,) float64, m/s and N

    Raises
    ------
    DataError
        when a side has fewer than four points.
    """
    fewest = min(int(np.sum(v > 0)), int(np.sum(v < 0)))
    if fewest < _LEAST_POINTS:
        raise DataError(f"{fewest} forces on one side: the three parameters of a side need at least {_LEAST_POINTS}")
    moved = force - at_rest - friction * np.sign(v)
    rebound, compression = (_side(np.abs(v[k]), moved[k] * np.sign(v[k])) for k in (v > 0, v < 0))
    curve = SidedCurve(at_rest=at_rest, friction=friction, rebound=rebound, compression=compression, rms=0.0)
    return replace(curve, rms=float(np.sqrt(np.mean((curve(v) - force) ** 2))))


def _side(v: Floats, force: Floats) -> Side:
    """One side, speeds and forces positive; from several starts, because the knee has several local minima."""
    from scipy.optimize import least_squares, nnls  # 0.3 s to import: only where there are enough tests

    scale_v, scale_f = float(v.max()), max(float(np.abs(force).max()), 1e-300)
    y, f = v / scale_v, force / scale_f
    slowest = max(float(y.min()), 1e-6)

    def residual(p: Floats) -> Floats:
        return np.asarray(_slopes(np.exp(p[0]), y) @ p[1:] - f)

    bounds = ([np.log(0.1 * slowest), 0.0, 0.0], [np.log(3.0), np.inf, np.inf])
    starts = [np.array([np.log(knee), *nnls(_slopes(knee, y), f)[0]]) for knee in np.geomspace(slowest, 3.0, _KNEES)]
    found = min(
        (least_squares(residual, start, bounds=bounds, x_scale="jac") for start in starts),
        key=lambda r: float(r.cost),
    )
    knee, c, c_far = float(np.exp(found.x[0])), float(found.x[1]), float(found.x[2])
    jacobian = np.asarray(found.jac, dtype=np.float64)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * 2.0 * found.cost / max(v.size - 3, 1)
    slope = scale_f / scale_v
    std = np.sqrt(np.diag(covariance))[[1, 0, 2]] * np.array([slope, knee * scale_v, slope])
    return Side(c=c * slope, w_knee=knee * scale_v, c_far=c_far * slope, std=std)


def _slopes(knee: float, y: Floats) -> Floats:
    """The columns of the slopes at rest and far beyond the knee, (N, 2)."""
    bend = 1.0 / np.sqrt(1.0 + (y / knee) ** 2)
    return np.stack([y * bend, y * (1.0 - bend)], axis=1)
