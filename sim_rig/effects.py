"""What can be hidden in a specimen: every element of the catalogue, and five effects outside it.

Size 1 should be visible in a good campaign; `random` draws sizes around it. The parameters scale with the
specimen's typical force, stroke and speed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from sim_rig.errors import SpecimenError
from sim_rig.parameters import Damper


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """Typical size of a specimen's force, stroke, speed and range of current."""

    force_n: float
    stroke_m: float
    speed_m_s: float
    current_a: float  # width of the range; 0 for a passive damper


Change = Callable[[Scale, float], dict[str, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One effect: its path, whether the catalogue has it, and the parameters that it sets for a size."""

    path: str
    change: Change
    listed: bool = True
    needs_current: bool = False


def _core(change: Change, *, listed: bool = True) -> Effect:
    return Effect(path="core", change=change, listed=listed)


def _control(change: Change, *, listed: bool = True) -> Effect:
    return Effect(path="control", change=change, listed=listed, needs_current=True)


def _sensor(change: Change) -> Effect:
    return Effect(path="sensor", change=change)


EFFECTS: Final[Mapping[str, Effect]] = {
    "viscous_damping": _core(lambda k, s: {"viscous": 0.15 * s * k.force_n / k.speed_m_s}),
    "arctan_damping": _core(lambda k, s: {"arctan_force": 0.15 * s * k.force_n, "arctan_slope": 25.0 / k.speed_m_s}),
    "piecewise_linear_damping": _core(
        lambda k, s: {
            "bilinear_force": 0.15 * s * k.force_n,
            "bilinear_c": 0.15 * s * k.force_n / (0.1 * k.speed_m_s),
        }
    ),
    "valve_damping": _core(
        lambda k, s: {
            "valve_soft": 0.15 * s * k.force_n / k.speed_m_s,
            "valve_firm": (0.45 if k.current_a else 0.15) * s * k.force_n / k.speed_m_s,
            "valve_knee": 0.3 * k.speed_m_s,
        }
    ),
    "quadratic_damping": _core(lambda k, s: {"quadratic": 0.3 * s * k.force_n / k.speed_m_s**2}),
    "relief_valve": _core(lambda k, s: {"relief": 0.4 * s * k.force_n / k.speed_m_s, "relief_knee": 0.4 * k.speed_m_s}),
    "damping_asymmetry": _core(lambda k, s: {"asymmetry": 0.2 * s * k.force_n / k.speed_m_s}),
    "tanh_hysteresis": _core(
        lambda k, s: {
            "tanh_force": 0.15 * s * k.force_n,
            "tanh_slope": 12.0 / k.speed_m_s,
            "tanh_shift": 0.6,
        }
    ),
    "bouc_wen": _core(lambda k, s: {"loop_force": 0.1 * s * k.force_n, "loop_travel": 0.08 * k.stroke_m}),
    "coulomb_friction": _core(lambda k, s: {"coulomb": 0.08 * s * k.force_n}),
    "stribeck_friction": _core(
        lambda k, s: {
            "stribeck": 0.05 * s * k.force_n,
            "stribeck_rise": 0.15 * s * k.force_n,
            "stribeck_speed": 0.06 * k.speed_m_s,
        }
    ),
    "presliding_friction": _core(
        lambda k, s: {"presliding": 0.1 * s * k.force_n, "presliding_travel": 0.05 * k.stroke_m}
    ),
    "linear_stiffness": _core(lambda k, s: {"linear": 0.12 * s * k.force_n / k.stroke_m}),
    "cubic_stiffness": _core(lambda k, s: {"cubic": 0.3 * s * k.force_n / k.stroke_m**3}),
    "gas_spring": _core(lambda k, s: {"gas": 0.2 * s * k.force_n, "gas_length": 2.5 * k.stroke_m, "gas_exponent": 1.3}),
    "end_stop": _core(lambda k, s: {"stop": 1.5 * s * k.force_n / (0.3 * k.stroke_m), "stop_at": 0.7 * k.stroke_m}),
    "position_dependent_damping": _core(lambda k, s: {"position": 0.6 * s / k.stroke_m**2}),
    "temperature_fade": _core(lambda k, s: {"fade": 0.01 * s}),
    "reversal_force_lag": _core(lambda k, s: {"reversal": 0.03 * s * k.stroke_m}),
    "series_compliance": Effect(
        path="mount",
        change=lambda k, s: {
            "mount": k.force_n / (0.02 * s * k.stroke_m),
            "mount_c": 0.002 * k.force_n / (0.02 * s * k.stroke_m),
        },
    ),
    "free_play": Effect(path="mount", change=lambda k, s: {"play": 0.02 * s * k.stroke_m}),
    "control_lag": _control(lambda k, s: {"lag": 0.02 * s}),
    "control_delay": _control(lambda k, s: {"delay": 0.012 * s}),
    "control_saturation": _control(lambda k, s: {"saturation": 1.2 * k.current_a / s}),
    "control_hysteresis": _control(lambda k, s: {"hysteresis_width": 0.2 * s * k.current_a}),
    "force_delay": _sensor(lambda k, s: {"force_delay": 0.002 * s}),
    "force_offset": _sensor(lambda k, s: {"offset": 0.07 * s * k.force_n}),
    "moving_mass": _sensor(lambda k, s: {"mass": 0.07 * s * k.force_n / (12.0 * k.speed_m_s)}),
    "force_drift": _sensor(lambda k, s: {"drift": 0.012 * s * k.force_n}),
    "mains_hum": _sensor(lambda k, s: {"hum": 0.09 * s * k.force_n}),
    # Outside the catalogue.
    "relaxation_branch": _core(
        lambda k, s: {"leak_stiffness": 0.8 * s * k.force_n / k.stroke_m, "leak_time": 0.03}, listed=False
    ),
    "sticking_patch": _core(
        lambda k, s: {
            "patch": 0.25 * s * k.force_n,
            "patch_at": 0.25 * k.stroke_m,
            "patch_width": 0.12 * k.stroke_m,
        },
        listed=False,
    ),
    "cavitation_memory": _core(
        lambda k, s: {"cavitation": 0.3 * s, "cavitation_speed": 0.3 * k.speed_m_s, "cavitation_time": 0.15},
        listed=False,
    ),
    "amplitude_softening": _core(
        lambda k, s: {"amplitude": 0.5 * s, "amplitude_speed": 0.4 * k.speed_m_s}, listed=False
    ),
    "sticking_spool": _control(lambda k, s: {"backlash": 0.15 * s * k.current_a}, listed=False),
}
LISTED: Final = tuple(name for name, effect in EFFECTS.items() if effect.listed)
UNLISTED: Final = tuple(name for name, effect in EFFECTS.items() if not effect.listed)

# Where a specimen has an effect by design, it cannot be hidden in it as well.
_BY_DESIGN: Final = {"series_compliance": "mount", "control_lag": "lag", "reversal_force_lag": "distortion"}


def refusal(damper: Damper, name: str, scale: Scale) -> str:
    """Return why an effect cannot be hidden here; empty where it can."""
    if name not in EFFECTS:
        return f"effect {name!r} does not exist: choose random or one of {', '.join(EFFECTS)}"
    if EFFECTS[name].needs_current and not scale.current_a:
        return f"effect {name!r} needs a controllable damper, this one has no current"
    if name in _BY_DESIGN and getattr(damper, _BY_DESIGN[name]) != 0.0:
        return f"effect {name!r} cannot be hidden: this specimen has it by design"
    return ""


def hidden(damper: Damper, name: str, scale: Scale, size: float) -> tuple[Damper, dict[str, float]]:
    """Return the damper with one effect more, and the parameters that make it."""
    reason = refusal(damper, name, scale)
    if reason:
        raise SpecimenError(reason)
    if not 0 < size < 100:
        raise SpecimenError(f"effect {name!r}: size is {size}, it must be positive; 1 is usual")
    change = EFFECTS[name].change(scale, size)
    return Damper(**{**damper._asdict(), **change}), change
