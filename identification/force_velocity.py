"""The force–velocity diagram of a damper from the extremes of its tests, and the saturating curve through it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from identification.errors import DataError
from identification.steady import Cycles

Floats = NDArray[np.float64]

_STEEPNESSES = 12  # start values: the curve's knee may lie anywhere within the speeds tested
_LEAST_POINTS = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class ArctanCurve:
    """F(v) = (2/π)·arctan(S·v)·F1 + d·v + F2, with the standard deviation of each parameter, (4,)."""

    S: float  # s/m
    F1: float  # N
    d: float  # N·s/m
    F2: float  # N
    std: Floats
    rms: float  # N, of the residual

    def __call__(self, v: Floats) -> Floats:
        """Force at the speeds `v`, (N,), m/s."""
        return np.asarray(2.0 / np.pi * np.arctan(self.S * v) * self.F1 + self.d * v + self.F2)


def extremes(tests: Sequence[Cycles]) -> tuple[Floats, Floats]:
    """Speeds and forces of the diagram, (2 M,): of each test greatest speed with greatest force, least with least."""
    speeds, forces = [], []
    for test in tests:
        _, v, force = test.loop()
        speeds += [v.max(), v.min()]
        forces += [force.max(), force.min()]
    return np.array(speeds), np.array(forces)


def at_peak_speed(tests: Sequence[Cycles]) -> tuple[Floats, Floats]:
    """Speeds and forces, (2 M,): of each test at its greatest speed in rebound, and at that in compression.

    With hysteresis or a spring the greatest force is at another speed: see `extremes`.
    """
    speeds, forces = [], []
    for test in tests:
        _, v, force = test.loop()
        for k in (int(np.argmax(v)), int(np.argmin(v))):
            speeds.append(v[k])
            forces.append(force[k])
    return np.array(speeds), np.array(forces)


def hysteresis_width(test: Cycles) -> float:
    """The greatest difference of force, N, between speeding up and slowing down at one velocity.

    Looked for within nine tenths of the peak speeds, where the branches of a loop are apart.
    """
    _, v, force = test.loop()
    v, force = np.roll(v, -int(np.argmin(v))), np.roll(force, -int(np.argmin(v)))
    top = int(np.argmax(v))
    grid = np.linspace(0.9 * v[0], 0.9 * v[top], 181)
    up = np.interp(grid, v[: top + 1], force[: top + 1])
    down = np.interp(grid, v[top:][::-1], force[top:][::-1])
    return float(np.max(np.abs(up - down)))


def arctan_fit(v: Floats, force: Floats) -> ArctanCurve:
    """Least squares of the saturating curve, from several starts, because S has several local minima.

    Parameters
    ----------
    v, force : (N,) float64, m/s and N

    Raises
    ------
    DataError
        when there are fewer than six points.
    """
    if v.size < _LEAST_POINTS:
        raise DataError(f"{v.size} points of force over velocity: four parameters need at least {_LEAST_POINTS}")
    scale_v, scale_f = float(np.abs(v).max()), float(np.abs(force).max())
    y, f = v / scale_v, force / scale_f
    slowest = max(float(np.abs(y).min()), 1e-6)

    def residual(p: Floats) -> Floats:
        return np.asarray(2.0 / np.pi * np.arctan(np.exp(p[0]) * y) * p[1] + p[2] * y + p[3] - f)

    found = min(
        (least_squares(residual, _start(s, y, f)) for s in np.geomspace(0.5, 5.0 / slowest, _STEEPNESSES)),
        key=lambda r: float(r.cost),
    )
    s, f1, d, f2 = np.exp(found.x[0]), *found.x[1:]
    free = max(v.size - 4, 1)
    jacobian = np.asarray(found.jac, dtype=np.float64)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * 2.0 * found.cost / free
    std = np.sqrt(np.diag(covariance)) * np.array([s / scale_v, scale_f, scale_f / scale_v, scale_f])
    return ArctanCurve(
        S=float(s / scale_v),
        F1=float(f1 * scale_f),
        d=float(d * scale_f / scale_v),
        F2=float(f2 * scale_f),
        std=std,
        rms=float(np.sqrt(2.0 * found.cost / v.size) * scale_f),
    )


def _start(steepness: float, y: Floats, f: Floats) -> Floats:
    """The three linear parameters that fit best at a steepness."""
    basis = np.stack([2.0 / np.pi * np.arctan(steepness * y), y, np.ones_like(y)], axis=1)
    return np.concatenate([[np.log(steepness)], np.linalg.lstsq(basis, f, rcond=None)[0]])
