"""Effects that no element of the catalogue describes, as they occur in real machines."""

from __future__ import annotations

import numpy as np

from benchmarks.hidden.effects import Draw, Effect
from benchmarks.hidden.families import Machine


def relaxation_branch(rng: np.random.Generator, machine: Machine) -> Effect:
    """A spring and a dashpot in series, parallel to the damper: the oil of a second chamber."""
    values = {"k": 0.1 * machine.force_n / machine.envelope.stroke_m, "tau": rng.uniform(0.3, 1.5) * _radian_s(machine)}
    return Effect(element="relaxation_branch", values=values, departure=0.0, grows=("k",))


def fractional_damping(rng: np.random.Generator, machine: Machine) -> Effect:
    """Rubber: force proportional to a derivative of fractional order."""
    order = rng.uniform(0.35, 0.65)
    values = {"c": 0.04 * machine.force_n / machine.envelope.stroke_m * _radian_s(machine) ** order, "order": order}
    return Effect(element="fractional_damping", values=values, departure=0.0, grows=("c",))


def cogging(rng: np.random.Generator, machine: Machine) -> Effect:
    """A force that repeats along the stroke: magnets, threads, a knurled tube."""
    pitch = machine.envelope.stroke_m * rng.uniform(0.15, 0.4)
    values = {"amplitude": 0.03 * machine.force_n, "pitch": pitch, "phase": rng.uniform(0.0, 2 * np.pi)}
    return Effect(element="cogging", values=values, departure=0.0, grows=("amplitude",))


def speed_band_whistle(rng: np.random.Generator, machine: Machine) -> Effect:
    """A valve that flutters in a band of speed, with more force there."""
    speed = machine.envelope.speed_m_s
    values = {
        "amplitude": 0.1 * machine.force_n,
        "w_mid": speed * rng.uniform(0.15, 0.4),
        "w_width": speed * rng.uniform(0.03, 0.07),
    }
    return Effect(element="speed_band_whistle", values=values, departure=0.0, grows=("amplitude",))


def current_rate_crosstalk(rng: np.random.Generator, machine: Machine) -> Effect:
    """The coil's leads induce a signal in the load cell: force after every change of current."""
    tau = rng.uniform(0.003, 0.01)
    values = {"gain": 0.2 * machine.force_n * tau / machine.scales[2], "tau": tau}
    return Effect(element="current_rate_crosstalk", values=values, departure=0.0, grows=("gain",))


def dissipation_heating(rng: np.random.Generator, machine: Machine) -> Effect:
    """Oil in the valve is heated by the work of the last seconds; the sensor on the body does not show it."""
    values = {"fade": 0.3, "tau": rng.uniform(1.5, 6.0)}
    return Effect(element="dissipation_heating", values=values, departure=0.0, grows=("fade",), largest=15.0)


def impact_chatter(rng: np.random.Generator, machine: Machine) -> Effect:
    """A loose part rings whenever the rod passes one position in extension."""
    values = {
        "amplitude": 0.2 * machine.force_n,
        "frequency": rng.uniform(70.0, 140.0),
        "decay": rng.uniform(0.02, 0.05),
        "z_hit": machine.envelope.stroke_m * rng.uniform(-0.3, 0.3),
    }
    return Effect(element="impact_chatter", values=values, departure=0.0, grows=("amplitude",))


def one_sided_inertance(rng: np.random.Generator, machine: Machine) -> Effect:
    """Fluid accelerated through a long port with a check valve, until it cavitates."""
    speed, stroke = machine.envelope.speed_m_s, machine.envelope.stroke_m
    values = {"amplitude": 0.05 * machine.force_n, "a_knee": 0.15 * speed**2 / stroke}
    return Effect(element="one_sided_inertance", values=values, departure=0.0, grows=("amplitude",))


def peak_speed_memory(rng: np.random.Generator, machine: Machine) -> Effect:
    """A thixotropic fluid: less viscous for seconds after fast shear."""
    values = {"softening": 0.3, "decay": rng.uniform(0.3, 2.0)}
    return Effect(element="peak_speed_memory", values=values, departure=0.0, grows=("softening",), largest=10.0)


def leaf_spring_butterfly(rng: np.random.Generator, machine: Machine) -> Effect:
    """Friction between leaves that grows with deflection: a loop that widens towards both ends."""
    values = {"amplitude": 0.1 * machine.force_n, "travel": machine.envelope.stroke_m * rng.uniform(0.03, 0.1)}
    return Effect(element="leaf_spring_butterfly", values=values, departure=0.0, grows=("amplitude",))


def delayed_leak(rng: np.random.Generator, machine: Machine) -> Effect:
    """In extension a seal lifts above a pressure and opens and closes with a delay."""
    f_open = machine.force_n * rng.uniform(0.2, 0.5)
    values = {"gain": 0.25, "f_open": f_open, "tau": rng.uniform(0.2, 0.6) * _radian_s(machine)}
    return Effect(element="delayed_leak", values=values, departure=0.0, grows=("gain",), largest=2.5)


def load_cell_creep(rng: np.random.Generator, machine: Machine) -> Effect:
    """Creep of the cell's adhesive: a share of the force is measured with a delay."""
    values = {"gain": 0.08, "tau": rng.uniform(0.2, 1.0)}
    return Effect(element="load_cell_creep", values=values, departure=0.0, grows=("gain",), largest=8.0)


def _radian_s(machine: Machine) -> float:
    """Time of one radian at the corner of the machine's envelope, s."""
    return machine.envelope.stroke_m / machine.envelope.speed_m_s


UNKNOWN_EFFECTS: dict[str, Draw] = {
    "relaxation_branch": relaxation_branch,
    "fractional_damping": fractional_damping,
    "cogging": cogging,
    "speed_band_whistle": speed_band_whistle,
    "current_rate_crosstalk": current_rate_crosstalk,
    "dissipation_heating": dissipation_heating,
    "impact_chatter": impact_chatter,
    "one_sided_inertance": one_sided_inertance,
    "peak_speed_memory": peak_speed_memory,
    "leaf_spring_butterfly": leaf_spring_butterfly,
    "delayed_leak": delayed_leak,
    "load_cell_creep": load_cell_creep,
}


def can_show(kind: str, machine: Machine) -> bool:
    """Whether the unknown effect is plausible on this machine."""
    return machine.controllable or kind != "current_rate_crosstalk"
