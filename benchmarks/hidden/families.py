"""Base machines drawn at random: what the given model describes, with the true parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden.layout import PATH_OF
from benchmarks.hidden.motion import Envelope

Parameters = dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """One base machine: elements in the textbook form, free parameters, and the departures of the real machine."""

    family: str
    elements: dict[str, Parameters]
    fixed: frozenset[tuple[str, str]]
    curve: str  # the element whose curve departs from the textbook form, a little or to another family
    envelope: Envelope
    force_n: float

    @property
    def scales(self) -> tuple[float, float, float, float]:
        """Speed, stroke, current and force to which departures are scaled."""
        current = self.envelope.current_a[1] if self.envelope.current_a else 1.0
        return self.envelope.speed_m_s, self.envelope.stroke_m, current, self.force_n

    @property
    def free(self) -> tuple[tuple[str, str], ...]:
        """The parameters that a fit may change."""
        return tuple(
            (element, name)
            for element, values in self.elements.items()
            for name in values
            if (element, name) not in self.fixed
        )

    @property
    def controllable(self) -> bool:
        return self.envelope.current_a is not None


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _envelope(rng: np.random.Generator, current_a: tuple[float, float] | None) -> Envelope:
    stroke, corner = _between(rng, 0.006, 0.05), _between(rng, 0.9, 5.0)
    return Envelope(stroke_m=stroke, speed_m_s=2 * np.pi * corner * stroke, current_a=current_a)


def hydraulic_arctan(rng: np.random.Generator) -> Machine:
    envelope, force = _envelope(rng, None), _between(rng, 50.0, 30e3)
    speed = envelope.speed_m_s
    values = {
        "F1": force * rng.uniform(0.5, 0.9),
        "S": _between(rng, 5.0, 50.0) / speed,
        "d": force / speed * rng.uniform(0.1, 0.5),
        "F2": 0.0,
    }
    fixed = frozenset({("arctan_damping", "F2")})
    elements = {"arctan_damping": values}
    return Machine(
        family="hydraulic_arctan",
        elements=elements,
        fixed=fixed,
        curve="arctan_damping",
        envelope=envelope,
        force_n=force,
    )


def hydraulic_piecewise(rng: np.random.Generator) -> Machine:
    envelope, force = _envelope(rng, None), _between(rng, 50.0, 30e3)
    elements = {"piecewise_linear_damping": _piecewise(rng, envelope.speed_m_s, force)}
    return Machine(
        family="hydraulic_piecewise",
        elements=elements,
        fixed=frozenset(),
        curve="piecewise_linear_damping",
        envelope=envelope,
        force_n=force,
    )


def _piecewise(rng: np.random.Generator, speed: float, force: float) -> Parameters:
    f_r = force * rng.uniform(0.5, 0.8)
    c1 = f_r / (speed * rng.uniform(0.1, 0.35))
    return {"c1": c1, "c2": c1 * rng.uniform(0.06, 0.3), "f_r": f_r}


def hydraulic_orifice(rng: np.random.Generator) -> Machine:
    envelope, force = _envelope(rng, None), _between(rng, 30.0, 20e3)
    speed = envelope.speed_m_s
    elements = {
        "viscous_damping": {"c": force / speed * rng.uniform(0.2, 0.7), "c_control": 0.0},
        "quadratic_damping": {"q": force / speed**2 * rng.uniform(0.3, 0.8)},
    }
    fixed = frozenset({("viscous_damping", "c_control")})
    return Machine(
        family="hydraulic_orifice",
        elements=elements,
        fixed=fixed,
        curve="quadratic_damping",
        envelope=envelope,
        force_n=force,
    )


def _bush(rng: np.random.Generator, envelope: Envelope, force: float, low: float, high: float) -> Parameters:
    """A bush or oil column that deflects by a share of the stroke under the full force."""
    return {"k": force / (envelope.stroke_m * _between(rng, low, high)), "c": 0.0}


def stiff_maxwell(rng: np.random.Generator) -> Machine:
    """An arctangent or two-slope dashpot behind a spring: railway yaw dampers."""
    machine = hydraulic_arctan(rng) if rng.random() < 0.6 else hydraulic_piecewise(rng)
    bush = _bush(rng, machine.envelope, machine.force_n, 0.02, 0.12)
    fixed = machine.fixed | {("series_compliance", "c")}
    return Machine(
        family="stiff_maxwell",
        elements={**machine.elements, "series_compliance": bush},
        fixed=fixed,
        curve=machine.curve,
        envelope=machine.envelope,
        force_n=machine.force_n,
    )


def valve_damper(rng: np.random.Generator) -> Machine:
    """A hydraulic damper with a proportional valve: friction, a slow valve and an oil column."""
    envelope, force = _envelope(rng, (0.3, 1.6)), _between(rng, 300.0, 20e3)
    speed = envelope.speed_m_s
    soft = force / speed * rng.uniform(0.3, 0.6)
    elements = {
        "valve_damping": {
            "c_soft": soft,
            "c_firm": soft * rng.uniform(3.0, 6.0),
            "u_soft": 0.3,
            "u_firm": 1.6,
            "w_knee": speed * rng.uniform(0.2, 0.5),
        },
        "tanh_hysteresis": {
            "alpha": force * rng.uniform(0.06, 0.15),
            "alpha_control": 0.0,
            "beta": rng.uniform(10.0, 30.0) / speed,
            "delta": rng.uniform(0.3, 1.0),
        },
        "series_compliance": _bush(rng, envelope, force, 0.01, 0.05),
        "control_lag": {"tau": _between(rng, 0.006, 0.03)},
    }
    fixed = frozenset(
        {
            ("valve_damping", "u_soft"),
            ("valve_damping", "u_firm"),
            ("tanh_hysteresis", "alpha_control"),
            ("series_compliance", "c"),
        }
    )
    return Machine(
        family="valve_damper", elements=elements, fixed=fixed, curve="valve_damping", envelope=envelope, force_n=force
    )


def mr_damper(rng: np.random.Generator) -> Machine:
    """A magnetorheological damper: hysteretic yield force and viscosity that both rise with the current."""
    top = float(rng.choice([1.0, 2.0, 5.0]))
    envelope, force = _envelope(rng, (0.0, top)), _between(rng, 50.0, 10e3)
    speed = envelope.speed_m_s
    elements: dict[str, Parameters] = {
        "tanh_hysteresis": {
            "alpha": force * rng.uniform(0.1, 0.25),
            "alpha_control": force / top * rng.uniform(0.5, 0.8),
            "beta": rng.uniform(4.0, 12.0) / speed,
            "delta": rng.uniform(0.3, 1.0),
        },
        "viscous_damping": {
            "c": force / speed * rng.uniform(0.1, 0.4),
            "c_control": force / speed / top * rng.uniform(0.1, 0.4),
        },
    }
    if rng.random() < 0.5:
        elements["linear_stiffness"] = {"k": force / envelope.stroke_m * rng.uniform(0.05, 0.2)}
    if rng.random() < 0.4:
        elements["control_lag"] = {"tau": _between(rng, 0.006, 0.03)}
    return Machine(
        family="mr_damper",
        elements=elements,
        fixed=frozenset(),
        curve="tanh_hysteresis",
        envelope=envelope,
        force_n=force,
    )


def hysteretic(rng: np.random.Generator) -> Machine:
    """A Bouc–Wen device: wire rope, friction stack, rubber, with parallel viscous or orifice damping."""
    envelope, force = _envelope(rng, None), _between(rng, 30.0, 20e3)
    give, n = envelope.stroke_m * rng.uniform(0.05, 0.25), float(rng.integers(1, 3))
    total = give ** (-n)
    share = rng.uniform(0.1, 0.45)
    elements: dict[str, Parameters] = {
        "bouc_wen": {
            "alpha": force * rng.uniform(0.4, 0.7) / give,
            "A": 1.0,
            "beta": total * share,
            "gamma": total * (1.0 - share),
            "n": n,
        }
    }
    if rng.random() < 0.6:
        elements["viscous_damping"] = {"c": force / envelope.speed_m_s * rng.uniform(0.2, 0.6), "c_control": 0.0}
    else:
        elements["quadratic_damping"] = {"q": force / envelope.speed_m_s**2 * rng.uniform(0.3, 0.8)}
    fixed = frozenset({("bouc_wen", "A"), ("bouc_wen", "n"), ("viscous_damping", "c_control")})
    return Machine(
        family="hysteretic", elements=elements, fixed=fixed, curve="bouc_wen", envelope=envelope, force_n=force
    )


FAMILIES: tuple[Callable[[np.random.Generator], Machine], ...] = (
    hydraulic_arctan,
    hydraulic_piecewise,
    hydraulic_orifice,
    stiff_maxwell,
    valve_damper,
    mr_damper,
    hysteretic,
)


def model_as_given(rng: np.random.Generator, machine: Machine) -> dict[str, object]:
    """The given model, in the layout of a model file: every free number off by up to a third."""
    paths: dict[str, list[dict[str, object]]] = {path: [] for path in ("mount", "control", "core", "sensor")}
    for element, values in machine.elements.items():
        parameters: dict[str, object] = {}
        for name, value in values.items():
            held = (element, name) in machine.fixed
            parameters[name] = {"value": value, "fixed": True} if held else value * (1.0 + rng.uniform(-1.0, 1.0) / 3.0)
        paths[PATH_OF[element]].append({"element": element, "parameters": parameters})
    return {
        "format": "damper-rig/model",
        "format_version": 1,
        "name": f"{machine.family}, as simulated today",
        "kind": "physical",
        "paths": paths,
    }
