"""The numbers of the elements in the compiled kernels."""

from __future__ import annotations

from enum import IntEnum
from typing import Final


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


CODE_OF: Final[dict[str, Code]] = {
    "viscous_damping": Code.VISCOUS,
    "arctan_damping": Code.ARCTAN,
    "piecewise_linear_damping": Code.PIECEWISE,
    "valve_damping": Code.VALVE,
    "quadratic_damping": Code.QUADRATIC,
    "relief_valve": Code.RELIEF,
    "damping_asymmetry": Code.ASYMMETRY,
    "tanh_hysteresis": Code.TANH,
    "bouc_wen": Code.BOUC_WEN,
    "coulomb_friction": Code.COULOMB,
    "stribeck_friction": Code.STRIBECK,
    "presliding_friction": Code.PRESLIDING,
    "lugre_friction": Code.LUGRE,
    "modulated_tanh_hysteresis": Code.MODULATED_TANH,
    "hysteretic_biviscous": Code.BIVISCOUS,
    "sigmoid_hysteresis": Code.SIGMOID,
    "linear_stiffness": Code.STIFFNESS,
    "cubic_stiffness": Code.CUBIC,
    "gas_spring": Code.GAS,
    "end_stop": Code.STOP,
    "position_dependent_damping": Code.POSITION,
    "temperature_fade": Code.FADE,
    "reversal_force_lag": Code.REVERSAL_LAG,
    "series_compliance": Code.COMPLIANCE,
    "relaxing_compliance": Code.RELAXING,
    "series_dashpot": Code.DASHPOT,
    "free_play": Code.FREE_PLAY,
    "control_lag": Code.LAG,
    "control_delay": Code.DELAY,
    "control_saturation": Code.SATURATION,
    "control_hysteresis": Code.HYSTERESIS,
    "force_delay": Code.FORCE_DELAY,
    "force_offset": Code.OFFSET,
    "moving_mass": Code.MASS,
    "parallel_stiffness": Code.PARALLEL,
    "force_drift": Code.DRIFT,
    "mains_hum": Code.HUM,
}
