"""The given models: a few elements of the contract that are plainly too simple, and the generator's own fit of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Row = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """What a model is given of a run, and the force that it should have: rows at the instants of the record."""

    x: Row
    v: Row
    a: Row
    i: Row
    warm: Row
    t: Row
    moving: Row  # bool: at rest friction can hold any force, so no fit looks there
    force: Row

    def picked(self, most: int) -> NDArray[np.intp]:
        """At most about `most` of the samples in motion."""
        at = np.flatnonzero(self.moving)
        return at[:: max(1, -(-at.size // most))]

    def at(self, samples: NDArray[np.intp]) -> Seen:
        """Some samples of it."""
        return Seen(**{name: getattr(self, name)[samples] for name in self.__slots__})


def joined(runs: Sequence[Seen]) -> Seen:
    """Several runs as one."""
    return Seen(**{name: np.concatenate([getattr(r, name) for r in runs]) for name in Seen.__slots__})


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseElement:
    """One element of a given model with its numbers; `held` are not fitted."""

    path: str
    element: str
    values: Mapping[str, float]
    held: frozenset[str] = field(default_factory=frozenset)


Base = tuple[BaseElement, ...]


def _viscous(p: Mapping[str, float], m: Seen) -> Row:
    return np.asarray((p["c"] + p["c_control"] * m.i) * m.v)


def _arctan(p: Mapping[str, float], m: Seen) -> Row:
    return np.asarray(p["F1"] * 2.0 / np.pi * np.arctan(p["S"] * m.v) + p["d"] * m.v + p["F2"])


def _piecewise(p: Mapping[str, float], m: Seen) -> Row:
    knee = p["f_r"] / p["c1"]
    return np.asarray(p["c1"] * np.clip(m.v, -knee, knee) + p["c2"] * (m.v - np.clip(m.v, -knee, knee)))


def _valve(p: Mapping[str, float], m: Seen) -> Row:
    share = np.clip((m.i - p["u_soft"]) / (p["u_firm"] - p["u_soft"]), 0.0, 1.0)
    c = p["c_soft"] + (p["c_firm"] - p["c_soft"]) * share
    return np.asarray(c * m.v / np.sqrt(1.0 + (m.v / p["w_knee"]) ** 2))


def _tanh(p: Mapping[str, float], m: Seen) -> Row:
    return np.asarray((p["alpha"] + p["alpha_control"] * m.i) * np.tanh(p["beta"] * m.v + p["delta"] * np.sign(m.x)))


FORCES: Mapping[str, Callable[[Mapping[str, float], Seen], Row]] = {
    "viscous_damping": _viscous,
    "arctan_damping": _arctan,
    "piecewise_linear_damping": _piecewise,
    "valve_damping": _valve,
    "tanh_hysteresis": _tanh,
    "linear_stiffness": lambda p, m: p["k"] * m.x,
    "force_offset": lambda p, m: np.full(m.x.size, p["F0"]),
    "moving_mass": lambda p, m: p["m"] * m.a,
}
CURVES = frozenset(
    ("viscous_damping", "arctan_damping", "piecewise_linear_damping", "valve_damping", "tanh_hysteresis")
)


def force_of_base(base: Base, seen: Seen, only: frozenset[str] | None = None) -> Row:
    """Force of the base, or of some of its elements, N."""
    total = np.zeros(seen.x.size)
    for e in base:
        if only is None or e.element in only:
            total = total + FORCES[e.element](e.values, seen)
    return total


def slope_of_base(base: Base, seen: Seen, name: str, step: float) -> Row:
    """Change of the base's force with one of its inputs, over ± a step."""
    rows = {n: getattr(seen, n) for n in Seen.__slots__}
    up, down = ({**rows, name: rows[name] + sign * step} for sign in (1.0, -1.0))
    return np.asarray((force_of_base(base, Seen(**up)) - force_of_base(base, Seen(**down))) / (2.0 * step))


def places(base: Base) -> list[tuple[int, str]]:
    """The free parameters: number of the element, name."""
    return [(n, name) for n, e in enumerate(base) for name in e.values if name not in e.held]


def with_factors(base: Base, sizes: Row, factors: Row) -> Base:
    """The base with its free parameters at `factors` times their sizes."""
    values = [dict(e.values) for e in base]
    for (n, name), size, factor in zip(places(base), sizes, factors, strict=True):
        values[n][name] = float(size * factor)
    return tuple(replace(e, values=v) for e, v in zip(base, values, strict=True))


def _sizes(base: Base) -> Row:
    return np.array([base[n].values[name] or 1.0 for n, name in places(base)])


def refitted(base: Base, seen: Seen, most: Row | None = None) -> Base:
    """The base with its parameters at the least squares of the force; positive ones stay positive."""
    sizes = _sizes(base)
    signed = np.array([name in ("F0", "F2", "c_control", "alpha_control") for _, name in places(base)])
    low = np.where(signed, -50.0, 1e-3)
    scale = float(np.sqrt(np.mean(seen.force**2))) or 1.0

    def missed(factors: Row) -> Row:
        return np.asarray((force_of_base(with_factors(base, sizes, factors), seen) - seen.force) / scale)

    start = np.where(signed & np.array([base[n].values[name] == 0.0 for n, name in places(base)]), 0.0, 1.0)
    found = least_squares(missed, start, bounds=(low, np.full(sizes.size, 50.0)), xtol=1e-8, ftol=1e-8, max_nfev=60)
    return with_factors(base, sizes, found.x)


def tangents(base: Base, seen: Seen) -> NDArray[np.float64]:
    """Change of the force by a relative change of each free parameter, (samples, parameters)."""
    sizes, step = _sizes(base), 1e-4
    ones = np.ones(sizes.size)
    columns = []
    for k in range(sizes.size):
        up, down = ones.copy(), ones.copy()
        up[k] += step
        down[k] -= step
        difference = force_of_base(with_factors(base, sizes, up), seen) - force_of_base(
            with_factors(base, sizes, down), seen
        )
        columns.append(difference / (2.0 * step))
    return np.column_stack(columns) if columns else np.zeros((seen.x.size, 0))


def model_file(base: Base, rng: np.random.Generator, name: str) -> dict[str, object]:
    """The base as a model file, each free parameter off by up to a third."""
    paths: dict[str, list[dict[str, object]]] = {"mount": [], "control": [], "core": [], "sensor": []}
    for e in base:
        parameters: dict[str, object] = {}
        for parameter, value in e.values.items():
            if parameter in e.held:
                parameters[parameter] = {"value": value, "fixed": True}
            else:
                parameters[parameter] = float(f"{value * np.exp(rng.uniform(-0.29, 0.29)):.4g}")
        paths[e.path].append({"element": e.element, "parameters": parameters})
    return {"format": "damper-rig/model", "format_version": 1, "name": name, "kind": "physical", "paths": paths}
