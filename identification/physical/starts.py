"""Plausible first values of each element's parameters, from the scales of the data alone, SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from identification.physical.elements import Starts, Values
    from identification.scales import Scales


_FAINT = (
    0.1  # what makes a force fall with speed may break a core loose behind its mount: once more, too faint for that
)


def _friction(s: Scales) -> Sequence[Values]:
    return [{"f_c": s.gap}]


def _stribeck(s: Scales) -> Sequence[Values]:
    return [{"f_c": 0.7 * s.gap, "f_s": 1.4 * s.gap, "w_s": w} for w in (0.3 * s.speeds[0], s.speeds[0], s.speeds[1])]


def _presliding(s: Scales) -> Sequence[Values]:
    return [{"f_c": s.gap, "sigma": s.gap / (part * s.x_rms)} for part in (0.01, 0.05, 0.25)]


def _bouc_wen(s: Scales) -> Sequence[Values]:
    guesses = []
    for part, n in ((0.02, 1.5), (0.1, 1.5), (0.4, 1.5), (1.6, 1.0)):  # the widest loop never saturates
        h = part * s.x_rms  # the internal displacement at which the force saturates
        guesses.append({"alpha": s.gap / h, "A": 1.0, "n": n, "beta": 0.5 / h**n, "gamma": 0.5 / h**n})
    return guesses


def _tanh(s: Scales) -> Sequence[Values]:
    return [{"alpha": s.gap, "alpha_control": 0.0, "beta": 1.0 / w, "delta": 0.2} for w in (s.speeds[0], s.speeds[1])]


def _arctan(s: Scales) -> Sequence[Values]:
    return [{"F1": s.gap, "S": 1.0 / w, "d": 0.0} for w in (s.speeds[0], s.speeds[2])]


def _piecewise(s: Scales) -> Sequence[Values]:
    return [{"c1": s.gap / w, "c2": 0.1 * s.gap / w, "f_r": s.gap} for w in (s.speeds[1], s.speeds[2])]


def _relief(s: Scales) -> Sequence[Values]:
    # No more than what is missing: more would make a core fall with speed, break loose and take its time at it.
    slope, knees = min(s.gap, 0.3 * s.force) / s.v_rms, (*s.speeds[1:], 0.6 * s.v_max)
    return [*({"c_drop": slope, "w_knee": w} for w in knees), {"c_drop": _FAINT * slope, "w_knee": knees[-1]}]


def _valve(s: Scales) -> Sequence[Values]:
    slope, low, high = s.gap / s.v_rms, s.current_low, s.current_high
    return [{"c_soft": 0.5 * slope, "c_firm": 1.5 * slope, "u_soft": low, "u_firm": high, "w_knee": s.speeds[3]}]


STARTS: Final[Mapping[str, Starts]] = {
    "viscous_damping": lambda s: [{"c": s.gap / s.v_rms, "c_control": 0.0}],
    "arctan_damping": _arctan,
    "piecewise_linear_damping": _piecewise,
    "valve_damping": _valve,
    "quadratic_damping": lambda s: [{"q": s.gap / s.v_rms**2}],
    "relief_valve": _relief,
    "damping_asymmetry": lambda s: [{"c_a": part * s.gap / s.v_rms} for part in (1.0, _FAINT)],
    "tanh_hysteresis": _tanh,
    "bouc_wen": _bouc_wen,
    "coulomb_friction": _friction,
    "stribeck_friction": _stribeck,
    "presliding_friction": _presliding,
    "linear_stiffness": lambda s: [{"k": s.gap / s.x_rms}],
    "cubic_stiffness": lambda s: [{"k3": s.gap / s.x_rms**3}],
    "gas_spring": lambda s: [
        {"f0": s.gap, "length": 2.5 * s.x_max, "n": 1.3},
        {"f0": s.gap, "length": 1.3 * s.x_max, "n": 1.3},
    ],
    "end_stop": lambda s: [{"k": s.force / s.x_max, "z_max": part * s.x_max} for part in (0.45, 0.65, 0.85)],
    "position_dependent_damping": lambda s: [{"p": 0.2 / s.x_rms**2}],
    "temperature_fade": lambda s: [{"kappa": 0.1 / max(s.warmth, 1.0), "T_ref": 25.0}],
    "reversal_force_lag": lambda s: [{"length": part * s.x_rms} for part in (0.01, 0.05, 0.2)],
    "series_compliance": lambda s: [{"k": s.force / (part * s.x_rms), "c": 0.0} for part in (0.005, 0.03, 0.15)],
    "free_play": lambda s: [{"gap": part * s.x_rms} for part in (0.005, 0.03, 0.15)],
    "control_lag": lambda s: [{"tau": part * s.current_time} for part in (0.2, 1.0)],
    "control_delay": lambda s: [{"tau": part * s.current_time} for part in (0.1, 0.5)],
    "control_saturation": lambda s: [{"i_s": part * max(abs(s.current_low), s.current_high)} for part in (0.8, 2.0)],
    "control_hysteresis": lambda s: [{"h": part * (s.current_high - s.current_low)} for part in (0.05, 0.15)],
    "force_delay": lambda s: [{"tau": 0.03 * s.motion_time}],
    "force_offset": lambda s: [{"F0": s.gap}],
    "moving_mass": lambda s: [{"m": s.gap / s.a_rms}],
    "force_drift": lambda s: [{"rate": s.gap / s.duration}],
}
