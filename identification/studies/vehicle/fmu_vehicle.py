"""A vehicle of the user's own that another program has exported as an FMU."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import STRICT
from identification.errors import ModelError
from identification.fmu import Described, Variable, describe_fmu
from identification.fmu_process.live import Opening, Values
from identification.fmu_process.live_process import LiveProcess

Floats = NDArray[np.float64]

_PATIENCE_S = 600.0  # for one step


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuDamper:
    """Where a damper acts: outputs for its extension and the rate of it, and the input for its force.

    A force above 0 pulls the ends together, an extension above 0 is longer; a minus before a name reverses a sign.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str
    extension: str
    rate: str
    force: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuGround:
    """Inputs that move the vehicle: a displacement, and where the FMU has them its derivatives.

    `behind_m` is how far behind the first wheel this one meets the road.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    displacement: str
    velocity: str = ""
    acceleration: str = ""
    behind_m: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.behind_m <= 100.0:
            raise ModelError(f"behind is {self.behind_m:g} m: it must lie within 0 … 100")


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuWiring:
    """Which variable of a vehicle FMU is what; `output`: the outputs that a study shows."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    damper: tuple[FmuDamper, ...]
    ground: tuple[FmuGround, ...]
    output: tuple[str, ...]
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for what, given in (("damper", self.damper), ("ground", self.ground), ("output", self.output)):
            if not given:
                raise ModelError(f"{what} is empty: the vehicle needs one or more")
        names = [one.name for one in self.damper]
        if len(set(names)) < len(names):
            raise ModelError(f"two dampers are called '{max(names, key=names.count)}': give each its own name")


@dataclass(frozen=True, slots=True)
class _Line:
    """One variable: SI = factor·variable + offset."""

    name: str
    factor: float
    offset: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuVehicle:
    """A `Vehicle` that steps in a process of its own. Made by `open_vehicle`."""

    path: Path
    wiring: FmuWiring
    back: bool
    ins: tuple[_Line, ...]  # forces, then (x, v, a) of every ground as far as it has them
    outs: tuple[_Line, ...]  # extension and rate of every damper, then the outputs
    process: LiveProcess = field(repr=False, compare=False)

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.path.name

    @property
    def dampers(self) -> tuple[str, ...]:
        """The places for dampers."""
        return tuple(one.name for one in self.wiring.damper)

    @property
    def grounds(self) -> tuple[str, ...]:
        """What moves it."""
        return tuple(one.displacement for one in self.wiring.ground)

    @property
    def outputs(self) -> Mapping[str, str]:
        """The outputs, name to unit."""
        count = 2 * len(self.wiring.damper)
        return {line.name: line.unit for line in self.outs[count:]}

    def steps(self, dt: float) -> FmuSteps:
        """A vehicle of its own at the step `dt`, s; raises SimulationError where the FMU cannot begin."""
        return FmuSteps(self, dt)

    def close(self) -> None:
        """End its process."""
        self.process.close()


def open_vehicle(path: Path, wiring: FmuWiring) -> FmuVehicle:
    """The vehicle in an FMU; raises ModelError, one line, where it cannot be used or lacks a variable."""
    found = describe_fmu(path)
    into, out = {v.name: v for v in found.inputs}, {v.name: v for v in found.outputs}
    forces = [_line(path, "force", one.force, into, "input") for one in wiring.damper]
    moved = [
        _line(path, "ground", name, into, "input")
        for one in wiring.ground
        for name in (one.displacement, one.velocity, one.acceleration)
        if name
    ]
    motions = [
        _line(path, "damper", name, out, "output") for one in wiring.damper for name in (one.extension, one.rate)
    ]
    shown = [_line(path, "output", name, out, "output") for name in wiring.output]
    _check_parameters(path, wiring, found)
    process = LiveProcess(path.name, _PATIENCE_S)
    return FmuVehicle(
        path=path, wiring=wiring, back=found.can.back, ins=(*forces, *moved), outs=(*motions, *shown), process=process
    )


def _line(path: Path, what: str, name: str, known: Mapping[str, Variable], causality: str) -> _Line:
    bare = name.removeprefix("-")
    if bare not in known:
        has = ", ".join(sorted(known)) or "none"
        raise ModelError(f"{path}: {what} is {name!r:.60}: it is no {causality} of the FMU, which has {has}")
    one, sign = known[bare], -1.0 if name.startswith("-") else 1.0
    return _Line(name=bare, factor=sign * one.factor, offset=sign * one.offset, unit=_unit(one))


def _unit(variable: Variable) -> str:
    """The unit in SI; as the FMU states it where its dimension is not known."""
    if variable.dimension is None:
        return variable.unit
    powers = dict(zip(("kg", "m", "s", "A", "K"), variable.dimension, strict=True))
    known = {(0, 1, 0): "m", (0, 1, -1): "m/s", (0, 1, -2): "m/s²", (1, 1, -2): "N", (0, 0, 0): "1"}
    return known.get((powers["kg"], powers["m"], powers["s"]), variable.unit)


def _check_parameters(path: Path, wiring: FmuWiring, found: Described) -> None:
    for name in wiring.parameters:
        if name not in found.names:
            raise ModelError(f"{path}: the FMU has no variable {name!r:.60}: it has {', '.join(found.names[:12])}, …")


class FmuSteps:
    """The vehicle at a fixed step: one instance, which is where it was last taken to."""

    def __init__(self, vehicle: FmuVehicle, dt: float) -> None:
        """A new instance at the step `dt`, s."""
        self._vehicle, self._dt = vehicle, dt
        opening = Opening(
            path=vehicle.path, inputs=tuple(one.name for one in vehicle.ins), held=(False,) * len(vehicle.ins),
            outputs=tuple(one.name for one in vehicle.outs), dt=dt,
            parameters={name: repr(value) for name, value in vehicle.wiring.parameters.items()},
        )  # fmt: skip
        self._instance = vehicle.process.begin(opening)
        self._kept = np.zeros(len(vehicle.outs))

    def start(self) -> Floats:
        """As the FMU begins, on level ground and without forces: extension and rate of every damper."""
        level = np.zeros((len(self._vehicle.grounds), 3))
        self._kept = self._outputs(self._instance.start, level, np.zeros(len(self._vehicle.dampers)))
        return self.state()

    def leap(self, state: Floats, before: Floats, after: Floats, forces: Floats) -> FmuLeap:
        """A step whose forces at the end are open."""
        return FmuLeap(self, after, self._vehicle.back)

    def motions(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """Motion of every damper where the vehicle is, (D, 3), accelerations 0."""
        return self.moved(self._kept, self._kept)

    def observe(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """The outputs where the vehicle is."""
        return self._kept[2 * len(self._vehicle.dampers) :]

    def state(self) -> Floats:
        """Extension and rate of every damper."""
        return self._kept[: 2 * len(self._vehicle.dampers)].copy()

    def tried(self, after: Floats, forces: Floats) -> Floats:
        """Motion of every damper at the end of a step, (D, 3), which is taken back."""
        return self.moved(self._outputs(self._instance.tried, after, forces), self._kept)

    def taken(self, after: Floats, forces: Floats) -> Floats:
        """The same; the step has been taken."""
        before, self._kept = self._kept, self._outputs(self._instance.taken, after, forces)
        return self.moved(self._kept, before)

    def moved(self, now: Floats, before: Floats) -> Floats:
        """Extension, rate, and the change of the rate over a step, (D, 3)."""
        count = 2 * len(self._vehicle.dampers)
        ends, earlier = now[:count].reshape(-1, 2), before[:count].reshape(-1, 2)
        return np.column_stack([ends, (ends[:, 1] - earlier[:, 1]) / self._dt])

    def _outputs(self, what: Callable[[Values], Values], given: Floats, forces: Floats) -> Floats:
        """The outputs, SI."""
        rows = [
            given[k, order]
            for k, one in enumerate(self._vehicle.wiring.ground)
            for order, name in enumerate((one.displacement, one.velocity, one.acceleration))
            if name
        ]
        pairs = zip([*forces, *rows], self._vehicle.ins, strict=True)
        found = what(tuple(float((v - i.offset) / i.factor) for v, i in pairs))
        return np.array([i.factor * v + i.offset for v, i in zip(found, self._vehicle.outs, strict=True)])


class FmuLeap:
    """The end of a step. A vehicle that cannot be taken back meets the forces of the step's beginning there."""

    def __init__(self, steps: FmuSteps, after: Floats, back: bool) -> None:
        """A step to the ground `after`."""
        self._steps, self._after, self._back = steps, after, back
        self._taken: Floats | None = None

    def motions(self, forces: Floats) -> Floats:
        """Motion of every damper at the end, (D, 3)."""
        if self._taken is not None:
            return self._taken
        if self._back:
            return self._steps.tried(self._after, forces)
        self._taken = self._steps.taken(self._after, forces)
        return self._taken

    def state(self, forces: Floats) -> Floats:
        """Takes the step; extension and rate of every damper there."""
        if self._taken is None:
            self._taken = self._steps.taken(self._after, forces)
        return self._steps.state()
