"""Places of each element's parameters in the flat vector of the compiled specimen."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Values = Mapping[str, float]
Elements = Mapping[str, Values]

SCALES = ("speed_m_s", "stroke_m", "current_a", "force_n")

# The catalogue, by path: the names and parameters of the model file's contract.
CATALOGUE: dict[str, dict[str, tuple[str, ...]]] = {
    "core": {
        "viscous_damping": ("c", "c_control"),
        "arctan_damping": ("F1", "S", "d", "F2"),
        "piecewise_linear_damping": ("c1", "c2", "f_r"),
        "valve_damping": ("c_soft", "c_firm", "u_soft", "u_firm", "w_knee"),
        "quadratic_damping": ("q",),
        "relief_valve": ("c_drop", "w_knee"),
        "damping_asymmetry": ("c_a",),
        "tanh_hysteresis": ("alpha", "alpha_control", "beta", "delta"),
        "bouc_wen": ("alpha", "A", "beta", "gamma", "n"),
        "coulomb_friction": ("f_c",),
        "stribeck_friction": ("f_c", "f_s", "w_s"),
        "presliding_friction": ("sigma", "f_c"),
        "linear_stiffness": ("k",),
        "cubic_stiffness": ("k3",),
        "gas_spring": ("f0", "length", "n"),
        "end_stop": ("k", "z_max"),
        "position_dependent_damping": ("p",),
        "temperature_fade": ("kappa", "T_ref"),
        "reversal_force_lag": ("length",),
    },
    "mount": {"series_compliance": ("k", "c"), "free_play": ("gap",)},
    "control": {
        "control_lag": ("tau",),
        "control_delay": ("tau",),
        "control_saturation": ("i_s",),
        "control_hysteresis": ("h",),
    },
    "sensor": {
        "force_delay": ("tau",),
        "force_offset": ("F0",),
        "moving_mass": ("m",),
        "force_drift": ("rate",),
        "mains_hum": ("amplitude", "frequency"),
    },
}

# Effects of real machines that no element of the catalogue describes.
UNKNOWNS: dict[str, tuple[str, ...]] = {
    "relaxation_branch": ("k", "tau"),
    "fractional_damping": ("c", "order"),
    "cogging": ("amplitude", "pitch", "phase"),
    "speed_band_whistle": ("amplitude", "w_mid", "w_width"),
    "current_rate_crosstalk": ("gain", "tau"),
    "dissipation_heating": ("fade", "tau"),
    "impact_chatter": ("amplitude", "frequency", "decay", "z_hit"),
    "one_sided_inertance": ("amplitude", "a_knee"),
    "peak_speed_memory": ("softening", "decay"),
    "leaf_spring_butterfly": ("amplitude", "travel"),
    "delayed_leak": ("gain", "f_open", "tau"),
    "load_cell_creep": ("gain", "tau"),
}

# Groups of elements that the compiled specimen skips where none of them is switched on.
GROUPS: tuple[frozenset[str], ...] = (
    frozenset(
        {
            "position_dependent_damping",
            "temperature_fade",
            "reversal_force_lag",
            "dissipation_heating",
            "peak_speed_memory",
        }
    ),
    frozenset({"arctan_damping", "linear_stiffness", "cubic_stiffness", "gas_spring", "end_stop"}),
    frozenset(UNKNOWNS),
    frozenset(CATALOGUE["control"]),
    frozenset({"tanh_hysteresis", "bouc_wen", "coulomb_friction", "stribeck_friction", "presliding_friction"}),
)

PATH_OF = {element: path for path, elements in CATALOGUE.items() for element in elements}
PARAMETERS = {**{e: p for elements in CATALOGUE.values() for e, p in elements.items()}, **UNKNOWNS}


def _offsets() -> dict[str, int]:
    offsets, at = {}, len(SCALES) + len(GROUPS)
    for element, names in PARAMETERS.items():
        offsets[element] = at
        at += len(names) + 2  # the switch is first, the departure from the textbook form last
    return offsets


OFFSET = _offsets()
SIZE = max(OFFSET[e] + len(p) + 2 for e, p in PARAMETERS.items())


def slot(element: str, parameter: str) -> int:
    """Place of one number; ``on`` is the switch, ``departure`` is the departure from the textbook form."""
    if parameter == "on":
        return OFFSET[element]
    names = (*PARAMETERS[element], "departure")
    return OFFSET[element] + 1 + names.index(parameter)


def pack(elements: Elements, scales: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """The elements as one float64 vector; elements that are not given are switched off and zero."""
    vector = np.zeros(SIZE)
    vector[: len(SCALES)] = scales
    vector[len(SCALES) : len(SCALES) + len(GROUPS)] = [bool(group & set(elements)) for group in GROUPS]
    for element, values in elements.items():
        vector[OFFSET[element]] = 1.0
        for name, value in values.items():
            vector[slot(element, name)] = value
    return vector
