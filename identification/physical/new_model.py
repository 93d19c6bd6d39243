"""A first model of a damper: of a family, scaled to a force at a speed, or of a characteristic sheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from identification.errors import ModelError
from identification.physical.elements.compositions import Rows, yielding
from identification.physical.elements.families import FAMILIES, measured
from identification.physical.model import Model, element

_STEEP = 3.0  # beta times the slowest speed of a sheet: there its tests are beyond the step of a yield force


def model_of_family(
    family: str, force_n: float, speed_m_s: float, current_a: tuple[float, float] | None = None
) -> Model:
    """The model of a family whose greatest force at this speed is this one. Raises ModelError."""
    found = FAMILIES.get(family)
    if found is None:
        raise ModelError(f"family is {family!r:.60}: it must be one of {', '.join(FAMILIES)}")
    for name, value, unit in (("force", force_n, "N"), ("speed", speed_m_s, "m/s")):
        if not (isfinite(value) and value > 0.0):
            raise ModelError(f"{name} is {value:g} {unit}: it must be above 0")
    if found.controlled and current_a is None:
        raise ModelError(f"family {family}: give its currents, for example --current 0.3 1.6")
    low, high = current_a or (0.0, 1.0)
    if not (isfinite(low) and isfinite(high) and high > low):
        raise ModelError(f"current is {low:g} … {high:g} A: it must rise")
    return _model(f"{family} damper, {force_n:g} N at {speed_m_s:g} m/s", found.rows(force_n, speed_m_s, low, high))


def model_of_sheet(sheet: Mapping[str, Any]) -> Model:  # Any: JSON
    """Start values for a fit, of the figures that `damper-rig characterise --json` prints. Raises ModelError."""
    if sheet.get("format") != "damper-rig/sheet":
        raise ModelError("no sheet: give what `damper-rig characterise --json` prints")
    try:
        groups, tests = list(sheet["currents"]), list(sheet["tests"])
        rows = _passive(groups[0], tests) if len(groups) == 1 else _controlled(groups, tests)
    except (KeyError, TypeError, IndexError, ValueError) as error:
        raise ModelError(f"a damaged sheet ({type(error).__name__} at {error}): print it again") from error
    return _model(f"{sheet.get('specimen') or 'damper'}, of its characteristic sheet", rows)


def _passive(group: Mapping[str, Any], tests: Sequence[Mapping[str, Any]]) -> Rows:
    friction, k = (_clear(group[name]) for name in ("friction", "stiffness"))
    offset, curve = float(group["force_at_rest"]["value"]), group["curve"]
    if curve is None:  # too few speeds for a curve: as far as the tests go, in proportion
        c = _slope(tests, friction)
        return measured(((c, 1.0, c), (c, 1.0, c)), friction, k, offset)
    rebound, compression = (
        (float(curve[side]["c"]["value"]), float(curve[side]["w_knee"]["value"]), float(curve[side]["c_far"]["value"]))
        for side in ("rebound", "compression")
    )
    return measured((rebound, compression), friction, k, offset)


def _controlled(groups: Sequence[Mapping[str, Any]], tests: Sequence[Mapping[str, Any]]) -> Rows:
    """A yield force and a damping, each a line over the current."""
    current = np.array([float(group["current"]) for group in groups])
    own = [[t for t in tests if abs(float(t["current"]) - i) < np.ptp(current) / 20 + 0.02] for i in current]
    slopes, yields = np.array([_line(some) for some in own]).T
    (gain_c, c), (gain_alpha, alpha) = (np.polyfit(current, values, 1).tolist() for values in (slopes, yields))
    rest = [(float(g["stiffness"]["value"]), float(g["force_at_rest"]["value"])) for g in groups]
    k, offset = np.median(rest, axis=0).tolist()
    beta = _STEEP / min(float(test["peak_velocity"]) for test in tests)
    return yielding(max(c, 0.0), max(alpha, 1.0), beta, max(k, 0.0), offset, {"c": gain_c, "alpha": gain_alpha})


def _clear(estimate: Mapping[str, Any]) -> float:
    """A value that is larger than its standard deviation, else nothing."""
    value, std = float(estimate["value"]), float(estimate["std"])
    return value if value > std else 0.0


def _line(tests: Sequence[Mapping[str, Any]]) -> tuple[float, float]:
    """Slope, N·s/m, and force at rest, N, of a line through the forces at peak speed, mean of both sides."""
    speed = np.array([float(test["peak_velocity"]) for test in tests])
    half = np.array([float(t["force_rebound"]) - float(t["force_compression"]) for t in tests]) / 2.0
    if np.ptp(speed) < 0.1 * speed.max():
        return 0.0, float(half.mean())
    slope, at_rest = np.polyfit(speed, half, 1).tolist()
    return slope, at_rest


def _slope(tests: Sequence[Mapping[str, Any]], friction: float) -> float:
    """Force beyond the friction over speed at the fastest test, mean of both sides, N·s/m."""
    fastest = max(tests, key=lambda test: float(test["peak_velocity"]))
    span = float(fastest["force_rebound"]) - float(fastest["force_compression"])
    return max((span / 2.0 - friction) / float(fastest["peak_velocity"]), 0.0)


def _model(name: str, rows: Rows) -> Model:
    return Model(name=name, elements=tuple(element(name, values) for name, values in rows))
