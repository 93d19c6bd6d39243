"""Which variable of an FMU is which channel of a run: by the user's choice, by name, or by unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from identification.errors import ModelError
from identification.fmu_process.choice import Choice
from identification.signals import SIGNALS

INPUTS = tuple(SIGNALS)

# Dimension of a channel as powers of kg, m, s, A, K.
Dimension = tuple[int, int, int, int, int]
DIMENSIONS: dict[str, Dimension] = {
    "displacement": (0, 1, 0, 0, 0),
    "velocity": (0, 1, -1, 0, 0),
    "acceleration": (0, 1, -2, 0, 0),
    "current": (0, 0, 0, 1, 0),
    "temperature": (0, 0, 0, 0, 1),
    "force": (1, 1, -2, 0, 0),
}
_NAMES = {
    "displacement": ("displacement", "x", "s", "stroke", "position", "s_rel", "deflection", "travel"),
    "velocity": ("velocity", "v", "speed", "xdot", "x_dot", "v_rel", "dx", "der_x"),
    "acceleration": ("acceleration", "a", "xddot", "a_rel"),
    "current": ("current", "i", "control_current"),
    "temperature": ("temperature", "t", "t_oil", "theta"),
    "force": ("force", "f", "damper_force", "f_damper", "force_out", "load"),
}
_KELVIN_AT_ZERO_DEGC = 273.15


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """One input or output: its unit is `factor` SI units beyond `offset`; dimension None where no unit is known."""

    name: str
    unit: str = ""
    dimension: Dimension | None = None
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Wire:
    """A channel in SI units (temperature in °C) and a variable: variable = (channel + shift − offset) / factor."""

    channel: str
    variable: Variable
    sign: float = 1.0

    @property
    def _offset(self) -> float:
        kelvin = self.channel == "temperature" and self.variable.dimension is not None
        return self.variable.offset - (_KELVIN_AT_ZERO_DEGC if kelvin else 0.0)

    def gain(self) -> tuple[float, float]:
        """(factor, offset) of channel = sign·(factor·variable + offset)."""
        return self.sign * self.variable.factor, self.sign * self._offset


@dataclass(frozen=True, slots=True, kw_only=True)
class Wiring:
    """The inputs and the force of the FMU, and the values of its parameters.

    `back`: a step can be taken back; `once`: a process can hold one instance only.
    """

    inputs: tuple[Wire, ...]
    force: Wire
    parameters: Mapping[str, str]
    back: bool = False
    once: bool = False


def wired(inputs: Sequence[Variable], outputs: Sequence[Variable], known: Sequence[str], choice: Choice) -> Wiring:
    """Connect the variables of an FMU; `known` are the names of all of them.

    Raises ModelError, one line that lists the variables, where an input or the force cannot be recognised, or a name
    does not exist.
    """
    _check_names(known, choice)
    wires = tuple(_input(v, inputs, choice) for v in inputs if v.name not in choice.parameters)
    channels = [w.channel for w in wires]
    for channel in INPUTS:
        both = [w.variable.name for w in wires if w.channel == channel]
        if len(both) > 1:
            raise ModelError(
                f"inputs {' and '.join(both)} both look like {channel}: choose one by --fmu-input {channel}=VARIABLE "
                "and give the other a value by --fmu-set"
            )
    if not {"displacement", "velocity"} & set(channels):
        raise ModelError(f"no input is a displacement or a velocity: it has {_listed(inputs)}; --fmu-input names one")
    return Wiring(inputs=wires, force=_force(outputs, choice), parameters=choice.parameters)


def _check_names(known: Sequence[str], choice: Choice) -> None:
    for name in (*choice.inputs.values(), *choice.parameters, *filter(None, [choice.force.removeprefix("-")])):
        if name not in known:
            raise ModelError(f"the FMU has no variable {name!r:.60}: it has {', '.join(sorted(known)[:12])}, …")


def _input(variable: Variable, inputs: Sequence[Variable], choice: Choice) -> Wire:
    said = [channel for channel, name in choice.inputs.items() if name == variable.name]
    found = said or _by_name(variable, INPUTS) or _by_unit(variable, inputs)
    if not found:
        raise ModelError(
            f"input {_shown(variable)} is not known: name its channel by --fmu-input CHANNEL={variable.name} "
            f"({', '.join(INPUTS)}), or give it a value by --fmu-set {variable.name}=VALUE"
        )
    return Wire(channel=found[0], variable=variable)


def _force(outputs: Sequence[Variable], choice: Choice) -> Wire:
    if choice.force:
        name = choice.force.removeprefix("-")
        found = [v for v in outputs if v.name == name]
        if not found:
            raise ModelError(f"{name!r} is not an output of the FMU: it has {_listed(outputs)}")
        return Wire(channel="force", variable=found[0], sign=-1.0 if choice.force.startswith("-") else 1.0)
    named = [v for v in outputs if _by_name(v, ("force",))]
    forces = named or [v for v in outputs if v.dimension == DIMENSIONS["force"]]
    if len(forces) != 1:
        what = "more than one output is a force" if forces else "no output is a force"
        raise ModelError(f"{what}: it has {_listed(forces or outputs)}; name the damper's by --fmu-output VARIABLE")
    return Wire(channel="force", variable=forces[0])


def _by_name(variable: Variable, channels: Sequence[str]) -> list[str]:
    name = variable.name.rsplit(".", 1)[-1].lower()
    return [
        channel for channel in channels if name in _NAMES[channel] and variable.dimension in (None, DIMENSIONS[channel])
    ]


def _by_unit(variable: Variable, inputs: Sequence[Variable]) -> list[str]:
    """The channel of its unit, where no other input has that unit."""
    alone = sum(v.dimension == variable.dimension for v in inputs) == 1
    return [c for c in INPUTS if alone and variable.dimension == DIMENSIONS[c]]


def _listed(variables: Sequence[Variable]) -> str:
    return ", ".join(_shown(v) for v in variables) or "none"


def _shown(variable: Variable) -> str:
    return f"{variable.name} ({variable.unit})" if variable.unit else variable.name
