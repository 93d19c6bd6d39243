"""The library of terms that sparse regression is given: every effect of the catalogue that is a formula
of the measured channels, and to first order in its strength where it is inside the machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record

Floats = NDArray[np.float64]


def library(model: Model, records: Sequence[Record]) -> tuple[list[tuple[str, str]], list[Floats]]:
    """(effect, term) of every column, and the columns (M, K) of each record.

    Speeds, strokes and levels in a term are shares of the largest in the records, so that units do not matter.
    """
    scale = _scales(records)
    columns = [_columns(model, record, scale) for record in records]
    names = [name for name in columns[0] if all(np.any(c[name] != 0.0) for c in columns[:1])]
    names = [n for n in names if any(np.ptp(c[n]) > 0.0 or n[0] == "force_offset" for c in columns)]
    return names, [np.column_stack([c[n] for n in names]) for c in columns]


def _scales(records: Sequence[Record]) -> Mapping[str, float]:
    def most(of: Callable[[Record], Floats]) -> float:
        return max(float(np.max(np.abs(of(r)[r.window]))) for r in records) or 1.0

    return {"x": most(lambda r: r.motion.x), "v": most(lambda r: r.motion.v), "i": most(lambda r: r.motion.i)}


def _columns(model: Model, record: Record, scale: Mapping[str, float]) -> dict[tuple[str, str], Floats]:
    m, w = record.motion, record.window
    x, v, a, i = (row[w] for row in (m.x, m.v, m.a, m.i))
    warm, t = m.temperature[w] - 25.0, m.t[w]
    base = predict(model, record)[0]
    out = {**_parallel(x, v, a, i, scale), **_sensor(base, a, t, m.dt), **_inside(base, x, v, warm, scale, m.dt)}
    if record.has_current:
        out |= _control(model, record, i, m.dt)
    return out


def _parallel(x: Floats, v: Floats, a: Floats, i: Floats, scale: Mapping[str, float]) -> dict[tuple[str, str], Floats]:
    """Terms of displacement, speed and current that are added to the base."""
    sign, slow = np.tanh(v / (0.01 * scale["v"])), np.tanh(v / (0.1 * scale["v"]))
    out = {
        ("viscous_damping", "v"): v,
        ("viscous_damping", "i·v"): i * v,
        ("quadratic_damping", "v·|v|"): v * np.abs(v),
        ("damping_asymmetry", "|v|"): np.abs(v),
        ("linear_stiffness", "x"): x,
        ("cubic_stiffness", "x³"): x**3,
        ("gas_spring", "x²"): x**2,
        ("coulomb_friction", "sgn v"): sign,
        ("arctan_damping", "tanh v"): slow,
        ("tanh_hysteresis", "tanh(v + sgn x)"): np.tanh((v + 0.1 * scale["v"] * np.sign(x)) / (0.1 * scale["v"])),
        ("tanh_hysteresis", "i·tanh v"): i * slow,
        ("bouc_wen", "hysteresis of x"): _hysteresis(x, v, 0.1 * scale["x"], smooth=True),
        ("presliding_friction", "hysteresis of x"): _hysteresis(x, v, 0.03 * scale["x"], smooth=False),
    }
    for share in (0.02, 0.06):
        out["stribeck_friction", f"sgn v below {share:g} of full speed"] = sign * np.exp(
            -((v / (share * scale["v"])) ** 2)
        )
    for share in (0.3, 0.5, 0.7):
        beyond = np.maximum(np.abs(v) - share * scale["v"], 0.0)
        out["relief_valve", f"v beyond {share:g} of full speed"] = np.sign(v) * beyond
    for share in (0.6, 0.75, 0.9):
        out["end_stop", f"x beyond {share:g} of full stroke"] = np.sign(x) * np.maximum(
            np.abs(x) - share * scale["x"], 0.0
        )
    return out


def _hysteresis(x: Floats, v: Floats, length: float, *, smooth: bool) -> Floats:
    """A spring of length `length` that slides (Dahl), or yields smoothly (Bouc–Wen with n = 2), in −1 … 1."""
    h = np.empty(x.size)
    state = float(np.sign(v[0]))
    for k, step in enumerate(np.diff(x, prepend=x[0]) / length):
        state += step * (1.0 - np.sign(step) * state * (abs(state) if smooth else 1.0))
        state = min(1.0, max(-1.0, state))
        h[k] = state
    return h


def _sensor(base: Floats, a: Floats, t: Floats, dt: float) -> dict[tuple[str, str], Floats]:
    out = {
        ("force_delay", "dF/dt"): np.gradient(base, dt),
        ("force_offset", "1"): np.ones(base.size),
        ("moving_mass", "a"): a,
        ("force_drift", "t"): t - float(np.mean(t)),
    }
    for frequency in (50.0, 60.0):
        for name, wave in (("sin", np.sin), ("cos", np.cos)):
            out["mains_hum", f"{name} of {frequency:g} Hz"] = wave(2 * np.pi * frequency * t)
    return out


def _inside(
    base: Floats, x: Floats, v: Floats, warm: Floats, scale: Mapping[str, float], dt: float
) -> dict[tuple[str, str], Floats]:
    """Terms that modify the base or its input, to first order."""
    slope = np.gradient(base, dt)
    turned = np.maximum.accumulate(np.where(np.diff(np.sign(v), prepend=np.sign(v[0])) != 0, np.arange(v.size), 0))
    since = np.abs(x - x[turned])
    stiffness = (
        np.gradient(base) * np.gradient(v) / np.maximum(np.gradient(v) ** 2, 1e-6 * np.mean(np.gradient(v) ** 2))
    )
    out = {
        ("position_dependent_damping", "F·x²"): base * x**2,
        ("temperature_fade", "F·ΔT"): base * warm,
        ("series_compliance", "dF/dv·dF/dt"): stiffness * slope,
        ("free_play", "F changes its sign"): np.exp(-((base / (0.1 * np.std(base) + 1e-300)) ** 2)) * np.sign(slope),
    }
    for share in (0.03, 0.1):
        out["reversal_force_lag", f"F within {share:g} of the stroke after a reversal"] = base * np.exp(
            -since / (share * scale["x"])
        )
    return out


def _control(model: Model, record: Record, i: Floats, dt: float) -> dict[tuple[str, str], Floats]:
    """Terms of the control path: the base's derivative by the current, times the change of the current."""
    by_current = _by_current(model, record)
    rate = np.gradient(i, dt)
    return {
        ("control_lag", "dF/di·di/dt"): by_current * rate,
        ("control_delay", "dF/di·jump"): by_current * (i - np.concatenate([np.full(5, i[0]), i[:-5]])),
        ("control_saturation", "dF/di·i³"): by_current * i**3,
        ("control_hysteresis", "dF/di·sgn(di/dt)"): by_current * _last_sign(rate),
    }


def _by_current(model: Model, record: Record) -> Floats:
    from dataclasses import replace

    step = 0.01 * float(np.ptp(record.motion.i) or 1.0)
    more = replace(record, motion=replace(record.motion, i=record.motion.i + step))
    return np.asarray((predict(model, more)[0] - predict(model, record)[0]) / step)


def _last_sign(rate: Floats) -> Floats:
    moved = np.abs(rate) > 1e-3 * np.max(np.abs(rate), initial=1e-300)
    last = np.maximum.accumulate(np.where(moved, np.arange(rate.size), 0))
    return np.asarray(np.sign(rate[last]))
