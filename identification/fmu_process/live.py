"""One instance of an FMU that is taken from sample to sample: the work of the process in which it lives.

A sample can be tried and taken back where the FMU can save its state (`canGetAndSetFMUState`), or where it is a model
exchange, whose continuous states its caller keeps. Inputs are linear between samples, a current is held.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.fmu_process.abilities import can
from identification.fmu_process.simulate import TOLERANCE, substeps_of

Floats = NDArray[np.float64]
Values = tuple[float, ...]

_EVENTS = 1000  # within one sample: more is an FMU that chatters


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """What is taken from sample to sample: names in the FMU, in its own units; `held` inputs jump at samples."""

    path: Path
    inputs: tuple[str, ...]
    held: tuple[bool, ...]
    outputs: tuple[str, ...]
    parameters: Mapping[str, str]
    dt: float


class Instance:
    """An instance; `start` and `tried` give the outputs of its names, in their order."""

    def __init__(self, opening: Opening, folder: Path) -> None:
        """Loads it from the unpacked `folder`."""
        import fmpy
        from fmpy.simulation import instantiate_fmu

        self._opening, self._name = opening, opening.path.name
        self._description = description = fmpy.read_model_description(opening.path)
        self._together = description.coSimulation is not None
        self._third = description.fmiVersion.startswith("3")
        known = {one.name: one.valueReference for one in description.modelVariables}
        self._in = [known[name] for name in opening.inputs]
        self._out = [known[name] for name in opening.outputs]
        self._back = can(description).back
        self._fine = substeps_of(description, opening.dt) if self._together else 1
        kind = "CoSimulation" if self._together else "ModelExchange"
        # Any: fmpy carries no types
        self._fmu: Any = instantiate_fmu(str(folder), description, kind)
        self._solver: Any = None
        self._values: Values = ()
        self._next: Values = ()
        self._count = 0
        self._saved: Any = None
        self._tried: Values | None = None  # inputs of the next sample, while it can be taken back

    def start(self, values: Values) -> Values:
        """The outputs with inputs that have lasted."""
        from fmpy.simulation import apply_start_values, settable_in_initialization_mode, settable_in_instantiated

        given: dict[str, Any] = dict(self._opening.parameters)
        if not self._third:
            self._fmu.setupExperiment(startTime=0.0)
        given = apply_start_values(self._fmu, self._description, given, settable=settable_in_instantiated)
        self._fmu.enterInitializationMode(**({"startTime": 0.0} if self._third else {}))
        given = apply_start_values(self._fmu, self._description, given, settable=settable_in_initialization_mode)
        if given:
            raise SimulationError(f"{self._name}: {', '.join(given)} cannot be set before the start")
        self._set(values)
        self._fmu.exitInitializationMode()
        if not self._together:
            self._values = self._next = values
            self._update()
            self._solver = _solver(self._fmu, self._description, self._opening.dt, self._set_at)
        self._values = values
        self._save()
        return self._get(0.0)

    def tried(self, kept: bool, values: Values) -> Values:
        """The outputs if the inputs at the next sample were these; `kept`: the sample tried before has been taken."""
        if kept:
            self.keep()
        if self._tried is not None:
            self._restore()
        self._step(values)
        self._tried = values
        return self._get(self._opening.dt * (self._count + 1))

    def keep(self) -> None:
        """The sample that was tried is taken."""
        assert self._tried is not None  # by the order of the caller
        self._count, self._values, self._tried = self._count + 1, self._tried, None
        self._save()

    def end(self) -> None:
        """Frees what the FMU holds."""
        self._solver = None
        self._fmu.freeInstance()

    def _step(self, values: Values) -> None:
        if not self._together:
            self._integrate(values)
            return
        dt, fine = self._opening.dt, self._fine
        for k in range(1, fine + 1):
            self._set(self._between(values, k / fine))
            begin = dt * (self._count + (k - 1) / fine)
            answer = self._fmu.doStep(begin, dt / fine, not self._back)
            if self._third and answer[1]:
                raise SimulationError(f"{self._name} ends its simulation at {begin:.6g} s")

    def _integrate(self, values: Values) -> None:
        """A step of a model exchange, event by event."""
        dt = self._opening.dt
        begin, end = dt * self._count, dt * (self._count + 1)
        self._next = values
        self._set_at(begin)
        self._solver.reset(begin)
        now = begin
        for _ in range(_EVENTS):
            event, _, now = self._solver.step(now, end)
            self._fmu.setTime(now)
            self._set_at(now)
            if self._description.modelExchange.needsCompletedIntegratorStep:
                stepped, ended = self._fmu.completedIntegratorStep()
                if ended:
                    raise SimulationError(f"{self._name} ends its simulation at {now:.6g} s")
                event = event or stepped
            if event:
                self._fmu.enterEventMode()
                self._update()
                self._solver.reset(now)
            if now >= end or math.isclose(now, end):
                return
        raise SimulationError(f"{self._name} has more than {_EVENTS} events between {begin:.6g} and {end:.6g} s")

    def _update(self) -> None:
        """Discrete states until they rest, then continuous time."""
        update = self._fmu.updateDiscreteStates if self._third else self._fmu.newDiscreteStates
        for _ in range(_EVENTS):
            again, ended, *_ = update()
            if ended:
                raise SimulationError(f"{self._name} ends its simulation")
            if not again:
                break
        self._fmu.enterContinuousTimeMode()

    def _set_at(self, time: float) -> None:
        """Inputs at a time between the last sample and the next."""
        share = time / self._opening.dt - self._count
        self._set(self._between(self._next, min(max(share, 0.0), 1.0)))

    def _between(self, values: Values, share: float) -> Values:
        if share >= 1.0:
            return values
        pairs = zip(self._values, values, self._opening.held, strict=True)
        return tuple(a if held else a + share * (b - a) for a, b, held in pairs)

    def _set(self, values: Values) -> None:
        (self._fmu.setFloat64 if self._third else self._fmu.setReal)(self._in, list(values))

    def _get(self, time: float) -> Values:
        found = (self._fmu.getFloat64 if self._third else self._fmu.getReal)(self._out)
        for name, value in zip(self._opening.outputs, found, strict=True):
            if not math.isfinite(value):
                raise SimulationError(f"{self._name} gives {value} for {name} at t = {time:.6g} s")
        return tuple(float(value) for value in found)

    def _save(self) -> None:
        if not self._back:
            return
        before = self._saved
        self._saved = _state(self._fmu, self._description, self._third)
        if before is not None and not isinstance(before, np.ndarray):
            (self._fmu.freeFMUState if self._third else self._fmu.freeFMUstate)(before)

    def _restore(self) -> None:
        if not self._back:
            raise SimulationError(f"{self._name} cannot be taken back a step")
        if isinstance(self._saved, np.ndarray):
            self._fmu.setTime(self._opening.dt * self._count)
            self._fmu.setContinuousStates(_pointer(self._saved), self._saved.size)
        elif self._saved is not None:
            (self._fmu.setFMUState if self._third else self._fmu.setFMUstate)(self._saved)


def _state(fmu: Any, description: Any, third: bool) -> Any:
    """The state of the FMU where it saves one, else its continuous states. Any: fmpy carries no types."""
    kind = description.coSimulation or description.modelExchange
    if kind.canGetAndSetFMUstate:
        return (fmu.getFMUState if third else fmu.getFMUstate)()
    states = np.zeros(description.numberOfContinuousStates)
    fmu.getContinuousStates(_pointer(states), states.size)
    return states


def _pointer(values: Floats) -> Any:
    """For C. Any: ctypes."""
    from ctypes import POINTER, c_double

    return values.ctypes.data_as(POINTER(c_double))


def _solver(fmu: Any, description: Any, dt: float, set_inputs: Any) -> Any:
    """The solver of a model exchange, with inputs that move within a step. Any: fmpy carries no types."""
    from fmpy.sundials import CVodeSolver

    class Inputs:
        def apply(self, time: float) -> None:
            set_inputs(time)

    class Moving(CVodeSolver):  # type: ignore[misc]  # fmpy carries no types
        def f(self, t: float, y: Any, ydot: Any, user_data: Any) -> int:
            set_inputs(t)
            return int(super().f(t, y, ydot, user_data))

    third = description.fmiVersion.startswith("3")
    return Moving(
        nx=description.numberOfContinuousStates, nz=description.numberOfEventIndicators,
        get_x=fmu.getContinuousStates, set_x=fmu.setContinuousStates,
        get_dx=fmu.getContinuousStateDerivatives if third else fmu.getDerivatives, get_z=fmu.getEventIndicators,
        get_nominals=fmu.getNominalsOfContinuousStates, set_time=fmu.setTime, input=Inputs(), startTime=0.0,
        maxStep=dt, relativeTolerance=TOLERANCE,
    )  # fmt: skip
