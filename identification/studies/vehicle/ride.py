"""A vehicle with dampers of any kind over a moving ground, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError, SimulationError
from identification.models.inputs import ROOM_TEMPERATURE_DEGC
from identification.models.protocol import SimulationModel, TrainingRange
from identification.models.stepping import steppable
from identification.studies.vehicle.coupling import Coupling, moment
from identification.studies.vehicle.protocol import Ground, Vehicle

Floats = NDArray[np.float64]

_FARTHEST = 1e3  # m, m/s or rad of a state: a vehicle that is there has run away
_TELL = 500  # samples between two words on progress


class Control(Protocol):
    """What sets the currents of the dampers."""

    def begin(self, vehicle: Vehicle, dt: float) -> None:
        """Forget the last ride."""
        ...

    def currents(self, time: float, outputs: Mapping[str, float], motions: Floats) -> Floats:
        """Currents (D,), A, from now to the next sample; `motions` (D, 3) of the dampers."""
        ...


@dataclass(frozen=True, slots=True)
class Held:
    """The same current in every damper, A."""

    current: float

    def begin(self, vehicle: Vehicle, dt: float) -> None:
        """Nothing to forget."""

    def currents(self, time: float, outputs: Mapping[str, float], motions: Floats) -> Floats:
        """The current, (D,)."""
        return np.full(motions.shape[0], self.current)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ride:
    """What a vehicle answered: outputs by name, (N,), and of each damper its motion, current and force, (N, D), SI.

    `loose` counts the samples at which the forces of the dampers did not come to agree with the motion. `missed` is the
    rms, N, (D,), by which the guessed force of a damper that cannot be taken back a sample was off; 0 of the others.
    """

    time: Floats
    outputs: Mapping[str, Floats]
    x: Floats
    v: Floats
    a: Floats
    current: Floats
    force: Floats
    loose: int
    missed: Floats


def ride(
    vehicle: Vehicle,
    dampers: Mapping[str, SimulationModel],
    ground: Ground,
    *,
    control: Control | None = None,
    temperature: float = ROOM_TEMPERATURE_DEGC,
    on_progress: Callable[[float, str], None] | None = None,
) -> Ride:
    """The vehicle over a ground, at the ground's step, with a damper model in each of its places.

    At every sample the force of each damper agrees with the motion that it leaves: the force at the end of the step is
    solved for, so that a stiff damper on a light mass costs no stability.

    Raises
    ------
    DataError
        before the work, one line: a place without a damper, a model that needs a current where no control gives one, or
        that can't be taken from sample to sample.
    SimulationError
        where a model has no such step, or the vehicle runs away, with the time.
    """
    check_dampers(vehicle, dampers, ground, control)
    control = control or Held(0.0)
    names, steps = tuple(vehicle.outputs), vehicle.steps(ground.dt)
    steppers = [steppable(dampers[place]).stepper(ground.dt) for place in vehicle.dampers]
    given = np.stack([ground.x, ground.v, ground.a], axis=2)
    samples, count = ground.x.shape[0], len(steppers)
    told = np.empty((samples, len(names)))
    rows = np.empty((samples, 5, count))  # x, v, a, current and force
    state, forces = steps.start(), np.zeros(count)
    motions = steps.motions(state, given[0], forces)
    control.begin(vehicle, ground.dt)
    currents = control.currents(0.0, dict.fromkeys(names, 0.0), motions)
    for k, one in enumerate(steppers):
        forces[k] = one.start(moment(motions[k], float(currents[k]), temperature))
    coupling, loose = Coupling(steppers, temperature), 0
    for n in range(samples):
        if n:
            leap = steps.leap(state, given[n - 1], given[n], forces)
            forces, met = coupling.settle(leap, forces, currents)
            loose += not met
            state, motions = leap.state(forces), leap.motions(forces)
            _check_near(vehicle, state, n * ground.dt)
        told[n] = steps.observe(state, given[n], forces)
        rows[n, :3], rows[n, 3], rows[n, 4] = motions.T, currents, forces
        currents = control.currents(n * ground.dt, dict(zip(names, told[n], strict=True)), motions)
        if on_progress is not None and n % _TELL == 0:
            on_progress(n / samples, f"{vehicle.name}: {n * ground.dt:.1f} s")
    x, v, a, current, force = (rows[:, k] for k in range(5))
    outputs = {name: told[:, k] for k, name in enumerate(names)}
    return Ride(
        time=ground.time,
        outputs=outputs,
        x=x,
        v=v,
        a=a,
        current=current,
        force=force,
        loose=loose,
        missed=np.sqrt(coupling.missed / samples),
    )


def check_dampers(
    vehicle: Vehicle, dampers: Mapping[str, SimulationModel], ground: Ground, control: Control | None
) -> None:
    """Raise DataError, one line, where these dampers cannot be driven in this vehicle."""
    missing = [place for place in vehicle.dampers if place not in dampers]
    if missing or len(dampers) != len(vehicle.dampers):
        raise DataError(
            f"{vehicle.name} has the dampers {', '.join(vehicle.dampers)}: models are given for {', '.join(dampers)}"
        )
    if ground.x.shape[1] != len(vehicle.grounds):
        raise DataError(f"{vehicle.name} stands on {len(vehicle.grounds)} grounds: {ground.x.shape[1]} are given")
    for model in dampers.values():
        steppable(model)
        if "current" in model.inputs and control is None:
            raise DataError(f"'{model.name}' needs a current ({model.inputs['current']}): give one, or a control")


def left_training(model: SimulationModel, ride: Ride, damper: int) -> dict[str, float]:
    """Share of the samples of a ride at which each signal of a damper left the training range of its model."""
    known: TrainingRange | None = model.training_range
    series = {"displacement": ride.x, "velocity": ride.v, "acceleration": ride.a, "current": ride.current}
    shares = {}
    for signal, (low, high) in known.limits.items() if known else ():
        if signal in series:
            column = series[signal][:, damper]
            share = float(np.mean((column < low) | (column > high)))
            if share > 0.0:
                shares[signal] = share
    return shares


def _check_near(vehicle: Vehicle, state: Floats, time: float) -> None:
    worst = float(np.max(np.abs(state)))
    if not worst < _FARTHEST:
        raise SimulationError(f"{vehicle.name} runs away: a state is {worst:.3g} at {time:.4g} s; it is unstable")
