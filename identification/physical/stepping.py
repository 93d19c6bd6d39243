"""A physical model from sample to sample, by the same compiled loops that simulate it along a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.errors import SimulationError
from identification.models.stepping import Moment
from identification.physical.beside import parts
from identification.physical.collocation import nodes_of
from identification.physical.damper import mount_of
from identification.physical.elements.equations.current_steps import CurrentPath
from identification.physical.elements.equations.sensor import ACTS, acting
from identification.physical.mounted import mounted
from identification.physical.program import POSITION_AND_CURRENT, TOLERANCE, Drive, Mount, core_of, space_of
from identification.physical.rigid import rigid

if TYPE_CHECKING:
    from identification.physical.model import Model

_REST = 1e-9  # m/s: slower than this a damper is at rest, as dry friction sees it
_VELOCITY_TOLERANCE = 1e-13  # m/s, of a solved velocity
_LOWEST_AMPLITUDE = 1e-3  # of the highest v_m so far, as `simulate` holds it above zero


class PhysicalStepper:
    """A physical model as a damper in a vehicle: mount, core, and what of the sensor path acts on the vehicle.

    v_m = sqrt(v² − a·x) of the models that use it takes x as it is given, about the position in which it was built in.
    """

    def __init__(self, model: Model, dt: float) -> None:
        """The damper at the step `dt`, s, before its start; raises SimulationError where `dt` is none."""
        if not (np.isfinite(dt) and dt > 0.0):
            raise SimulationError(f"'{model.name}': the step is {dt:g} s: it must be above 0")
        through, *beside = parts(model)
        self._beside = [PhysicalStepper(one, dt) for one in beside]
        core, mount = through.on("core"), through.on("mount")
        values = np.array([p.value for e in core for p in e.parameters])
        none = np.full(values.size, -1, dtype=np.int64)
        self._name, self._dt = model.name, dt
        self._program = core_of(tuple(e.name for e in core), values, none)
        self._current = CurrentPath(model.on("control"), dt)
        self._offset, self._stiffness = acting(model.on("sensor"))
        self._mounting, self._substeps = None, (1, 1)
        if mount:
            stiffness, fine = mount_of(mount, any(e.remembers for e in core))
            self._mounting, self._substeps = (stiffness, Mount(*([-1] * len(Mount._fields)))), (1, fine)
            if stiffness.c_control != 0.0:
                driven = max(self._program.driven, POSITION_AND_CURRENT)
                self._program = self._program._replace(driven=driven)
        self._rows = np.zeros((6, 2))  # x, v, u, temperature, a and v_m at the last sample and at the next
        x, v, u, temperature, a, v_m = self._rows
        self._drive = Drive(x, v, u, temperature, a, v_m, dt, np.zeros((0, 2)))
        self._out, self._jac = np.zeros(2), np.zeros((0, 0))
        self._clear()

    def _clear(self) -> None:
        self._space = space_of(self._program.codes.size, self._program.p.size, 0)
        self._nodes = nodes_of(0, 1)
        carried = self._space.carried
        self._kept = [(part, part.copy()) for part in (carried.memory, carried.state, self._nodes.rate)]
        self._highest = 1e-6  # m/s; of v_m

    @property
    def dt(self) -> float:
        """The step, s."""
        return self._dt

    def start(self, at: Moment) -> float:
        """Begin at a moment that has lasted: internal forces are steady for its velocity; the force there, N."""
        self._clear()
        self._rows[:, 0] = self._column(at, self._current.start(at.i))
        x, v, u, temperature, a, v_m = self._rows[:, :1]
        self._run(Drive(x, v, u, temperature, a, v_m, self._dt, np.zeros((0, 1))), fresh=True)
        self._space.carried.state[TOLERANCE] = _VELOCITY_TOLERANCE
        for one in self._beside:
            one.start(at)
        return self.force(at)

    def force(self, at: Moment) -> float:
        """The force if `at` were the next sample, N: nothing is kept."""
        self._rows[:, 1] = self._column(at, self._current.next(at.i))
        for part, kept in self._kept:
            kept[:] = part
        force = self._run(self._drive, fresh=False)
        for part, kept in self._kept:
            part[:] = kept
        return self._whole(force + sum(one.force(at) for one in self._beside), at)

    def advance(self, at: Moment) -> float:
        """Go on to the next sample; the force there, N; raises SimulationError where it is not finite."""
        self._rows[:, 1] = self._column(at, self._current.advance(at.i))
        beside = sum(one.advance(at) for one in self._beside)
        force = self._whole(self._run(self._drive, fresh=False) + beside, at)
        self._highest = max(self._highest, self._rows[5, 1])
        self._rows[:, 0] = self._rows[:, 1]
        if not abs(force) < np.inf:
            raise SimulationError(f"'{self._name}' gives {force} at x = {at.x:.4g} m, v = {at.v:.4g} m/s")
        return force

    def _column(self, at: Moment, u: float) -> tuple[float, ...]:
        square = at.v * at.v - at.a * at.x
        v_m = max(square**0.5 if square > 0.0 else 0.0, _LOWEST_AMPLITUDE * self._highest)
        return at.x, at.v, u, at.temperature, at.a, v_m

    def _run(self, drive: Drive, fresh: bool) -> float:
        if self._mounting is None:
            rigid(self._program, drive, _REST, self._out, self._jac, self._space, fresh)
        else:
            given = (self._program, drive, self._mounting, (*self._substeps, fresh), self._out, self._jac)
            mounted(*given, self._space, self._nodes)
        return float(self._out[1])

    def _whole(self, force: float, at: Moment) -> float:
        return force + self._offset + self._stiffness * at.x


def left_out(model: Model) -> list[str]:
    """Ids of the elements that belong to the rig and its load cell: no part of a damper in a vehicle."""
    return [e.id for e in model.on("sensor") if e.name not in ACTS]
