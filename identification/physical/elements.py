"""The catalogue: every element a model may hold, in one table.

Each row says the path, the parameters with their units and physical bounds, the code under which the compiled kernels
know the element, and the words in which people read of it. Equations stand beside the kernels that compute them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, Literal

Path = Literal["mount", "control", "core", "sensor"]
PATHS: Final[tuple[Path, ...]] = ("mount", "control", "core", "sensor")


class Code(IntEnum):
    """The number of an element in the compiled kernels."""

    VISCOUS = 0
    ARCTAN = 1
    PIECEWISE = 2
    VALVE = 3
    QUADRATIC = 4
    RELIEF = 5
    ASYMMETRY = 6
    TANH = 7
    BOUC_WEN = 8
    COULOMB = 9
    STRIBECK = 10
    PRESLIDING = 11
    STIFFNESS = 12
    CUBIC = 13
    GAS = 14
    STOP = 15
    POSITION = 16
    FADE = 17
    REVERSAL_LAG = 18
    COMPLIANCE = 30
    FREE_PLAY = 31
    RELAXING = 32
    DASHPOT = 33
    LAG = 40
    DELAY = 41
    SATURATION = 42
    HYSTERESIS = 43
    FORCE_DELAY = 50
    OFFSET = 51
    MASS = 52
    DRIFT = 53
    HUM = 54
    PARALLEL = 55
    MODULATED_TANH = 60
    BIVISCOUS = 61
    SIGMOID = 62
    LUGRE = 63


@dataclass(frozen=True, slots=True)
class ParameterSpec:
    """One parameter: name, SI unit, physical bounds, and whether data may ever move it."""

    name: str
    unit: str
    low: float = 0.0
    high: float = math.inf
    constant: float | None = None  # a convention such as T_ref: fixed, with this default
    default: float | None = None  # the value where a file leaves the parameter out
    refinement: bool = (
        False  # a finer shape than the canonical form: never free unless asked for, not written while neutral
    )


@dataclass(frozen=True, slots=True)
class ElementSpec:
    """One row of the catalogue."""

    name: str
    path: Path
    code: Code
    title: str
    parameters: tuple[ParameterSpec, ...]
    needs_current: bool = False
    modifier: bool = False
    memory: bool = False
    nameable: bool = True  # whether the naming workflow may add it by itself; models of the literature are chosen

    def index(self, parameter: str) -> int:
        """Position of a parameter in the element's block of the parameter vector."""
        return [p.name for p in self.parameters].index(parameter)


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
        (_p("c", "N·s/m"), _p("c_control", "N·s/(m·A)", _FREE, default=0.0)),
    ),
    ElementSpec(
        "arctan_damping",
        "core",
        Code.ARCTAN,
        "saturating (arctan) damping",
        (_p("F1", "N"), _p("S", "s/m", _TINY), _p("d", "N·s/m"), _p("F2", "N", _FREE, default=0.0)),
    ),
    ElementSpec(
        "piecewise_linear_damping",
        "core",
        Code.PIECEWISE,
        "piecewise-linear damping",
        (_p("c1", "N·s/m", _TINY), _p("c2", "N·s/m"), _p("f_r", "N")),
    ),
    ElementSpec(
        "valve_damping",
        "core",
        Code.VALVE,
        "controlled valve damping",
        (
            _p("c_soft", "N·s/m"),
            _p("c_firm", "N·s/m"),
            _p("u_soft", "A", _FREE),
            _p("u_firm", "A", _FREE),
            _p("w_knee", "m/s", _TINY),
        ),
        needs_current=True,
    ),
    ElementSpec("quadratic_damping", "core", Code.QUADRATIC, "quadratic (orifice) damping", (_p("q", "N·s²/m²"),)),
    ElementSpec(
        "relief_valve",
        "core",
        Code.RELIEF,
        "relief valve",
        (_p("c_drop", "N·s/m"), _p("w_knee", "m/s", _TINY)),
    ),
    ElementSpec(
        "damping_asymmetry",
        "core",
        Code.ASYMMETRY,
        "rebound–compression asymmetry",
        (_p("c_a", "N·s/m", _FREE),),
    ),
    ElementSpec(
        "tanh_hysteresis",
        "core",
        Code.TANH,
        "hyperbolic-tangent hysteresis",
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
    ElementSpec("coulomb_friction", "core", Code.COULOMB, "Coulomb friction", (_p("f_c", "N"), _BUILD_UP)),
    ElementSpec(
        "stribeck_friction",
        "core",
        Code.STRIBECK,
        "Stribeck friction",
        (_p("f_c", "N"), _p("f_s", "N"), _p("w_s", "m/s", _TINY), _BUILD_UP),
    ),
    ElementSpec(
        "presliding_friction",
        "core",
        Code.PRESLIDING,
        "presliding friction",
        (_p("sigma", "N/m", _TINY), _p("f_c", "N", _TINY)),
        memory=True,
    ),
    ElementSpec(
        "lugre_friction",
        "core",
        Code.LUGRE,
        "LuGre friction",
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
        (
            _p("F_t", "N"),
            _p("F_t_control", "N/A", _FREE, default=0.0),
            _p("alpha", "s/m", _TINY),
            _p("h", "–"),
            _p("k_v", "s/m"),
        ),
        nameable=False,
    ),
    ElementSpec("linear_stiffness", "core", Code.STIFFNESS, "linear stiffness", (_p("k", "N/m"),)),
    ElementSpec("cubic_stiffness", "core", Code.CUBIC, "cubic stiffness", (_p("k3", "N/m³", _FREE),)),
    ElementSpec(
        "gas_spring",
        "core",
        Code.GAS,
        "gas spring",
        (_p("f0", "N"), _p("length", "m", _TINY), _p("n", "–", _TINY, high=5.0)),
    ),
    ElementSpec("end_stop", "core", Code.STOP, "end stop", (_p("k", "N/m"), _p("z_max", "m"))),
    ElementSpec(
        "position_dependent_damping",
        "core",
        Code.POSITION,
        "position-dependent damping",
        (_p("p", "1/m²", _FREE),),
        modifier=True,
    ),
    ElementSpec(
        "temperature_fade",
        "core",
        Code.FADE,
        "temperature fade",
        (_p("kappa", "1/K", _FREE), _p("T_ref", "°C", _FREE, constant=25.0)),
        modifier=True,
    ),
    ElementSpec(
        "reversal_force_lag",
        "core",
        Code.REVERSAL_LAG,
        "force lag after reversal",
        (_p("length", "m", _TINY),),
        modifier=True,
        memory=True,
    ),
    ElementSpec(
        "series_compliance",
        "mount",
        Code.COMPLIANCE,
        "series compliance (bush, oil column)",
        (_p("k", "N/m", _TINY), _p("c", "N·s/m", default=0.0)),
    ),
    ElementSpec(
        "relaxing_compliance",
        "mount",
        Code.RELAXING,
        "spring beside a Maxwell branch (standard linear solid) in series",
        (_p("k1", "N/m", _TINY), _p("k2", "N/m", _TINY), _p("c2", "N·s/m", _TINY)),
        nameable=False,
    ),
    ElementSpec(
        "series_dashpot",
        "mount",
        Code.DASHPOT,
        "dashpot in series",
        (_p("c", "N·s/m", _TINY), _p("c_control", "N·s/(m·A)", _FREE, default=0.0)),
        nameable=False,
    ),
    ElementSpec("free_play", "mount", Code.FREE_PLAY, "free play in the mount", (_p("gap", "m"),)),
    ElementSpec(
        "control_lag",
        "control",
        Code.LAG,
        "first-order lag of the control",
        (_p("tau", "s"),),
        needs_current=True,
    ),
    ElementSpec(
        "control_delay",
        "control",
        Code.DELAY,
        "dead time of the control",
        (_p("tau", "s"),),
        needs_current=True,
    ),
    ElementSpec(
        "control_saturation",
        "control",
        Code.SATURATION,
        "saturation of the control",
        (_p("i_s", "A", _TINY),),
        needs_current=True,
    ),
    ElementSpec(
        "control_hysteresis",
        "control",
        Code.HYSTERESIS,
        "hysteresis of the control",
        (_p("h", "A"),),
        needs_current=True,
    ),
    ElementSpec("force_delay", "sensor", Code.FORCE_DELAY, "time skew of the force channel", (_p("tau", "s"),)),
    ElementSpec("force_offset", "sensor", Code.OFFSET, "load-cell offset", (_p("F0", "N", _FREE),)),
    ElementSpec("moving_mass", "sensor", Code.MASS, "mass between load cell and damper", (_p("m", "kg"),)),
    ElementSpec(
        "parallel_stiffness",
        "sensor",
        Code.PARALLEL,
        "spring beside damper and mount",
        (_p("k", "N/m"),),
        nameable=False,
    ),
    ElementSpec("force_drift", "sensor", Code.DRIFT, "load-cell drift", (_p("rate", "N/s", _FREE),)),
    ElementSpec(
        "mains_hum",
        "sensor",
        Code.HUM,
        "mains hum on the force channel",
        (_p("amplitude", "N"), _p("frequency", "Hz"), _p("phase", "rad", _FREE, default=0.0)),
    ),
)

CATALOGUE: Final[dict[str, ElementSpec]] = {row.name: row for row in _ROWS}
"""Every element by its name."""
