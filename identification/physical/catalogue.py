"""The catalogue: every element a model may hold, in one table.

Each row says the path, the equation, the parameters with their units and physical bounds, their first values from the
data, the code under which the compiled kernels know the element's force and gradient, and the words in which people
read of it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from identification.physical.elements import Code, ElementSpec, ParameterSpec
from identification.physical.starts import STARTS


def _p(
    name: str,
    unit: str,
    low: float = 0.0,
    *,
    high: float = math.inf,
    constant: float | None = None,
    default: float | None = None,
) -> ParameterSpec:
    return ParameterSpec(name, unit, low, high, constant, default)


_TINY = 1e-12  # "> 0" in floating point: knees, lengths and slopes that divide
_FREE = -math.inf

# Measured friction does not jump: it builds up over a velocity w_r, zero in the canonical form.
_BUILD_UP = ParameterSpec("w_r", "m/s", 0.0, default=0.0, refinement=True)
# Nor does a hysteresis turn over at one point: it does so over a displacement z_r, zero in the canonical form.
_TURN_OVER = ParameterSpec("z_r", "m", 0.0, default=0.0, refinement=True)

_ROWS: Final = (
    ElementSpec(
        "viscous_damping",
        "core",
        Code.VISCOUS,
        "viscous damping",
        "f = (c + c_control·u)·w",
        (_p("c", "N·s/m"), _p("c_control", "N·s/(m·A)", _FREE, default=0.0)),
    ),
    ElementSpec(
        "arctan_damping",
        "core",
        Code.ARCTAN,
        "saturating (arctan) damping",
        "f = F1·(2/π)·arctan(S·w) + d·w + F2",
        (_p("F1", "N"), _p("S", "s/m", _TINY), _p("d", "N·s/m"), _p("F2", "N", _FREE, default=0.0)),
    ),
    ElementSpec(
        "piecewise_linear_damping",
        "core",
        Code.PIECEWISE,
        "piecewise-linear damping",
        "f = c1·w while |c1·w| < f_r, beyond it sgn(w)·(1 − c2/c1)·f_r + c2·w",
        (_p("c1", "N·s/m", _TINY), _p("c2", "N·s/m"), _p("f_r", "N")),
    ),
    ElementSpec(
        "valve_damping",
        "core",
        Code.VALVE,
        "controlled valve damping",
        "f = c(u)·w/√(1 + (w/w_knee)²), c from c_soft at u_soft to c_firm at u_firm",
        (
            _p("c_soft", "N·s/m"),
            _p("c_firm", "N·s/m"),
            _p("u_soft", "A", _FREE),
            _p("u_firm", "A", _FREE),
            _p("w_knee", "m/s", _TINY),
        ),
        needs_current=True,
    ),
    ElementSpec(
        "quadratic_damping", "core", Code.QUADRATIC, "quadratic (orifice) damping", "f = q·w·|w|", (_p("q", "N·s²/m²"),)
    ),
    ElementSpec(
        "relief_valve",
        "core",
        Code.RELIEF,
        "relief valve",
        "f = −c_drop·sgn(w)·max(0, |w| − w_knee)",
        (_p("c_drop", "N·s/m"), _p("w_knee", "m/s", _TINY)),
    ),
    ElementSpec(
        "damping_asymmetry",
        "core",
        Code.ASYMMETRY,
        "rebound–compression asymmetry",
        "f = c_a·|w|",
        (_p("c_a", "N·s/m", _FREE),),
    ),
    ElementSpec(
        "tanh_hysteresis",
        "core",
        Code.TANH,
        "hyperbolic-tangent hysteresis",
        "f = (alpha + alpha_control·u)·tanh(beta·w + delta·sgn(z))",
        (
            _p("alpha", "N"),
            _p("alpha_control", "N/A", _FREE, default=0.0),
            _p("beta", "s/m", _TINY),
            _p("delta", "–"),
            _TURN_OVER,
        ),
    ),
    ElementSpec(
        "bouc_wen",
        "core",
        Code.BOUC_WEN,
        "Bouc–Wen hysteresis",
        "f = (alpha + alpha_control·u)·h, dh/dt = A·w − gamma·|w|·h·|h|^(n−1) − beta·w·|h|^n",
        (
            _p("alpha", "N/m"),
            _p("A", "–", _TINY),
            _p("n", "–", 1.0, high=10.0),
            _p("beta", "1/m^n", _FREE),
            _p("gamma", "1/m^n"),  # below zero it would make energy out of nothing
            ParameterSpec("alpha_control", "N/(m·A)", _FREE, default=0.0, refinement=True),
        ),
        memory=True,
    ),
    ElementSpec(
        "coulomb_friction", "core", Code.COULOMB, "Coulomb friction", "f = f_c·sgn(w)", (_p("f_c", "N"), _BUILD_UP)
    ),
    ElementSpec(
        "stribeck_friction",
        "core",
        Code.STRIBECK,
        "Stribeck friction",
        "f = (f_c + (f_s − f_c)·exp(−(w/w_s)²))·sgn(w)",
        (_p("f_c", "N"), _p("f_s", "N"), _p("w_s", "m/s", _TINY), _BUILD_UP),
    ),
    ElementSpec(
        "presliding_friction",
        "core",
        Code.PRESLIDING,
        "presliding friction",
        "df/dt = sigma·w·(1 − sgn(w)·f/f_c)",
        (_p("sigma", "N/m", _TINY), _p("f_c", "N", _TINY)),
        memory=True,
    ),
    ElementSpec(
        "lugre_friction",
        "core",
        Code.LUGRE,
        "LuGre friction",
        "f = sigma0·m + sigma1·dm/dt, dm/dt = w − sigma0·|w|·m/g, g = f_c + (f_s − f_c)·exp(−(w/w_s)²)",
        (
            _p("sigma0", "N/m", _TINY),
            _p("sigma1", "N·s/m"),
            _p("f_c", "N", _TINY),
            _p("f_s", "N", _TINY),
            _p("w_s", "m/s", _TINY),
        ),
        memory=True,
        nameable=False,
    ),
    ElementSpec(
        "modulated_tanh_hysteresis",
        "core",
        Code.MODULATED_TANH,
        "hyperbolic-tangent hysteresis that follows current and motion",
        "f = (alpha1·u + alpha2)·(alpha3·v_m² + alpha4·v_m + alpha5)"
        "·tanh(beta1·v_m^beta2·w + (delta1·u + delta2)·sgn(z))",
        (
            _p("alpha1", "1/A", _FREE),
            _p("alpha2", "–", _FREE),
            _p("alpha3", "N·s²/m²", _FREE),
            _p("alpha4", "N·s/m", _FREE),
            _p("alpha5", "N", _FREE),
            _p("beta1", "(s/m)^(1+beta2)", _TINY),
            _p("beta2", "–", -3.0, high=3.0),
            _p("delta1", "1/A", _FREE),
            _p("delta2", "–", _FREE),
        ),
        nameable=False,
    ),
    ElementSpec(
        "hysteretic_biviscous",
        "core",
        Code.BIVISCOUS,
        "hysteretic biviscous damping",
        "f = c_pr·(w − v_0·sgn(a)), held within c_po·w ± (f_y + f_y_control·u)",
        (
            _p("c_po", "N·s/m"),
            _p("c_pr", "N·s/m", _TINY),
            _p("f_y", "N"),
            _p("f_y_control", "N/A", _FREE, default=0.0),
            _p("v_0", "m/s"),
        ),
        nameable=False,
    ),
    ElementSpec(
        "sigmoid_hysteresis",
        "core",
        Code.SIGMOID,
        "generalised sigmoid hysteresis",
        "f = (F_t + F_t_control·u)·tanh(alpha·(w − h·v_m·sgn(a))/2)·(1 + k_v·|w|)",
        (
            _p("F_t", "N"),
            _p("F_t_control", "N/A", _FREE, default=0.0),
            _p("alpha", "s/m", _TINY),
            _p("h", "–"),
            _p("k_v", "s/m"),
        ),
        nameable=False,
    ),
    ElementSpec("linear_stiffness", "core", Code.STIFFNESS, "linear stiffness", "f = k·z", (_p("k", "N/m"),)),
    ElementSpec("cubic_stiffness", "core", Code.CUBIC, "cubic stiffness", "f = k3·z³", (_p("k3", "N/m³", _FREE),)),
    ElementSpec(
        "gas_spring",
        "core",
        Code.GAS,
        "gas spring",
        "f = −f0·(1 + z/length)^(−n)",
        (_p("f0", "N"), _p("length", "m", _TINY), _p("n", "–", _TINY, high=5.0)),
    ),
    ElementSpec(
        "end_stop",
        "core",
        Code.STOP,
        "end stop",
        "f = k·max(0, z − z_max) − k·max(0, −z_max − z)",
        (_p("k", "N/m"), _p("z_max", "m")),
    ),
    ElementSpec(
        "position_dependent_damping",
        "core",
        Code.POSITION,
        "position-dependent damping",
        "dissipative sum × (1 + p·z²)",
        (_p("p", "1/m²", _FREE),),
        modifier=True,
    ),
    ElementSpec(
        "temperature_fade",
        "core",
        Code.FADE,
        "temperature fade",
        "dissipative sum × exp(−kappa·(T − T_ref))",
        (_p("kappa", "1/K", _FREE), _p("T_ref", "°C", _FREE, constant=25.0)),
        modifier=True,
    ),
    ElementSpec(
        "reversal_force_lag",
        "core",
        Code.REVERSAL_LAG,
        "force lag after reversal",
        "dissipative sum × (1 − exp(−s/length)), s the travel since w last changed its sign",
        (_p("length", "m", _TINY),),
        modifier=True,
        memory=True,
    ),
    ElementSpec(
        "series_compliance",
        "mount",
        Code.COMPLIANCE,
        "series compliance (bush, oil column)",
        "f = k·e + c·de/dt, e = x − z",
        (_p("k", "N/m", _TINY), _p("c", "N·s/m", default=0.0)),
    ),
    ElementSpec(
        "relaxing_compliance",
        "mount",
        Code.RELAXING,
        "spring beside a Maxwell branch (standard linear solid) in series",
        "f = k1·e + y, dy/dt = k2·de/dt − (k2/c2)·y, e = x − z",
        (_p("k1", "N/m", _TINY), _p("k2", "N/m", _TINY), _p("c2", "N·s/m", _TINY)),
        nameable=False,
    ),
    ElementSpec(
        "series_dashpot",
        "mount",
        Code.DASHPOT,
        "dashpot in series",
        "f = (c + c_control·u)·de/dt, e = x − z",
        (_p("c", "N·s/m", _TINY), _p("c_control", "N·s/(m·A)", _FREE, default=0.0)),
        nameable=False,
    ),
    ElementSpec(
        "free_play",
        "mount",
        Code.FREE_PLAY,
        "free play in the mount",
        "no force while |e| < gap/2, e = x − z",
        (_p("gap", "m"),),
    ),
    ElementSpec(
        "control_lag",
        "control",
        Code.LAG,
        "first-order lag of the control",
        "du/dt = (i − u)/tau",
        (_p("tau", "s"),),
        needs_current=True,
    ),
    ElementSpec(
        "control_delay",
        "control",
        Code.DELAY,
        "dead time of the control",
        "u(t) = i(t − tau)",
        (_p("tau", "s"),),
        needs_current=True,
    ),
    ElementSpec(
        "control_saturation",
        "control",
        Code.SATURATION,
        "saturation of the control",
        "u = i_s·tanh(i/i_s)",
        (_p("i_s", "A", _TINY),),
        needs_current=True,
    ),
    ElementSpec(
        "control_hysteresis",
        "control",
        Code.HYSTERESIS,
        "hysteresis of the control",
        "u follows i once i has moved by h/2 away from it",
        (_p("h", "A"),),
        needs_current=True,
    ),
    ElementSpec(
        "force_delay",
        "sensor",
        Code.FORCE_DELAY,
        "time skew of the force channel",
        "F(t) = f(t − tau)",
        (_p("tau", "s"),),
    ),
    ElementSpec("force_offset", "sensor", Code.OFFSET, "load-cell offset", "F = f + F0", (_p("F0", "N", _FREE),)),
    ElementSpec(
        "moving_mass", "sensor", Code.MASS, "mass between load cell and damper", "F = f + m·a", (_p("m", "kg"),)
    ),
    ElementSpec(
        "parallel_stiffness",
        "sensor",
        Code.PARALLEL,
        "spring beside damper and mount",
        "F = f + k·x",
        (_p("k", "N/m"),),
        nameable=False,
    ),
    ElementSpec("force_drift", "sensor", Code.DRIFT, "load-cell drift", "F = f + rate·t", (_p("rate", "N/s", _FREE),)),
    ElementSpec(
        "mains_hum",
        "sensor",
        Code.HUM,
        "mains hum on the force channel",
        "F = f + amplitude·sin(2π·frequency·t + phase)",
        (_p("amplitude", "N"), _p("frequency", "Hz"), _p("phase", "rad", _FREE, default=0.0)),
    ),
)

CATALOGUE: Final[dict[str, ElementSpec]] = {row.name: replace(row, starts=STARTS.get(row.name)) for row in _ROWS}
"""Every element by its name."""
