"""Which axes a load depends on: those whose motion alone is correlated with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.multiaxis.axes import check_axes
from rigctl.runfile import Run

Floats = NDArray[np.float64]

# Semipartial correlation of a load with the terms of one axis from which on it is an input: a tenth of the load. Half:
# chance in a record of half a minute makes inputs; double: an axis that makes a fifth of the force is left out.
LEAST = 0.1


def correlations(runs: Sequence[Run]) -> dict[str, dict[str, float]]:
    """The semipartial correlation, 0 … 1, of each load with each axis beside all others: {load: {axis: R}}.

    R² is the share of the load's variance that the terms of all axes explain and those of the others do not. The terms
    of an axis are its travel and speed, their squares, and their products with their own size: a load that does not
    care for the direction, as a sideways motion stretches a damper, is no less correlated than one that does.
    """
    motions, loads = check_axes(runs)
    rate = runs[0].sample_rate_hz
    terms = {axis: np.concatenate([terms_of(one.channels[axis], rate) for one in runs]) for axis in motions}
    every = _basis(list(terms.values()))
    others = {axis: _basis([one for name, one in terms.items() if name != axis]) for axis in motions}
    found: dict[str, dict[str, float]] = {}
    for name in loads:
        load = np.concatenate([one.channels[name] for one in runs])
        load = load - load.mean()
        whole = _explained(every, load)
        found[name] = {axis: float(np.sqrt(max(whole - _explained(others[axis], load), 0.0))) for axis in motions}
    return found


def chosen(found: Mapping[str, Mapping[str, float]]) -> dict[str, tuple[str, ...]]:
    """The axes of each load, at least the one that is correlated most."""
    out = {}
    for name, axes in found.items():
        above = tuple(axis for axis, share in axes.items() if share >= LEAST)
        out[name] = above or (max(axes, key=lambda axis: axes[axis]),)
    return out


def terms_of(travel: Floats, rate_hz: float) -> Floats:
    """Travel d and speed v as d, v, d², v², d·|d| and v·|v|, each in units of its rms, (N, 6)."""
    speed = np.gradient(travel) * rate_hz
    d, v = (one / max(float(np.std(one)), 1e-300) for one in (travel, speed))
    return np.column_stack([d, v, d * d, v * v, d * np.abs(d), v * np.abs(v)])


def _basis(parts: Sequence[Floats]) -> Floats:
    """An orthonormal basis of some terms about their means, (N, up to the number of terms)."""
    terms = np.concatenate(parts, axis=1)
    left, sizes, _ = np.linalg.svd(terms - terms.mean(axis=0), full_matrices=False)
    return np.asarray(left[:, sizes > 1e-9 * max(float(sizes[0]), 1e-300)])


def _explained(basis: Floats, load: Floats) -> float:
    """The share of the variance of a load that a basis explains."""
    size = float(load @ load)
    part = basis.T @ load
    return float(part @ part) / size if size > 0.0 else 0.0
