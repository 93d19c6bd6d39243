"""An FMU as a kind of model: opened once in a process of its own, which simulates its force along motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identification.errors import IdentificationError, ModelError
from identification.fmu.stepping import FmuStepper
from identification.fmu_process.choice import Choice
from identification.fmu_process.live_process import LiveProcess
from identification.fmu_process.process import ForeignProcess
from identification.fmu_process.simulate import Described, Task, described, forces, opened
from identification.fmu_process.wiring import Wire, Wiring
from identification.models.motion import Motion
from identification.models.protocol import TrainingRange
from identification.models.simulation import with_simulation
from identification.signals import SIGNALS
from rigctl.runfile import Run

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """How long an answer may take, s: `least_s`, or a multiple of the motion's duration where that is longer."""

    open_s: float = 120.0
    least_s: float = 600.0
    times: float = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuModel:
    """A foreign simulation. None of its parameters can be fitted."""

    path: Path
    wiring: Wiring
    process: ForeignProcess = field(repr=False, compare=False)
    patience: Patience = Patience()
    live: LiveProcess = field(repr=False, compare=False)

    @property
    def foresees(self) -> bool:
        """Whether a step can be taken back, so that the force for another motion can be asked for."""
        return self.wiring.back

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.path.name

    @property
    def kind(self) -> str:
        """The kind of model."""
        return "fmu"

    @property
    def inputs(self) -> Mapping[str, str]:
        """Channels that a run must have, and the input of the FMU that each drives."""
        needed = [(wire.channel, f"input '{wire.variable.name}' of {self.name}") for wire in self.wiring.inputs]
        return {channel if channel in ("current", "temperature") else "displacement": user for channel, user in needed}

    @property
    def training_range(self) -> TrainingRange | None:
        """None: nothing in an FMU states it."""
        return None

    def names(self) -> Sequence[str]:
        """None: a parameter of an FMU states neither its meaning nor its bounds."""
        return ()

    def values(self) -> Floats:
        """No parameters."""
        return np.empty(0)

    def free(self) -> NDArray[np.bool_]:
        """No parameters."""
        return np.empty(0, dtype=np.bool_)

    def bounds(self) -> tuple[Floats, Floats]:
        """No parameters."""
        return np.empty(0), np.empty(0)

    def force(self, motion: Motion) -> Floats:
        """Force along a motion, (N,), N; raises SimulationError where the FMU fails, crashes or hangs."""
        values = tuple(_given(wire, motion) for wire in self.wiring.inputs)
        task = Task(path=self.path, wiring=self.wiring, dt=motion.dt, values=values)
        patience_s = max(self.patience.least_s, self.patience.times * motion.x.size * motion.dt)
        return self.process.ask(forces, task, patience_s)

    def stepper(self, dt: float) -> FmuStepper:
        """A damper of its own at the step `dt`, s; raises SimulationError where the FMU cannot begin."""
        live = LiveProcess(self.name, self.patience.least_s) if self.wiring.once else self.live
        return FmuStepper(self.path, self.wiring, dt, live)

    def close(self) -> None:
        """End the FMU's processes."""
        self.process.close()
        self.live.close()


def describe_fmu(path: Path, patience: Patience | None = None) -> Described:
    """What is in an FMU that need not be a damper; raises ModelError, one line that names the file."""
    _check_there(path)
    process = ForeignProcess(path.name)
    try:
        return process.ask(described, path, (patience or Patience()).open_s)
    finally:
        process.close()


def open_fmu(path: Path, choice: Choice | None = None, *, patience: Patience | None = None) -> FmuModel:
    """The FMU of a file, its variables connected; raises ModelError, one line that names the file."""
    _check_there(path)
    patience = patience or Patience()
    process = ForeignProcess(path.name)
    try:
        wiring = process.ask(opened, (path, choice or Choice()), patience.open_s)
    except IdentificationError:
        process.close()
        raise
    live = LiveProcess(path.name, patience.least_s)
    return FmuModel(path=path, wiring=wiring, process=process, patience=patience, live=live)


def _check_there(path: Path) -> None:
    if find_spec("fmpy") is None:
        raise ModelError(f"{path}: FMUs need the package fmpy: pip install 'damper-rig[fmu]'")
    if not path.is_file():
        raise ModelError(f"{path}: can't be read (no such file): give an FMU")


def with_fmu(
    path: Path,
    runs: Sequence[Run],
    choice: Choice | None = None,
    *,
    on_progress: Callable[[float, str], None] | None = None,
) -> list[Run]:
    """The runs with a channel `force_simulated`: the force of the FMU for their motion, current and temperature.

    Raises ModelError where the file can't be used, DataError where a run lacks a channel that drives the FMU, and
    SimulationError where the FMU fails on a run.
    """
    model = open_fmu(path, choice)
    try:
        return with_simulation(model, runs, on_progress=on_progress)
    finally:
        model.close()


def _given(wire: Wire, motion: Motion) -> Floats:
    """The values of the variable, in its unit."""
    factor, offset = wire.gain()
    row: Floats = getattr(motion, SIGNALS[wire.channel])
    return np.asarray((row - offset) / factor, dtype=np.float64)
