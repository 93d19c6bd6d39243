"""Cosine, sine and uniform random numbers with the same bits on every machine.

Library sines differ in the last bit between processors (vector units, fused multiply-add), and an
optimisation of phases amplifies that. Here only additions, multiplications and roundings are used, which IEEE
754 fixes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["angle_turns", "cosine_and_sine", "uniform"]

# Minimax polynomials on [-π/4, π/4], error below 1 ulp: Cody & Waite 1980 in the form of fdlibm (Sun, 1993).
_SINE = (
    1.58969099521155010221e-10,
    -2.50507602534068634195e-08,
    2.75573137070700676789e-06,
    -1.98412698298579493134e-04,
    8.33333333332248946124e-03,
    -1.66666666666666324348e-01,
)
_COSINE = (
    -1.13596475577881948265e-11,
    2.08757232129817482790e-09,
    -2.75573143513906633035e-07,
    2.48015872894767294178e-05,
    -1.38888888888741095749e-03,
    4.16666666666666019037e-02,
)
_ARCTAN = (
    1.62858201153657823623e-02,
    -3.65315727442169155270e-02,
    4.97687799461593236017e-02,
    -5.83357013379057348645e-02,
    6.66107313738753120669e-02,
    -7.69187620504482999495e-02,
    9.09088713343650656196e-02,
    -1.11111104054623557880e-01,
    1.42857142725034663711e-01,
    -1.99999999998764832476e-01,
    3.33333333333329318027e-01,
)
_ARCTAN_HALF = 4.63647609000806093515e-01


def cosine_and_sine(turns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """cos(2πt) and sin(2πt) of t in turns, any shape; within 2e-16 of the truth for abs(t) ≤ 1."""
    turns = np.asarray(turns, dtype=np.float64)
    quarters = np.rint(4.0 * turns)
    angle = (turns - 0.25 * quarters) * (2.0 * np.pi)
    square = angle * angle
    sine = angle + angle * square * _polynomial(_SINE, square)
    cosine = 1.0 - (0.5 * square - square * square * _polynomial(_COSINE, square))
    quadrant = quarters.astype(np.int64) & 3
    odd = (quadrant & 1).astype(bool)
    cos = np.where(odd, sine, cosine) * np.where((quadrant == 1) | (quadrant == 2), -1.0, 1.0)
    sin = np.where(odd, cosine, sine) * np.where(quadrant >= 2, -1.0, 1.0)
    return cos, sin


def _polynomial(coefficients: tuple[float, ...], x: NDArray[np.float64]) -> NDArray[np.float64]:
    value = np.full_like(x, coefficients[0])
    for coefficient in coefficients[1:]:
        value = value * x + coefficient
    return value


def angle_turns(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """The angle of each (x, y) in turns, in [-1/2, 1/2], any shape; the inverse of ``cosine_and_sine``."""
    wide, high = np.abs(x), np.abs(y)
    ratio = np.minimum(wide, high) / np.maximum(np.maximum(wide, high), 1e-300)
    base = np.where(ratio < 0.4375, 0.0, np.where(ratio < 0.6875, 0.5, 1.0))
    known = np.where(ratio < 0.4375, 0.0, np.where(ratio < 0.6875, _ARCTAN_HALF, 0.25 * np.pi))
    left = (ratio - base) / (1.0 + base * ratio)  # arctan a = arctan b + arctan((a − b)/(1 + a b))
    square = left * left
    angle = known + (left - left * square * _polynomial(_ARCTAN, square))
    turns = angle * (0.5 / np.pi)
    turns = np.where(high > wide, 0.25 - turns, turns)
    turns = np.where(x < 0, 0.5 - turns, turns)
    return np.asarray(np.where(y < 0, -turns, turns))


def uniform(key: tuple[int, ...], count: int) -> NDArray[np.float64]:
    """``count`` numbers, uniform on [0, 1), that depend on ``key`` alone.

    From the raw words of PCG64, which numpy keeps stable between versions (NEP 19), unlike the methods of
    Generator.
    """
    words = np.random.PCG64(np.random.SeedSequence(key)).random_raw(count)
    return np.asarray(words >> np.uint64(11), dtype=np.float64) * 2.0**-53
