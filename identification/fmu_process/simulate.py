"""The work of the process of an FMU: read its description, connect its variables, simulate it along a motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError, SimulationError
from identification.fmu_process.abilities import Can, can
from identification.fmu_process.choice import Choice
from identification.fmu_process.wiring import DIMENSIONS, Variable, Wiring, wired

Floats = NDArray[np.float64]

TOLERANCE = 1e-8  # of the solver of model exchange: its default of 1e-4 gives a lag of nearly a millisecond
SUBSTEPS = 4  # of a sample: an input is held through each, which delays its integral by half of one
_SPELLED = {  # unit: what it measures, SI units in one, offset
    "m": ("displacement", 1.0, 0.0), "mm": ("displacement", 1e-3, 0.0), "cm": ("displacement", 1e-2, 0.0),
    "m/s": ("velocity", 1.0, 0.0), "mm/s": ("velocity", 1e-3, 0.0), "m/s2": ("acceleration", 1.0, 0.0),
    "N": ("force", 1.0, 0.0), "kN": ("force", 1e3, 0.0), "A": ("current", 1.0, 0.0), "mA": ("current", 1e-3, 0.0),
    "K": ("temperature", 1.0, 0.0), "degC": ("temperature", 1.0, 273.15), "°C": ("temperature", 1.0, 273.15),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Described:
    """The variables of an FMU that matter here, the names of all, and what it can do."""

    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    names: tuple[str, ...]
    can: Can


def opened(asked: tuple[Path, Choice]) -> Wiring:
    """In the other process: read the description of a damper and connect it; raises ModelError."""
    path, choice = asked
    found = described(path)
    try:
        wiring = wired(found.inputs, found.outputs, found.names, choice)
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from error
    return replace(wiring, back=found.can.back, once=found.can.once)


def described(path: Path) -> Described:
    """In the other process: the description of an FMU that runs on this machine; raises ModelError."""
    import fmpy

    try:
        description = fmpy.read_model_description(path)
        platforms = fmpy.supported_platforms(path)
    except Exception as error:  # fmpy raises what its parsers raise
        raise ModelError(f"{path}: not an FMU that can be read ({_line(error)})") from error
    if description.fmiVersion.startswith("1"):
        raise ModelError(f"{path}: FMI {description.fmiVersion}: export it as FMI 2.0 or 3.0")
    if fmpy.platform not in platforms:
        has = ", ".join(sorted(platforms)) or "no platform"
        raise ModelError(f"{path}: contains binaries for {has}, this machine is {fmpy.platform}: export it for that")
    if description.coSimulation is None and description.modelExchange is None:
        raise ModelError(f"{path}: neither co-simulation nor model exchange: export it as one of them")
    # Any: fmpy's variables carry no types
    variables: list[Any] = description.modelVariables
    of = {
        causality: tuple(_variable(v, description) for v in variables if v.causality == causality)
        for causality in ("input", "output")
    }
    return Described(
        inputs=of["input"], outputs=of["output"], names=tuple(v.name for v in variables), can=can(description)
    )


def _variable(found: Any, description: Any) -> Variable:
    # Any: fmpy's classes carry no types
    unit = found.unit or (found.declaredType.unit if found.declaredType is not None else None) or ""
    for definition in description.unitDefinitions:
        base = definition.baseUnit
        if definition.name == unit and base is not None and not (base.mol or base.cd or base.rad):
            powers = (base.kg, base.m, base.s, base.A, base.K)
            return Variable(name=found.name, unit=unit, dimension=powers, factor=base.factor, offset=base.offset)
    return _spelled(found.name, unit)


def _spelled(name: str, unit: str) -> Variable:
    """A unit that the FMU does not define, by its usual spelling."""
    found = _SPELLED.get(unit.replace("²", "2").replace("^", ""))
    if found is None:
        return Variable(name=name, unit=unit)
    measures, factor, offset = found
    return Variable(name=name, unit=unit, dimension=DIMENSIONS[measures], factor=factor, offset=offset)


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One run for the other process: time from 0 in steps of `dt`, a row of values for every wire."""

    path: Path
    wiring: Wiring
    dt: float
    values: tuple[Floats, ...]


def forces(task: Task) -> Floats:
    """In the other process: force of the FMU at every sample, N."""
    import fmpy

    description = fmpy.read_model_description(task.path)
    together = description.coSimulation is not None
    fine = substeps_of(description, task.dt) if together else SUBSTEPS
    step, count = task.dt / fine, task.values[0].size
    time = np.arange((count - 1) * fine + 1, dtype=np.float64) * np.float64(step)
    reached = [0.0]

    def note(at: float, recorder: object) -> bool:
        reached[0] = at
        return True

    output = task.wiring.force.variable.name
    try:
        found = fmpy.simulate_fmu(
            str(task.path),
            start_time=0.0,
            stop_time=float(time[-1]),
            output_interval=step,
            fmi_type="CoSimulation" if together else "ModelExchange",
            relative_tolerance=None if together else TOLERANCE,
            record_events=False,
            start_values=dict(task.wiring.parameters),
            input=_input_table(task, time, step if together else 0.0),
            output=[output],
            step_finished=note,
            model_description=description,
            remote_platform=None,
        )
    except Exception as error:  # fmpy and foreign code raise anything
        raise SimulationError(f"{task.path.name} fails at t = {reached[0]:.6g} s: {_line(error)}") from error
    force = np.interp(np.arange(count) * task.dt, found["time"], found[output])
    bad = np.flatnonzero(~np.isfinite(force))
    if bad.size:
        raise SimulationError(f"{task.path.name} gives a force of {force[bad[0]]} at t = {bad[0] * task.dt:.6g} s")
    factor, offset = task.wiring.force.gain()
    return np.asarray(factor * force + offset, dtype=np.float64)


def substeps_of(description: Any, dt: float) -> int:
    """Steps of co-simulation per sample, by the fixed step of the FMU. Any: fmpy carries no types."""
    fixed = description.coSimulation.fixedInternalStepSize
    if not fixed:
        return SUBSTEPS
    fits = [n for n in range(1, SUBSTEPS + 1) if abs(dt / n / fixed - round(dt / n / fixed)) < 1e-6 * dt / fixed]
    return max(fits, default=1)


def _input_table(task: Task, time: Floats, ahead: float) -> NDArray[np.void]:
    """Inputs over time for fmpy, which sets them at the start of a step: given there is the value at its end.

    A force that depends directly on an input then has no lag. Current is held between samples, motion is linear.
    """
    names = [wire.variable.name for wire in task.wiring.inputs]
    table = np.zeros(time.size, dtype=[("time", np.float64), *((name, np.float64) for name in names)])
    table["time"] = time
    sampled = np.arange(task.values[0].size) * task.dt
    for wire, values in zip(task.wiring.inputs, task.values, strict=True):
        if wire.channel == "current":
            at = np.floor((time + ahead) / task.dt + 1e-6).astype(np.int64)
            table[wire.variable.name] = values[np.minimum(at, values.size - 1)]
        else:
            table[wire.variable.name] = np.interp(time + ahead, sampled, values)
    return table


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
