"""The catalogue's effects as they occur on a machine: shape, departure from the textbook form, and size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden.families import Machine, Parameters
from benchmarks.hidden.layout import Elements


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One effect of medium size; to enlarge it, parameters in `grows` are multiplied, those in `shrinks` divided."""

    element: str
    values: Parameters
    departure: float
    grows: tuple[str, ...] = ()
    shrinks: tuple[str, ...] = ()
    shape: tuple[str, ...] = ()  # further parameters that a fit would change
    largest: float = 1e6  # largest multiple of the medium size that is physical

    def sized(self, multiple: float, *, textbook: bool = False) -> Elements:
        """Parameters at a multiple of the medium size, with the departure or in the textbook form."""
        values = dict(self.values)
        for name in self.grows:
            values[name] *= multiple
        for name in self.shrinks:
            values[name] /= multiple
        return {self.element: values if textbook else {**values, "departure": self.departure}}

    @property
    def free(self) -> tuple[tuple[str, str], ...]:
        """The parameters that a fit of the textbook form would change."""
        return tuple((self.element, name) for name in (*self.grows, *self.shrinks, *self.shape))


Draw = Callable[[np.random.Generator, Machine], Effect]


def _either(rng: np.random.Generator, low: float, high: float) -> float:
    """Uniform in [low, high], with either sign."""
    return float(rng.uniform(low, high) * rng.choice([-1.0, 1.0]))


def _sizes(machine: Machine) -> tuple[float, float, float]:
    return machine.force_n, machine.envelope.speed_m_s, machine.envelope.stroke_m


def viscous(rng: np.random.Generator, machine: Machine) -> Effect:
    force, speed, _ = _sizes(machine)
    values = {"c": 0.2 * force / speed, "c_control": 0.0}
    return Effect(element="viscous_damping", values=values, departure=rng.uniform(0.05, 0.2), grows=("c",))


def quadratic(rng: np.random.Generator, machine: Machine) -> Effect:
    force, speed, _ = _sizes(machine)
    return Effect(
        element="quadratic_damping",
        values={"q": 0.2 * force / speed**2},
        departure=_either(rng, 0.05, 0.15),
        grows=("q",),
    )


def relief(rng: np.random.Generator, machine: Machine) -> Effect:
    """The valve reduces the slope of the base at the knee by at most 0.85 of it."""
    force, speed, _ = _sizes(machine)
    values = {"c_drop": 0.1 * force / speed, "w_knee": speed * rng.uniform(0.25, 0.55)}
    slope = machine.elements.get("viscous_damping", {}).get("c", 0.0)
    slope += 2.0 * machine.elements.get("quadratic_damping", {}).get("q", 0.0) * values["w_knee"]
    return Effect(
        element="relief_valve",
        values=values,
        departure=rng.uniform(0.04, 0.12),
        grows=("c_drop",),
        shape=("w_knee",),
        largest=max(0.85 * slope / values["c_drop"], 0.1),
    )


def asymmetry(rng: np.random.Generator, machine: Machine) -> Effect:
    force, speed, _ = _sizes(machine)
    return Effect(
        element="damping_asymmetry",
        values={"c_a": 0.1 * force / speed},
        departure=_either(rng, 0.04, 0.12),
        grows=("c_a",),
    )


def tanh_hysteresis(rng: np.random.Generator, machine: Machine) -> Effect:
    force, speed, _ = _sizes(machine)
    values = {
        "alpha": 0.1 * force,
        "alpha_control": 0.0,
        "beta": rng.uniform(5.0, 15.0) / speed,
        "delta": rng.uniform(0.6, 1.5),
    }
    return Effect(
        element="tanh_hysteresis",
        values=values,
        departure=rng.uniform(0.15, 0.4),
        grows=("alpha",),
        shape=("beta", "delta"),
    )


def bouc_wen(rng: np.random.Generator, machine: Machine) -> Effect:
    """Unlike Dahl's model: a sharp yield, or very different loading and unloading."""
    force, _, stroke = _sizes(machine)
    give, n = stroke * rng.uniform(0.12, 0.3), rng.uniform(1.6, 3.0)
    ratio = rng.uniform(0.5, 0.9) if rng.random() < 0.5 else -rng.uniform(0.4, 0.65)  # beta over gamma
    gamma = give ** (-n) / (1.0 + ratio)
    values = {"alpha": 0.1 * force / give, "A": 1.0, "beta": ratio * gamma, "gamma": gamma, "n": n}
    return Effect(
        element="bouc_wen",
        values=values,
        departure=_either(rng, 0.05, 0.11),
        grows=("alpha",),
        shape=("beta", "gamma", "n"),
    )


def coulomb(rng: np.random.Generator, machine: Machine) -> Effect:
    return Effect(
        element="coulomb_friction",
        values={"f_c": 0.05 * machine.force_n},
        departure=rng.uniform(0.03, 0.09),
        grows=("f_c",),
    )


def stribeck(rng: np.random.Generator, machine: Machine) -> Effect:
    force, speed, _ = _sizes(machine)
    f_c = 0.04 * force
    values = {"f_c": f_c, "f_s": f_c * rng.uniform(1.7, 2.6), "w_s": speed * rng.uniform(0.06, 0.18)}
    return Effect(
        element="stribeck_friction",
        values=values,
        departure=rng.uniform(0.3, 0.8),
        grows=("f_c", "f_s"),
        shape=("w_s",),
    )


def presliding(rng: np.random.Generator, machine: Machine) -> Effect:
    force, _, stroke = _sizes(machine)
    f_c = 0.08 * force
    values = {"sigma": f_c / (stroke * rng.uniform(0.06, 0.2)), "f_c": f_c}
    return Effect(
        element="presliding_friction", values=values, departure=rng.uniform(0.1, 0.35), grows=("sigma", "f_c")
    )


def stiffness(rng: np.random.Generator, machine: Machine) -> Effect:
    force, _, stroke = _sizes(machine)
    return Effect(
        element="linear_stiffness", values={"k": 0.08 * force / stroke}, departure=rng.uniform(0.06, 0.2), grows=("k",)
    )


def cubic(rng: np.random.Generator, machine: Machine) -> Effect:
    force, _, stroke = _sizes(machine)
    return Effect(
        element="cubic_stiffness",
        values={"k3": 0.1 * force / stroke**3},
        departure=_either(rng, 0.08, 0.25),
        grows=("k3",),
    )


def gas_spring(rng: np.random.Generator, machine: Machine) -> Effect:
    force, _, stroke = _sizes(machine)
    values = {"f0": 0.1 * force, "length": stroke * rng.uniform(1.5, 2.5), "n": rng.uniform(1.05, 1.4)}
    return Effect(
        element="gas_spring", values=values, departure=rng.uniform(0.2, 0.5), grows=("f0",), shape=("length",)
    )


def end_stop(rng: np.random.Generator, machine: Machine) -> Effect:
    force, _, stroke = _sizes(machine)
    values = {"k": 0.5 * force / stroke, "z_max": stroke * rng.uniform(0.55, 0.75)}
    return Effect(element="end_stop", values=values, departure=rng.uniform(0.05, 0.15), grows=("k",), shape=("z_max",))


def position_dependent(rng: np.random.Generator, machine: Machine) -> Effect:
    values = {"p": 0.3 / machine.envelope.stroke_m**2}
    return Effect(
        element="position_dependent_damping", values=values, departure=rng.uniform(0.1, 0.3), grows=("p",), largest=8.0
    )


def temperature_fade(rng: np.random.Generator, machine: Machine) -> Effect:
    values = {"kappa": 0.003, "T_ref": 25.0}
    return Effect(
        element="temperature_fade", values=values, departure=rng.uniform(0.2, 0.6), grows=("kappa",), largest=10.0
    )


def reversal_lag(rng: np.random.Generator, machine: Machine) -> Effect:
    values = {"length": 0.01 * machine.envelope.stroke_m}
    return Effect(
        element="reversal_force_lag", values=values, departure=rng.uniform(0.1, 0.3), grows=("length",), largest=20.0
    )


def series_compliance(rng: np.random.Generator, machine: Machine) -> Effect:
    force, _, stroke = _sizes(machine)
    values = {"k": force / (0.01 * stroke), "c": 0.0}
    return Effect(
        element="series_compliance", values=values, departure=rng.uniform(0.05, 0.2), shrinks=("k",), largest=40.0
    )


def free_play(rng: np.random.Generator, machine: Machine) -> Effect:
    values = {"gap": 0.01 * machine.envelope.stroke_m}
    return Effect(element="free_play", values=values, departure=rng.uniform(0.3, 1.0), grows=("gap",), largest=20.0)


def control_lag(rng: np.random.Generator, machine: Machine) -> Effect:
    return Effect(
        element="control_lag", values={"tau": 0.006}, departure=_either(rng, 0.03, 0.1), grows=("tau",), largest=20.0
    )


def control_delay(rng: np.random.Generator, machine: Machine) -> Effect:
    return Effect(
        element="control_delay", values={"tau": 0.004}, departure=rng.uniform(0.1, 0.3), grows=("tau",), largest=20.0
    )


def control_saturation(rng: np.random.Generator, machine: Machine) -> Effect:
    values = {"i_s": machine.scales[2] * 2.0}
    return Effect(
        element="control_saturation", values=values, departure=rng.uniform(0.2, 0.6), shrinks=("i_s",), largest=6.0
    )


def control_hysteresis(rng: np.random.Generator, machine: Machine) -> Effect:
    values = {"h": machine.scales[2] * 0.05}
    return Effect(
        element="control_hysteresis", values=values, departure=rng.uniform(0.15, 0.4), grows=("h",), largest=10.0
    )


def force_delay(rng: np.random.Generator, machine: Machine) -> Effect:
    return Effect(
        element="force_delay", values={"tau": 0.001}, departure=rng.uniform(0.2, 0.6), grows=("tau",), largest=15.0
    )


def force_offset(rng: np.random.Generator, machine: Machine) -> Effect:
    values = {"F0": 0.04 * machine.force_n * float(rng.choice([-1.0, 1.0]))}
    return Effect(element="force_offset", values=values, departure=rng.uniform(0.01, 0.04), grows=("F0",))


def moving_mass(rng: np.random.Generator, machine: Machine) -> Effect:
    force, speed, stroke = _sizes(machine)
    values = {"m": 0.04 * force / (speed**2 / stroke)}
    return Effect(element="moving_mass", values=values, departure=rng.uniform(0.02, 0.06), grows=("m",))


def force_drift(rng: np.random.Generator, machine: Machine) -> Effect:
    values = {"rate": 0.004 * machine.force_n * float(rng.choice([-1.0, 1.0]))}
    return Effect(element="force_drift", values=values, departure=rng.uniform(0.2, 0.6), grows=("rate",))


def mains_hum(rng: np.random.Generator, machine: Machine) -> Effect:
    values = {
        "amplitude": 0.03 * machine.force_n,
        "frequency": float(rng.choice([50.0, 60.0])) + rng.uniform(-0.03, 0.03),
    }
    return Effect(element="mains_hum", values=values, departure=rng.uniform(0.02, 0.06), grows=("amplitude",))


EFFECTS: dict[str, Draw] = {
    "viscous_damping": viscous,
    "quadratic_damping": quadratic,
    "relief_valve": relief,
    "damping_asymmetry": asymmetry,
    "tanh_hysteresis": tanh_hysteresis,
    "bouc_wen": bouc_wen,
    "coulomb_friction": coulomb,
    "stribeck_friction": stribeck,
    "presliding_friction": presliding,
    "linear_stiffness": stiffness,
    "cubic_stiffness": cubic,
    "gas_spring": gas_spring,
    "end_stop": end_stop,
    "position_dependent_damping": position_dependent,
    "temperature_fade": temperature_fade,
    "reversal_force_lag": reversal_lag,
    "series_compliance": series_compliance,
    "free_play": free_play,
    "control_lag": control_lag,
    "control_delay": control_delay,
    "control_saturation": control_saturation,
    "control_hysteresis": control_hysteresis,
    "force_delay": force_delay,
    "force_offset": force_offset,
    "moving_mass": moving_mass,
    "force_drift": force_drift,
    "mains_hum": mains_hum,
}

CONTROL = frozenset(name for name in EFFECTS if name.startswith("control_"))

# Above it the contact of a worn joint deflects by as much as its gap: that is a compliance.
RIGID_FORCE_N = 5e3

# Never two of one group in one case, nor one with a base element of the group: they can hardly be told apart.
HARD_TO_TELL_APART: tuple[frozenset[str], ...] = (
    frozenset({"linear_stiffness", "cubic_stiffness", "gas_spring", "end_stop"}),
    frozenset({"gas_spring", "force_offset", "force_drift"}),
    frozenset({"coulomb_friction", "stribeck_friction", "presliding_friction", "tanh_hysteresis", "bouc_wen"}),
    frozenset({"moving_mass", "force_delay"}),
    frozenset({"series_compliance", "force_delay", "free_play", "reversal_force_lag"}),
    frozenset({"control_lag", "control_delay"}),
    frozenset({"control_saturation", "temperature_fade"}),
    frozenset({"relief_valve", "quadratic_damping", "viscous_damping"}),
)


def fits(element: str, machine: Machine) -> bool:
    """Whether the effect is plausible on this machine and not in its model."""
    if element in machine.elements or (element in CONTROL and not machine.controllable):
        return False
    held = machine.elements
    if element == "control_delay":
        return "control_lag" not in held
    if element in ("force_delay", "reversal_force_lag"):
        return "series_compliance" not in held
    if element == "relief_valve":
        return machine.family in ("hydraulic_orifice", "hysteretic")
    if element == "free_play":
        return "series_compliance" in held or machine.force_n < RIGID_FORCE_N
    if element == "viscous_damping":
        return not {"arctan_damping", "piecewise_linear_damping"} & set(held)
    if element in ("coulomb_friction", "stribeck_friction", "presliding_friction", "bouc_wen", "tanh_hysteresis"):
        return not (
            {"bouc_wen", "tanh_hysteresis"} & set(held)
            and element in ("bouc_wen", "tanh_hysteresis", "presliding_friction")
        )
    return True


def compatible(elements: tuple[str, ...]) -> bool:
    """Whether no two of them are of one group that can hardly be told apart."""
    return len(set(elements)) == len(elements) and all(len(group & set(elements)) <= 1 for group in HARD_TO_TELL_APART)


# The names nearest to an effect: a case in which one of them fits as well has no right answer.
NEAREST: dict[str, tuple[str, ...]] = {
    "viscous_damping": ("quadratic_damping",),
    "quadratic_damping": ("viscous_damping", "position_dependent_damping"),
    "relief_valve": ("quadratic_damping", "viscous_damping", "coulomb_friction"),
    "damping_asymmetry": ("force_offset", "gas_spring"),
    "tanh_hysteresis": ("coulomb_friction", "presliding_friction", "series_compliance"),
    "bouc_wen": ("presliding_friction", "coulomb_friction", "linear_stiffness"),
    "coulomb_friction": ("quadratic_damping", "viscous_damping"),
    "stribeck_friction": ("coulomb_friction", "presliding_friction"),
    "presliding_friction": ("coulomb_friction", "linear_stiffness", "force_delay", "reversal_force_lag"),
    "linear_stiffness": ("cubic_stiffness", "moving_mass", "force_delay"),
    "cubic_stiffness": ("linear_stiffness",),
    "gas_spring": ("force_offset", "linear_stiffness", "damping_asymmetry"),
    "end_stop": ("linear_stiffness", "cubic_stiffness"),
    "position_dependent_damping": ("quadratic_damping", "temperature_fade"),
    "temperature_fade": ("viscous_damping", "position_dependent_damping"),
    "reversal_force_lag": ("series_compliance", "force_delay", "free_play", "presliding_friction"),
    "series_compliance": ("force_delay", "moving_mass", "reversal_force_lag", "free_play"),
    "free_play": ("reversal_force_lag", "force_delay", "series_compliance"),
    "control_lag": ("control_delay", "control_hysteresis"),
    "control_delay": ("control_lag", "control_hysteresis"),
    "control_saturation": ("temperature_fade", "viscous_damping"),
    "control_hysteresis": ("control_lag", "control_delay"),
    "force_delay": ("series_compliance", "moving_mass", "reversal_force_lag"),
    "force_offset": ("damping_asymmetry",),
    "moving_mass": ("linear_stiffness", "force_delay"),
    "force_drift": ("force_offset",),
    "mains_hum": (),
}
