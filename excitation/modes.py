"""Cosine modes of a sample distribution over a box, and their gradient: the compiled inner loops.

Imported only where a homogenised design is made: numba takes long to load. Cosines of this module, sums in a
fixed order, no fused multiply-add: the same bits on every processor. The innermost loops run over a block of
samples and do not read what they write, so that compilers use vector instructions without reordering sums.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["gradient_2d", "gradient_3d", "sums_2d", "sums_3d"]

_BLOCK = 128  # samples: the tables of 16 modes fit into the level 1 cache
_QUARTER = 32
_HALF_PI = 1.5707963267948966


@njit(cache=True, nogil=True)
def _tables(values: NDArray[np.float64], start: int, cosines: NDArray[np.float64], sines: NDArray[np.float64]) -> None:
    """cos(mθ) and sin(mθ), θ = π(x + 1)/2, for the block of x, in half boxes, from ``start``; (modes,
    _BLOCK).

    cos θ = −sin 2h and sin θ = cos 2h with h = πx/4, by Taylor's series, exact to 1e-16 for abs(x) ≤ 2.4;
    higher m by the angle-sum recurrence. Beyond the last sample all cosines are zero, so that nothing is
    counted.
    """
    count = min(_BLOCK, values.size - start)
    x = np.zeros(_BLOCK)
    x[:count] = values[start : start + count]
    c0, c1, s0, s1 = cosines[0], cosines[1], sines[0], sines[1]
    for b in range(_BLOCK):
        h = 0.5 * _HALF_PI * x[b]
        q = h * h
        s = 1.0 - q * (1.0 / 420.0)
        s = 1.0 - q * (1.0 / 342.0) * s
        s = 1.0 - q * (1.0 / 272.0) * s
        s = 1.0 - q * (1.0 / 210.0) * s
        s = 1.0 - q * (1.0 / 156.0) * s
        s = 1.0 - q * (1.0 / 110.0) * s
        s = 1.0 - q * (1.0 / 72.0) * s
        s = 1.0 - q * (1.0 / 42.0) * s
        s = 1.0 - q * (1.0 / 20.0) * s
        s = h * (1.0 - q * (1.0 / 6.0) * s)
        c = 1.0 - q * (1.0 / 380.0)
        c = 1.0 - q * (1.0 / 306.0) * c
        c = 1.0 - q * (1.0 / 240.0) * c
        c = 1.0 - q * (1.0 / 182.0) * c
        c = 1.0 - q * (1.0 / 132.0) * c
        c = 1.0 - q * (1.0 / 90.0) * c
        c = 1.0 - q * (1.0 / 56.0) * c
        c = 1.0 - q * (1.0 / 30.0) * c
        c = 1.0 - q * (1.0 / 12.0) * c
        c = 1.0 - q * 0.5 * c
        c1[b] = -2.0 * s * c
        s1[b] = 1.0 - 2.0 * s * s
    c0[:] = 1.0
    s0[:] = 0.0
    for m in range(2, cosines.shape[0]):
        cm, sm, cl, sl = cosines[m], sines[m], cosines[m - 1], sines[m - 1]
        for b in range(_BLOCK):
            cm[b] = cl[b] * c1[b] - sl[b] * s1[b]
        for b in range(_BLOCK):
            sm[b] = sl[b] * c1[b] + cl[b] * s1[b]
    if count < _BLOCK:
        cosines[:, count:] = 0.0


@njit(cache=True, nogil=True)
def _summed(partial: NDArray[np.float64]) -> NDArray[np.float64]:
    total = np.zeros(partial.shape[0])
    for k in range(partial.shape[0]):
        for b in range(partial.shape[1]):
            total[k] += partial[k, b]
    return total


@njit(cache=True, nogil=True)
def sums_2d(x: NDArray[np.float64], y: NDArray[np.float64], modes: int) -> NDArray[np.float64]:
    """Σ_n cos(pθ_x) cos(qθ_y); x, y (N,) in half boxes; result (modes, modes)."""
    partial = np.zeros((modes * modes, _QUARTER))
    cx, cy, s = np.empty((modes, _BLOCK)), np.empty((modes, _BLOCK)), np.empty((modes, _BLOCK))
    for start in range(0, x.size, _BLOCK):
        _tables(x, start, cx, s)
        _tables(y, start, cy, s)
        for p in range(modes):
            a = cx[p]
            for q in range(modes):
                c, t = cy[q], partial[p * modes + q]
                for b in range(_QUARTER):
                    t[b] += (a[b] * c[b] + a[b + _QUARTER] * c[b + _QUARTER]) + (
                        a[b + 2 * _QUARTER] * c[b + 2 * _QUARTER] + a[b + 3 * _QUARTER] * c[b + 3 * _QUARTER]
                    )
    return _summed(partial).reshape(modes, modes)


@njit(cache=True, nogil=True)
def _slopes(
    weight: NDArray[np.float64],
    cosines: NDArray[np.float64],
    sines: NDArray[np.float64],
    gradient: NDArray[np.float64],
) -> None:
    """−π/2·Σ_p p sin(pθ) Σ_q weight_pq cosines_q for each sample of a block; modes a multiple of four."""
    across = np.empty(_BLOCK)
    gradient[:] = 0.0
    for p in range(1, weight.shape[0]):
        across[:] = 0.0
        for q in range(0, weight.shape[1], 4):
            a, b, c, d = weight[p, q], weight[p, q + 1], weight[p, q + 2], weight[p, q + 3]
            k0, k1, k2, k3 = cosines[q], cosines[q + 1], cosines[q + 2], cosines[q + 3]
            for n in range(_BLOCK):
                across[n] += (a * k0[n] + b * k1[n]) + (c * k2[n] + d * k3[n])
        s = sines[p]
        for n in range(_BLOCK):
            gradient[n] -= _HALF_PI * p * s[n] * across[n]


@njit(cache=True, nogil=True)
def gradient_2d(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    weight: NDArray[np.float64],
    gx: NDArray[np.float64],
    gy: NDArray[np.float64],
) -> None:
    """Writes ∂/∂x_n and ∂/∂y_n of Σ_pq weight_pq·sums_pq into gx, gy (N,)."""
    modes = weight.shape[0]
    turned = weight.T.copy()
    cx, sx = np.empty((modes, _BLOCK)), np.empty((modes, _BLOCK))
    cy, sy = np.empty((modes, _BLOCK)), np.empty((modes, _BLOCK))
    slope = np.empty(_BLOCK)
    for start in range(0, x.size, _BLOCK):
        count = min(_BLOCK, x.size - start)
        _tables(x, start, cx, sx)
        _tables(y, start, cy, sy)
        _slopes(weight, cy, sx, slope)
        gx[start : start + count] = slope[:count]
        _slopes(turned, cx, sy, slope)
        gy[start : start + count] = slope[:count]


@njit(cache=True, nogil=True)
def sums_3d(x: NDArray[np.float64], y: NDArray[np.float64], z: NDArray[np.float64], modes: int) -> NDArray[np.float64]:
    """Σ_n cos(pθ_x) cos(qθ_y) cos(rθ_z); result (modes, modes, modes)."""
    partial = np.zeros((modes**3, _QUARTER))
    cx, cy, cz = np.empty((modes, _BLOCK)), np.empty((modes, _BLOCK)), np.empty((modes, _BLOCK))
    both, s = np.empty(_BLOCK), np.empty((modes, _BLOCK))
    for start in range(0, x.size, _BLOCK):
        _tables(x, start, cx, s)
        _tables(y, start, cy, s)
        _tables(z, start, cz, s)
        for p in range(modes):
            for q in range(modes):
                e, f = cx[p], cy[q]
                for n in range(_BLOCK):
                    both[n] = e[n] * f[n]
                a = both
                for r in range(modes):
                    c, t = cz[r], partial[(p * modes + q) * modes + r]
                    for b in range(_QUARTER):
                        t[b] += (a[b] * c[b] + a[b + _QUARTER] * c[b + _QUARTER]) + (
                            a[b + 2 * _QUARTER] * c[b + 2 * _QUARTER] + a[b + 3 * _QUARTER] * c[b + 3 * _QUARTER]
                        )
    return _summed(partial).reshape(modes, modes, modes)


@njit(cache=True, nogil=True)
def _slopes_3d(
    weight: NDArray[np.float64],
    cy: NDArray[np.float64],
    cz: NDArray[np.float64],
    sines: NDArray[np.float64],
    gradient: NDArray[np.float64],
) -> None:
    """−π/2·Σ_p p sin(pθ) Σ_qr weight_pqr cy_q cz_r for each sample of a block; modes a multiple of four."""
    across, plane = np.empty(_BLOCK), np.empty(_BLOCK)
    gradient[:] = 0.0
    for p in range(1, weight.shape[0]):
        plane[:] = 0.0
        for q in range(weight.shape[1]):
            across[:] = 0.0
            for r in range(0, weight.shape[2], 4):
                a, b, c, d = weight[p, q, r], weight[p, q, r + 1], weight[p, q, r + 2], weight[p, q, r + 3]
                k0, k1, k2, k3 = cz[r], cz[r + 1], cz[r + 2], cz[r + 3]
                for n in range(_BLOCK):
                    across[n] += (a * k0[n] + b * k1[n]) + (c * k2[n] + d * k3[n])
            k = cy[q]
            for n in range(_BLOCK):
                plane[n] += k[n] * across[n]
        s = sines[p]
        for n in range(_BLOCK):
            gradient[n] -= _HALF_PI * p * s[n] * plane[n]


@njit(cache=True, nogil=True)
def gradient_3d(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    z: NDArray[np.float64],
    weight: NDArray[np.float64],
    gx: NDArray[np.float64],
    gy: NDArray[np.float64],
    gz: NDArray[np.float64],
) -> None:
    """Writes ∂/∂x_n, ∂/∂y_n and ∂/∂z_n of Σ_pqr weight_pqr·sums_pqr into gx, gy, gz (N,)."""
    modes = weight.shape[0]
    y_first = weight.transpose(1, 0, 2).copy()
    z_first = weight.transpose(2, 0, 1).copy()
    cx, sx = np.empty((modes, _BLOCK)), np.empty((modes, _BLOCK))
    cy, sy = np.empty((modes, _BLOCK)), np.empty((modes, _BLOCK))
    cz, sz = np.empty((modes, _BLOCK)), np.empty((modes, _BLOCK))
    slope = np.empty(_BLOCK)
    for start in range(0, x.size, _BLOCK):
        count = min(_BLOCK, x.size - start)
        _tables(x, start, cx, sx)
        _tables(y, start, cy, sy)
        _tables(z, start, cz, sz)
        _slopes_3d(weight, cy, cz, sx, slope)
        gx[start : start + count] = slope[:count]
        _slopes_3d(y_first, cx, cz, sy, slope)
        gy[start : start + count] = slope[:count]
        _slopes_3d(z_first, cx, cy, sz, slope)
        gz[start : start + count] = slope[:count]
