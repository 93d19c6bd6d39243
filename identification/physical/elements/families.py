"""Families of dampers: the elements of each with start values, scaled to a force at a speed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import atan, pi, sqrt
from typing import Final

from identification.physical.elements.compositions import Rows

_STEEP = 8.0  # S·v of a saturating damper at the given speed: its knee lies at an eighth of it
_SATURATED = 0.6  # share of the force that the valve holds; the rest grows with speed
_KNEE = 1 / 6  # of the given speed: where a side bends
_SHARE = 0.25  # slope beyond the knee over that at rest
_COMPRESSION = 1 / 3  # of the rebound force, as dampers of vehicles have
_FRICTION, _GAS = 0.03, 0.1  # of the force
_GAS_LENGTH_M = 0.3  # a gas column of a monotube damper
_BUSH_M = 2e-3  # what the mount of a yaw damper gives under the force
_OPEN, _BLOW = 0.3, 0.8  # of the force: where a shim stack and where its blow-off opens
_BLEEDS, _BENDS, _BLOWS = 0.4, 0.5, 0.1  # of the flow at the force: through bleed, shim stack and blow-off


@dataclass(frozen=True, slots=True, kw_only=True)
class DamperFamily:
    """What it is, and its elements for a force, N, at a speed, m/s, between two currents, A."""

    text: str
    controlled: bool
    rows: Callable[[float, float, float, float], Rows]


def sided(force: float, speed: float) -> dict[str, float]:
    """Parameters of a curve for each side that passes the force at the speed in rebound."""
    bend = _SHARE + (1.0 - _SHARE) / sqrt(1.0 + _KNEE**-2)
    c, knee = force / speed / bend, _KNEE * speed
    return {"c_r": c, "w_r": knee, "c_c": _COMPRESSION * c, "w_c": knee, "share": _SHARE}


def _saturating(force: float, speed: float) -> dict[str, float]:
    held = _SATURATED * force * 2.0 / pi * atan(_STEEP)
    return {"F1": _SATURATED * force, "S": _STEEP / speed, "d": (force - held) / speed, "F2": 0.0}


def _shims(force: float, speed: float) -> dict[str, float]:
    return {
        "q": force / (_BLEEDS * speed) ** 2,
        "f_open": _OPEN * force, "c_shim": (1.0 - _OPEN) * force / (_BENDS * speed),
        "f_blow": _BLOW * force, "c_blow": (1.0 - _BLOW) * force / (_BLOWS * speed),
    }  # fmt: skip


def _semi_active(force: float, speed: float, low: float, high: float) -> Rows:
    c = force / speed * sqrt(5.0)  # with the knee at half the speed
    valve = {"c_soft": c / 4.0, "c_firm": c, "u_soft": low, "u_firm": high, "w_knee": speed / 2.0}
    return [("control_lag", {"tau": 0.01}), ("valve_damping", valve)]


def _magneto_rheological(force: float, speed: float, low: float, high: float) -> Rows:
    alpha = {"alpha": 0.1 * force, "alpha_control": 0.6 * force / (high - low), "beta": _STEEP / speed, "delta": 0.3}
    return [("viscous_damping", {"c": 0.3 * force / speed}), ("tanh_hysteresis", alpha), ("force_offset", {"F0": 0.0})]


FAMILIES: Final[Mapping[str, DamperFamily]] = {
    "linear": DamperFamily(
        text="force in proportion to speed", controlled=False,
        rows=lambda f, v, *_: [("viscous_damping", {"c": f / v})],
    ),
    "digressive": DamperFamily(
        text="a valve that saturates, the same in both directions", controlled=False,
        rows=lambda f, v, *_: [("arctan_damping", _saturating(f, v))],
    ),
    "twin-tube": DamperFamily(
        text="rebound three times as firm as compression, dry friction", controlled=False,
        rows=lambda f, v, *_: [
            ("rebound_compression_damping", sided(f, v)), ("coulomb_friction", {"f_c": _FRICTION * f}),
        ],
    ),
    "monotube": DamperFamily(
        text="rebound three times as firm as compression, dry friction, a gas spring", controlled=False,
        rows=lambda f, v, *_: [
            ("rebound_compression_damping", sided(f, v)), ("coulomb_friction", {"f_c": _FRICTION * f}),
            ("gas_spring", {"f0": _GAS * f, "length": _GAS_LENGTH_M, "n": 1.3}),
        ],
    ),
    "shim-stack": DamperFamily(
        text="a bleed beside a shim stack and a blow-off, dry friction, a gas spring", controlled=False,
        rows=lambda f, v, *_: [
            ("shim_stack_damping", _shims(f, v)), ("coulomb_friction", {"f_c": _FRICTION * f}),
            ("gas_spring", {"f0": _GAS * f, "length": _GAS_LENGTH_M, "n": 1.3}),
        ],
    ),
    "eddy-current": DamperFamily(
        text="a magnet that passes a conductor, its force highest at the given speed", controlled=False,
        rows=lambda f, v, *_: [("eddy_current_damping", {"f_peak": f, "w_peak": v})],
    ),
    "yaw": DamperFamily(
        text="railway: a saturating valve behind a bush", controlled=False,
        rows=lambda f, v, *_: [
            ("series_compliance", {"k": f / _BUSH_M, "c": 0.0}), ("arctan_damping", _saturating(f, v)),
        ],
    ),
    "semi-active": DamperFamily(
        text="a valve set by a current, firmest at the higher one", controlled=True, rows=_semi_active
    ),
    "mr": DamperFamily(
        text="magneto-rheological: a yield force that grows with the current", controlled=True,
        rows=_magneto_rheological,
    ),
}  # fmt: skip
"""Every family by its name."""


def measured(
    sides: tuple[tuple[float, float, float], tuple[float, float, float]], friction: float, k: float, offset: float
) -> Rows:
    """A passive damper as a sheet found it: c, w_knee and c_far of each side, and its forces at rest."""
    (c_r, w_r, far_r), (c_c, w_c, far_c) = sides
    share = min(max((far_r + far_c) / max(c_r + c_c, 1e-12), 0.0), 1.0)  # one for both sides
    curve = {"c_r": c_r, "w_r": w_r, "c_c": c_c, "w_c": w_c, "share": share}
    rows = [("rebound_compression_damping", curve), ("force_offset", {"F0": offset})]
    rows += [("coulomb_friction", {"f_c": friction})] if friction > 0.0 else []
    return [*rows, *([("linear_stiffness", {"k": k})] if k > 0.0 else [])]
