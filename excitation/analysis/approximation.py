"""The best linear approximation of the force over each input, line by line, with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.criteria import POOLED
from excitation.analysis.pooled import pooled
from excitation.analysis.seen_lines import SeenLines
from excitation.analysis.spectra import LineSpectra, noise_beside

__all__ = ["Approximation", "approximate", "between", "pooled_scatter", "unsolved"]

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Correlation of the two inputs over the realisations from which a line cannot tell them apart: the variance of both is
# then 50 times that of one input alone. At 0.9 a seventh of the lines of two random realisations is lost, at 0.98 a
# fourteenth.
_ALIKE_INPUTS = 0.98


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Approximation:
    """G(k) of every input on the K driven lines; NaN on lines that an input does not excite or cannot be told on."""

    value: Complex  # (I, K), N per unit of the input
    gain: Floats  # (I, K): variance of G for a variance 1 N² of the force, the diagonal of (UᴴU)⁻¹
    noise_std: Floats  # (I, K): of G by noise of force and inputs alone, √E|ΔG|²; NaN where no noise is known
    scatter: Floats  # (K,), N²: mean square of what G leaves of one realisation; NaN without realisations to spare
    spare: int  # realisations beyond those that G needs where most inputs drive, 0 where none
    linear: Floats  # (K,), N²: mean square of what G makes of the inputs; all of the force where G cannot be told
    taken: float  # share of what is not linear that G takes up


def approximate(spectra: Sequence[LineSpectra], lines: SeenLines) -> Approximation:
    """Least squares over the realisations m of Y_m(k) = Σ_i G_i(k)·U_im(k) + E_m(k).

    One input: G = ΣY·U*/Σ|U|². With more realisations than inputs Σ|E|²/(M − I) is the variance of what is not linear
    in one of them: stochastic distortion and the noise of the mean period.

    References
    ----------
    Pintelon & Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012: the robust method, with
    several inputs; for inputs without noise its mean of ratios and this least squares agree where |U| is that of the
    design in each realisation.
    """
    driven = lines.driven
    forces = np.array([one.force[driven] for one in spectra]).T  # (K, M)
    inputs = np.array([one.inputs[:, driven] for one in spectra]).transpose(2, 0, 1)  # (K, M, I)
    active = np.array([np.isin(driven, one) for one in lines.excited]).T  # (K, I)
    value = np.full(active.shape, np.nan, dtype=np.complex128)
    gain, noise_std = np.full(active.shape, np.nan), np.full(active.shape, np.nan)
    scatter = np.full(driven.size, np.nan)
    linear = np.mean(np.abs(forces) ** 2, axis=1)  # where fewer realisations than inputs fit it all
    for pattern in np.unique(active, axis=0):
        use = np.flatnonzero(pattern)
        at = np.flatnonzero(np.all(active == pattern, axis=1))
        at = at[_can_be_solved(inputs[at][:, :, use])]
        u, y = inputs[at][:, :, use], forces[at]
        weights = np.linalg.pinv(u)  # (K', I', M)
        solved = (weights @ y[:, :, None])[:, :, 0]
        made = (u @ solved[:, :, None])[:, :, 0]
        place = np.ix_(at, use)
        value[place], gain[place] = solved, np.sum(np.abs(weights) ** 2, axis=2)
        noise = [noise_beside(one, _of_inputs(solved, use, one), driven[at]) / one.periods for one in spectra]
        noise_std[place] = np.sqrt(np.sum(np.abs(weights) ** 2 * np.array(noise).T[:, None, :], axis=2))
        linear[at] = np.mean(np.abs(made) ** 2, axis=1)
        if len(spectra) > use.size:
            scatter[at] = np.sum(np.abs(y - made) ** 2, axis=1) / (len(spectra) - use.size)
    known = all(one.periods > 1 for one in spectra)
    most = int(np.max(np.sum(active, axis=1)))
    return Approximation(
        value=value.T,
        gain=gain.T,
        noise_std=noise_std.T if known else np.full(value.T.shape, np.nan),
        scatter=scatter,
        spare=max(len(spectra) - most, 0),
        linear=linear,
        taken=min(most / len(spectra), 1.0),
    )


def _of_inputs(solved: Complex, use: NDArray[np.int64], one: LineSpectra) -> Complex:
    """G of every input, (I, K), from that of some, (K, I')."""
    out = np.zeros((len(one.inputs), len(solved)), dtype=np.complex128)
    out[use] = solved.T
    return out


def _can_be_solved(u: Complex) -> NDArray[np.bool_]:
    """Of which lines the M realisations of the inputs (K, M, I) tell them apart, (K,)."""
    size = np.sqrt(np.sum(np.abs(u) ** 2, axis=1))  # (K, I)
    driven = np.asarray(np.all(size > 0.0, axis=1), dtype=np.bool_)
    if u.shape[2] == 1:
        return driven
    if u.shape[1] < u.shape[2]:
        return np.zeros(len(u), dtype=np.bool_)
    alike = np.abs(np.sum(u[:, :, 0].conj() * u[:, :, 1], axis=1))
    return np.asarray(driven & (alike < _ALIKE_INPUTS * size[:, 0] * size[:, 1]), dtype=np.bool_)


def unsolved(approximation: Approximation, lines: SeenLines) -> int:
    """Driven lines on which the inputs cannot be told apart."""
    return int(np.sum(np.all(np.isnan(approximation.value), axis=0))) if lines.driven.size else 0


def pooled_scatter(approximation: Approximation) -> Floats:
    """The scatter over realisations, averaged over so many neighbouring lines that it is well known, (K,), N²."""
    known = np.flatnonzero(np.isfinite(approximation.scatter))
    out = np.full(approximation.scatter.size, np.nan)
    if known.size:
        width = -(-POOLED // max(approximation.spare, 1))
        mean = pooled(approximation.scatter[known], width)
        out = np.interp(np.arange(out.size), known, mean)
    return out


def between(approximation: Approximation, lines: SeenLines, k: NDArray[np.int64], *, over_rate: bool) -> Complex:
    """G of each input on lines that are not driven, (I, K'), from its neighbours, the last ones beyond the band.

    ``over_rate``: the first input is a displacement, and what changes slowly with frequency is force over velocity.
    """
    out = np.zeros((approximation.value.shape[0], k.size), dtype=np.complex128)
    for i, value in enumerate(approximation.value):
        known = np.flatnonzero(np.isfinite(value))
        if not known.size:
            continue
        at = lines.driven[known].astype(np.float64)
        rate = 1j * at if over_rate and i == 0 else np.ones_like(at)
        smooth = value[known] / rate
        found = np.interp(k, at, smooth.real) + 1j * np.interp(k, at, smooth.imag)
        out[i] = found * (1j * k if over_rate and i == 0 else 1.0)
    return out
