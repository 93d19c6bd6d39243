"""Which elements might be missing, and the first values of each within what the data span."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

from identification.physical.elements import CATALOGUE
from identification.physical.model import Element, Model, element
from identification.record import Record
from identification.scales import Scales

Limits = Callable[[Scales], Mapping[str, tuple[float, float]]]

# A shape outside of what the data span can't be seen in them: there the element is another one, or none. A curve
# steeper than the slow speeds is friction.
_LIMITS: Final[Mapping[str, Limits]] = {
    "arctan_damping": lambda s: {"S": (0.2 / s.v_rms, 3.0 / s.speeds[0])},
    "tanh_hysteresis": lambda s: {"beta": (0.2 / s.v_rms, 3.0 / s.speeds[0])},
    "valve_damping": lambda s: {"w_knee": (0.1 * s.speeds[0], 30.0 * s.v_rms)},
    "relief_valve": lambda s: {"w_knee": (0.2 * s.speeds[0], 0.95 * s.v_max)},
    "stribeck_friction": lambda s: {"w_s": (0.02 * s.speeds[0], s.speeds[3])},
    "presliding_friction": lambda s: {"sigma": (0.1 * s.gap / s.x_rms, 1e4 * s.force / s.x_rms)},
    "bouc_wen": lambda s: {"n": (1.0, 4.0), "gamma": (0.0, math.inf)},
    "gas_spring": lambda s: {"length": (1.02 * s.x_max, 30.0 * s.x_max), "n": (0.5, 3.0)},
    "end_stop": lambda s: {"z_max": (0.05 * s.x_max, s.x_max)},
    "reversal_force_lag": lambda s: {"length": (1e-6 * s.x_rms, 5.0 * s.x_rms)},
    "series_compliance": lambda s: {"k": (0.2 * s.force / s.x_rms, 1e5 * s.force / s.x_rms)},
    "free_play": lambda s: {"gap": (1e-5 * s.x_rms, 2.0 * s.x_rms)},
    "control_saturation": lambda s: {"i_s": (0.1 * s.current_high, 30.0 * s.current_high)},
    "control_hysteresis": lambda s: {"h": (0.0, s.current_high - s.current_low)},
    "control_lag": lambda s: {"tau": (0.0, 0.5 * s.duration)},
    "control_delay": lambda s: {"tau": (0.0, 0.1 * s.duration)},
    "force_delay": lambda s: {"tau": (0.0, 2.0 * s.motion_time)},
}

_HELD: Final[Mapping[str, tuple[str, ...]]] = {"bouc_wen": ("A",)}  # alpha and A only ever act as a product


def guesses(name: str, scales: Scales) -> list[Element]:
    """Elements of one name with first values worth trying, each shape limited to what the data span."""
    limits, starts = _LIMITS[name](scales) if name in _LIMITS else {}, CATALOGUE[name].starts
    assert starts is not None, name  # what may be named has some
    return [_limited(element(name, values, _HELD.get(name, ())), limits) for values in starts(scales)]


def falling_from(friction: Element, scales: Scales) -> list[Element]:
    """Stribeck curves that start as high as a Coulomb friction that fits, and build up over the same velocity."""
    level, limits = friction.value("f_c"), _LIMITS["stribeck_friction"](scales)
    (build_up,) = (p for s, p in zip(friction.spec.parameters, friction.parameters, strict=True) if s.name == "w_r")
    curves = []
    for w in scales.speeds[:3]:
        values = {"f_c": 0.8 * level, "f_s": 1.1 * level, "w_s": w}
        curve = _limited(element("stribeck_friction", values), limits)
        pairs = zip(curve.spec.parameters, curve.parameters, strict=True)
        curves.append(Element(curve.name, tuple(build_up if s.name == "w_r" else p for s, p in pairs)))
    return curves


def _limited(e: Element, limits: Mapping[str, tuple[float, float]]) -> Element:
    parameters = []
    for spec, p in zip(e.spec.parameters, e.parameters, strict=True):
        if spec.name in limits:
            low, high = limits[spec.name]
            p = replace(p, value=min(max(p.value, low), high), low=low, high=high)
        parameters.append(p)
    return Element(e.name, tuple(parameters))


def unlimited(e: Element) -> Element:
    """The element without the limits that only the search needed."""
    return Element(e.name, tuple(replace(p, low=None, high=None) for p in e.parameters))


def admissible(model: Model, records: Sequence[Record], scales: Scales) -> list[str]:
    """Names that might be added to `model` and that these records could show at all.

    Left out: what the model has, what acts on a current or a temperature that does not vary, and an offset beside
    a free F2, which is the same thing; on top of a foreign simulation all that changes its inside. Mains hum has a
    search of its own, in the time between the lines.
    """
    names = []
    foreign = any(r.simulated is not None for r in records)  # whose inside nobody can reach
    current = any(r.has_current for r in records) and scales.current_high > scales.current_low
    for name, spec in CATALOGUE.items():
        taken = name == "mains_hum" or any(e.name == name and not _idle(e) for e in model.elements)
        blind = spec.needs_current and not (current and (name == "valve_damping" or model.needs_current))
        cold = name == "temperature_fade" and not _temperature_varies(records)
        offset = name == "force_offset" and _free_offset(model)
        out_of_reach = foreign and (spec.path in ("mount", "control") or spec.modifier or name == "force_delay")
        if spec.nameable and not (taken or blind or cold or offset or out_of_reach):
            names.append(name)
    return names


def _idle(e: Element) -> bool:
    return all(p.fixed and p.value == 0.0 for p in e.parameters)


def _temperature_varies(records: Sequence[Record]) -> bool:
    values = [r.motion.temperature for r in records if r.has_temperature]
    return bool(values) and max(v.max() for v in values) - min(v.min() for v in values) > 1.0


def _free_offset(model: Model) -> bool:
    arctan = [e for e in model.elements if e.name == "arctan_damping"]
    return any(not e.parameters[e.spec.index("F2")].fixed for e in arctan)
