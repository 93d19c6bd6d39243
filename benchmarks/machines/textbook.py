"""What a name of the catalogue would add to a force, to first order: columns for a linear fit of its strength.

They decide which other names could stand for a hidden effect in the runs of a case. The forms are those of the contract
of the model file; the machines themselves have none of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmarks.machines.bases import CURVES, Base, Seen, force_of_base, slope_of_base
from benchmarks.machines.laws import compiled

Row = NDArray[np.float64]
Columns = NDArray[np.float64]  # (samples, strengths of one name)


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Where a name is added: a run, the force without the effect, the refitted base; largest values of all runs."""

    seen: Seen
    force: Row
    base: Base
    stroke_m: float
    speed_m_s: float
    current_a: float

    @property
    def dt(self) -> float:
        """The sample interval, s."""
        return float(self.seen.t[1] - self.seen.t[0])

    @property
    def lost(self) -> Row:
        """The base's dissipative part, N."""
        return force_of_base(self.base, self.seen, CURVES)


def _slope(setting: Setting, name: str, step: float) -> Row:
    return slope_of_base(setting.base, setting.seen, name, step)


@compiled
def _stuck(x, travel):  # type: ignore[no-untyped-def]
    """A spring that yields at ±1 after a travel."""
    out, state = np.zeros(x.size), 0.0
    for n in range(1, x.size):
        state = min(1.0, max(-1.0, state + (x[n] - x[n - 1]) / travel))
        out[n] = state
    return out


@compiled
def _sliding(x, v, dt, travel):  # type: ignore[no-untyped-def]
    """Friction that is a spring before it slides: df/dx = (1 − sgn(dx)·f)/travel, exact for each piece of the path.

    Between samples the path is the cubic of their displacements and speeds: it turns where the motion turns.
    """
    out, state, pieces = np.zeros(x.size), 0.0, 16
    for n in range(1, x.size):
        last = x[n - 1]
        for m in range(1, pieces + 1):
            s = m / pieces
            low, high = s * (1.0 - s) ** 2, s * s * (1.0 - s)
            rise = s * s * (3.0 - 2.0 * s)
            now = x[n - 1] + rise * (x[n] - x[n - 1]) + dt * (low * v[n - 1] - high * v[n])
            step = (now - last) / travel
            side = 1.0 if step > 0.0 else -1.0
            state = side + (state - side) * np.exp(-abs(step))
            last = now
        out[n] = state
    return out


def _giving_way(x: Row, travel: float) -> Row:
    """The same of springs that yield one after the other, as they do where the whole yields by e^−x of its travel."""
    travels = -np.log1p(-(np.arange(16) + 0.5) / 16)
    return sum((w * _stuck(x, w * travel) for w in travels), np.zeros(x.size)) / float(np.sum(travels))


def _since_reversal(s: Setting) -> Row:
    """Travel since the speed last changed its sign, m."""
    x, v = s.seen.x, s.seen.v
    turned = np.diff(np.sign(v), prepend=np.sign(v[0])) != 0
    last = np.maximum.accumulate(np.where(turned, np.arange(v.size), 0))
    return np.abs(x - x[last])


def _one(*rows: Row) -> Columns:
    return np.column_stack(rows)


def _lagged(row: Row, tau: float, dt: float) -> Row:
    keep = np.exp(-dt / tau)
    out, _ = lfilter([1.0 - keep], [1.0, -keep], row, zi=[keep * row[0]])
    return np.asarray(out)


def _by_current(s: Setting) -> Row:
    return _slope(s, "i", 1e-3 * max(s.current_a, 1e-9))


def _force_delay(s: Setting) -> list[Columns]:
    at = np.arange(s.force.size, dtype=np.float64)
    return [_one(np.interp(at - q, at, s.force) - s.force) for q in (0.3, 1.0, 2.0, 4.0, 8.0)]


@compiled
def _yielded(force, by_v, by_x, k, dt):  # type: ignore[no-untyped-def]
    """The force behind a spring k: F + by_v·(dF/dt)/k + by_x·F/k = f, exact for straight pieces of f, a steady lag."""
    out, state = np.zeros(force.size), force[0]
    for n in range(1, force.size):
        soft = 1.0 + max(by_x[n], 0.0) / k
        lag = max(by_v[n], 1e-12 * k * dt) / (k * dt * soft)  # in samples
        keep, begin, end = np.exp(-1.0 / lag), force[n - 1] / soft, force[n] / soft
        state = end - (end - begin) * lag * (1.0 - keep) + keep * (state - begin)
        out[n] = state
    return out


def _series(s: Setting) -> list[Columns]:
    """To first order; and between two springs that yield by a part of the stroke, as the base's own slopes let them."""
    by_v, by_x = _slope(s, "v", 1e-4 * s.speed_m_s), _slope(s, "x", 1e-4 * s.stroke_m)
    level = float(np.sqrt(np.mean(s.force**2)))
    springs = [level / (q * s.stroke_m) for q in (0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.2)] if level > 0.0 else []
    rows = [_yielded(s.force, by_v, by_x, k, s.dt) - s.force for k in springs]
    first = _one(-by_v * np.gradient(s.force, s.dt) - by_x * s.force)
    return [first, *(_one(one, other) for one, other in pairwise(rows))]


def _play(s: Setting) -> list[Columns]:
    level = float(np.sqrt(np.mean(s.force**2)))
    slope = np.gradient(s.force, s.dt)
    return [
        _one(-_slope(s, "v", 1e-4 * s.speed_m_s) * np.exp(-((s.force / (q * level)) ** 2)) * np.abs(slope) / level)
        for q in (0.05, 0.15)
    ]


def _bubbles(s: Setting) -> list[Columns]:
    """Air that the force compresses: the deflection of the base's own slopes, q of the level where it is half gone."""
    level = float(np.sqrt(np.mean(s.force**2)))
    slope = np.gradient(s.force, s.dt)
    return [
        _one(-_slope(s, "v", 1e-4 * s.speed_m_s) * slope / (1.0 + np.abs(s.force) / (q * level)) ** 2)
        for q in (0.03, 0.1, 0.3, 1.0)
    ]


def _relief(s: Setting) -> list[Columns]:
    v = s.seen.v
    return [
        _one(np.sign(v) * np.maximum(np.abs(v) - q * s.speed_m_s, 0.0))
        for q in (0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.55, 0.7)
    ]


def _hysteresis(s: Setting) -> list[Columns]:
    return [_one(_sliding(s.seen.x, s.seen.v, s.dt, q * s.stroke_m)) for q in (0.01, 0.03, 0.1, 0.3, 0.8)]


def _gas(s: Setting) -> list[Columns]:
    volumes = [1.0 + s.seen.x / (q * s.stroke_m) for q in (1.3, 1.8, 2.5, 4.0, 8.0, 20.0)]
    return [_one(np.maximum(volume, 0.1) ** -n) for volume in volumes for n in (1.0, 1.4)]


def _stop(s: Setting) -> list[Columns]:
    x = s.seen.x
    return [
        _one(np.maximum(x - q * s.stroke_m, 0.0) - np.maximum(-x - q * s.stroke_m, 0.0))
        for q in (0.3, 0.45, 0.6, 0.7, 0.8, 0.9)
    ]


def _shaped(s: Setting) -> list[Columns]:
    """Curves with a knee."""
    v = s.seen.v
    return [_one(np.arctan(v / (q * s.speed_m_s)), v) for q in (0.01, 0.03, 0.07, 0.15, 0.3, 0.6)]


def _bent(s: Setting) -> list[Columns]:
    v, i = s.seen.v, s.seen.i
    return [
        _one(*(row * v / np.sqrt(1.0 + (v / (q * s.speed_m_s)) ** 2) for row in _with_current(s, i)))
        for q in (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)
    ]


def _pieces(s: Setting) -> list[Columns]:
    v = s.seen.v
    knees = [q * s.speed_m_s for q in (0.03, 0.07, 0.15, 0.3, 0.5)]
    return [_one(np.clip(v, -knee, knee), v - np.clip(v, -knee, knee)) for knee in knees]


def _yielding(s: Setting) -> list[Columns]:
    v, x, i = s.seen.v, s.seen.x, s.seen.i
    return [
        _one(*(row * np.tanh(v / (q * s.speed_m_s) + d * np.sign(x)) for row in _with_current(s, i)))
        for q in (0.01, 0.03, 0.08, 0.2)
        for d in (0.0, 0.3)
    ]


def _with_current(s: Setting, i: Row) -> list[Row]:
    return [np.ones(i.size), i] if s.current_a > 0.0 else [np.ones(i.size)]


def _saturated(s: Setting) -> list[Columns]:
    i, top = s.seen.i, s.current_a
    return [_one(_by_current(s) * (q * top * np.tanh(i / (q * top)) - i)) for q in (0.4, 0.6, 0.9, 1.4)]


def _late_current(s: Setting) -> list[Columns]:
    i = s.seen.i
    return [
        _one(_by_current(s) * (np.concatenate([np.full(n, i[0]), i[:-n]]) - i))
        for n in (max(1, round(q / s.dt)) for q in (0.003, 0.006, 0.012, 0.025, 0.05))
    ]


def _lag_of_current(s: Setting) -> list[Columns]:
    return [_one(_by_current(s) * (_lagged(s.seen.i, q, s.dt) - s.seen.i)) for q in (0.004, 0.01, 0.02, 0.04, 0.08)]


def _remanence(s: Setting) -> list[Columns]:
    i = s.seen.i
    return [
        _one(_by_current(s) * (-0.5 * q * s.current_a * _stuck(i, 0.5 * q * s.current_a))) for q in (0.03, 0.08, 0.2)
    ]


def _breakaway(s: Setting) -> list[Columns]:
    v = s.seen.v
    return [
        _one(np.sign(v), np.sign(v) * np.exp(-((v / (q * s.speed_m_s)) ** 2))) for q in (0.01, 0.02, 0.05, 0.1, 0.2)
    ]


def _bristles(s: Setting) -> list[Columns]:
    v = s.seen.v
    built_up = [_sliding(s.seen.x, s.seen.v, s.dt, q * s.stroke_m) for q in (0.00003, 0.0003, 0.001, 0.01)]
    return [
        _one(force, force * np.exp(-((v / (q * s.speed_m_s)) ** 2)))
        for force in built_up
        for q in (0.01, 0.02, 0.05, 0.1)
    ]


def _hum(s: Setting) -> list[Columns]:
    return [
        _one(np.sin(2 * np.pi * f * s.seen.t), np.cos(2 * np.pi * f * s.seen.t)) for f in (50.0, 60.0) if f < 0.5 / s.dt
    ]


def _zones(s: Setting) -> list[Columns]:
    return [_one(s.lost * s.seen.x**2)]


ADDED: Mapping[str, Callable[[Setting], list[Columns]]] = {
    "viscous_damping": lambda s: [_one(*(row * s.seen.v for row in _with_current(s, s.seen.i)))],
    "quadratic_damping": lambda s: [_one(s.seen.v * np.abs(s.seen.v))],
    "damping_asymmetry": lambda s: [_one(np.abs(s.seen.v))],
    "relief_valve": _relief,
    "arctan_damping": _shaped,
    "valve_damping": _bent,
    "piecewise_linear_damping": _pieces,
    "tanh_hysteresis": _yielding,
    "bouc_wen": _hysteresis,
    "presliding_friction": lambda s: [
        *(
            _one(_sliding(s.seen.x, s.seen.v, s.dt, q * s.stroke_m))
            for q in (0.00003, 0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1)
        ),
        *(_one(_giving_way(s.seen.x, q * s.stroke_m)) for q in (0.003, 0.01, 0.03, 0.1)),
    ],
    "coulomb_friction": lambda s: [_one(np.sign(s.seen.v))],
    "stribeck_friction": _breakaway,
    "lugre_friction": _bristles,
    "linear_stiffness": lambda s: [_one(s.seen.x)],
    "cubic_stiffness": lambda s: [_one(s.seen.x**3)],
    "gas_spring": _gas,
    "end_stop": _stop,
    "position_dependent_damping": _zones,
    "temperature_fade": lambda s: [
        _one(s.lost * np.expm1(-q * (s.seen.warm - 25.0))) for q in (0.002, 0.006, 0.012, 0.025)
    ],
    "reversal_force_lag": lambda s: [
        _one(-s.lost * np.exp(-_since_reversal(s) / (q * s.stroke_m))) for q in (0.005, 0.015, 0.04, 0.1, 0.2)
    ],
    "series_compliance": _series,
    "free_play": _play,
    "aerated_oil": _bubbles,
    "control_lag": _lag_of_current,
    "control_delay": _late_current,
    "control_saturation": _saturated,
    "control_hysteresis": _remanence,
    "force_delay": _force_delay,
    "force_offset": lambda s: [_one(np.ones(s.seen.x.size))],
    "moving_mass": lambda s: [_one(s.seen.a)],
    "force_drift": lambda s: [_one(s.seen.t)],
    "mains_hum": _hum,
}
