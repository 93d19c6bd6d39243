"""Simulate a model along a motion: mount and core in the compiled loops, control before them, sensor after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.models.motion import Motion, delayed, repeated
from identification.models.series import is_beyond
from identification.physical.beside import parts
from identification.physical.damper import Damper, Response, damper_of
from identification.physical.elements.equations.sensor import (
    ahead_of_current,
    delay_of,
    low_pass,
    low_pass_of,
    low_passed,
    sensor_force,
)
from identification.physical.elements.equations.series import add_columns
from identification.physical.elements.stability import may_grow, unbounded
from identification.physical.model import Element, Model

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

_FINITE = float(np.finfo(np.float64).max)
_SAME_TEMPERATURE_K = 0.05  # a body this steady is at one temperature: fade is some 0.5 % per kelvin
_SETTLED = 1e-4  # of the force: a period that ends as near to the one before has forgotten the start
_AHEAD = (0.25, 1.0, 2.0, 4.0)  # periods before one that repeats; what holds on longer is a matter of how it began


def simulate(model: Model, motion: Motion, *, gradient: bool | Mask = False, substeps: int = 1) -> Response:
    """Force of `model` along `motion`, (N,), N; with `gradient`, also ∂force/∂parameter, (N, P), or of those parameters
    alone that a mask (P,) holds true.

    `substeps` divides every sample of a mounted model, to see the solver's own error (see `accuracy.py`).

    Raises
    ------
    SimulationError
        when the force is not finite, with the first bad sample; when a hysteresis has no bound within the stroke.
    """
    return simulation_of(model, gradient=gradient).along(motion, substeps)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sensor:
    """An element of the sensor path with its values."""

    own: Element
    values: Sequence[float]
    wanted: Mask  # (K,) of its parameters, those by which partials are wanted
    later: float  # s, by which the elements after it make the force late

    @property
    def low_pass(self) -> tuple[float, float]:
        return low_pass_of(self.own.spec, self.values)

    @property
    def turns_current(self) -> bool:
        """Whether a partial by its delay is wanted while the current is not taken from ahead."""
        return bool(ahead_of_current(self.own.spec, self.values)) and bool(self.wanted[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulation:
    """A model with its values, ready for any motion: what needs no motion is done once; see `simulation_of`."""

    model: Model
    dampers: tuple[tuple[Damper, Integers], ...]  # what acts beside each other, and the columns of each
    rigidly: tuple[tuple[Damper, Integers], ...]  # the same bolted to the rig, where a memory is behind a mount
    sensor: tuple[_Sensor, ...]
    late: float  # s, by which the whole sensor path makes the force late
    ahead: float  # s, by which the current is not taken from ahead
    columns: int | None  # of the gradient; None where none is wanted
    remembers: bool  # the force depends on more than the present motion and current
    warms: bool
    growing: tuple[Element, ...]  # those that may grow without end

    def along(self, motion: Motion, substeps: int = 1) -> Response:
        """Response to a motion; see `simulate`."""
        self._check_bounded(motion)
        moved = {0.0: motion, self.late: motion.shifted(self.late)}
        past = moved[self.late]
        if self.ahead:
            past = _current_ahead(past, motion, self.late + self.ahead)
        response = self._steady_damper(past, substeps)
        force, grad = response.force, response.gradient
        place = (self.columns or 0) - sum(int(s.wanted.sum()) for s in self.sensor)
        for s in self.sensor:
            lag, turn = s.low_pass
            if lag > 0.0 or turn > 0.0:
                force = low_passed(force, lag, turn, motion)
                if grad is not None:
                    low_pass(grad, place, lag, turn, motion)
            if s.later not in moved:
                moved[s.later] = motion.shifted(s.later)
            value, columns = sensor_force(s.own.spec, s.values, moved[s.later], force, s.wanted)
            force = force + value
            if grad is not None:
                if s.turns_current:
                    columns[:, 0] += low_passed(_by_current(self.model, past, substeps), lag, turn, motion)
                for column in np.flatnonzero(s.wanted):
                    grad[:, place] = columns[:, column]
                    place += 1
        if is_beyond(force, _FINITE):
            bad = int(np.argmin(np.isfinite(force)))
            raise SimulationError(
                f"'{self.model.name}' gives {force[bad]} at sample {bad} (x = {motion.x[bad]:.4g} m, "
                f"v = {motion.v[bad]:.4g} m/s): check its parameters against the range of the run"
            )
        return Response(force, grad, response.failures)

    def _check_bounded(self, motion: Motion) -> None:
        """Raise SimulationError where a hysteresis grows without end within the stroke of the motion."""
        for e in self.growing:
            if reason := unbounded(e.name, e.values(), float(np.ptp(motion.x))):
                raise SimulationError(f"'{self.model.name}': {reason}")

    def _steady_damper(self, motion: Motion, substeps: int) -> Response:
        """Response of mount and core; a periodic motion is simulated until it repeats, then its last period does."""
        drifts = self.warms and np.ptp(motion.temperature) > _SAME_TEMPERATURE_K
        if motion.settle == 0 or drifts:
            return _together(self.dampers, motion, self.columns, substeps)
        if not self.remembers:
            return _tiled(_together(self.dampers, self._settled(motion, 0), self.columns, substeps), motion)
        longest = max(motion.ahead, _AHEAD[0])
        run_ins = [part for part in _AHEAD if part <= longest]
        for part in run_ins[self._forgotten(motion, run_ins) :]:
            warm = int(part * motion.period)
            response = _together(self.dampers, self._settled(motion, warm), self.columns, substeps)
            if part == run_ins[-1] or _repeats(response.force, warm, motion.period):
                break
        return _tiled(response, motion)

    def _settled(self, motion: Motion, warm: int) -> Motion:
        """One period of the motion after `warm` samples of those before it, at one temperature."""
        some = motion.one_period(warm)
        if self.warms:
            some = replace(some, temperature=np.full(some.x.size, float(np.mean(motion.temperature))))
        return some

    def _forgotten(self, motion: Motion, run_ins: Sequence[float]) -> int:
        """Index of the run-in that may do for a memory behind a mount: bolted to the rig it takes a tenth of the time,
        and forgets no later."""
        if not self.rigidly:
            return 0
        warm = [int(part * motion.period) for part in run_ins]
        first = self._settled(motion, warm[-2] if len(warm) > 1 else 0)
        force = _together(self.rigidly, first, None, 1).force
        met = [_repeats(force[: some + motion.period], some, motion.period) for some in warm[:-1]]
        return met.index(True) if any(met) else len(run_ins) - 1


def simulation_of(model: Model, *, gradient: bool | Mask = False) -> Simulation:
    """The simulation of a model along any motion; `gradient` as of `simulate`."""
    wanted = _wanted(model, gradient)
    mount, core, sensor = model.on("mount"), model.on("core"), model.on("sensor")
    behind = bool(mount) and any(e.remembers for e in core)
    bolted = replace(model, elements=(*model.on("control"), *core)) if behind else None
    values = [[p.value for p in e.parameters] for e in sensor]
    taus = [delay_of(e.spec, v) for e, v in zip(sensor, values, strict=True)]
    by_sensor = np.zeros(sum(map(len, values)), dtype=np.bool_) if wanted is None else wanted[-sum(map(len, values)) :]
    masks = np.split(by_sensor, np.cumsum([len(v) for v in values])[:-1]) if sensor else []
    return Simulation(
        model=model,
        dampers=_dampers(model, wanted),
        rigidly=() if bolted is None else _dampers(bolted, None),
        sensor=tuple(
            _Sensor(own=e, values=v, wanted=mask, later=sum(taus[k + 1 :]))
            for k, (e, v, mask) in enumerate(zip(sensor, values, masks, strict=True))
        ),
        late=sum(taus),
        ahead=sum(ahead_of_current(e.spec, v) for e, v in zip(sensor, values, strict=True)),
        columns=None if wanted is None else int(wanted.sum()),
        remembers=bool(mount) or any(e.remembers for e in (*model.on("control"), *core)),
        warms=any(e.warms for e in model.elements),
        growing=tuple(e for e in core if may_grow(e.name)),
    )


def _dampers(model: Model, wanted: Mask | None) -> tuple[tuple[Damper, Integers], ...]:
    """What acts beside each other in a model, each with the columns of the gradient that are its own."""
    found = []
    for part in parts(model):
        owned = np.array([e.id in part.ids for e, _ in model.slots()], dtype=np.bool_)
        own = damper_of(part, None if wanted is None else wanted[owned])
        columns = np.flatnonzero(owned[wanted]) if wanted is not None else np.zeros(0, dtype=np.int64)
        found.append((own, columns[: own.columns]))
    return tuple(found)


def _together(
    dampers: Sequence[tuple[Damper, Integers]], motion: Motion, columns: int | None, substeps: int
) -> Response:
    """Sum of the responses of what acts beside each other; a gradient has `columns`, those of the sensor are zero."""
    width = (columns or 0) if len(dampers) == 1 else 0  # the columns of the sensor path are the last
    every = [own.along(motion, substeps, width) for own, _ in dampers]
    first, *others = every
    force, failures = first.force, sum(r.failures for r in every)
    for other in others:
        force = force + other.force
    if columns is None:
        return Response(force, None, failures)
    if not others and first.gradient is not None and first.gradient.shape[1] == columns:
        return Response(force, first.gradient, failures)
    gradient = np.zeros((force.size, columns))
    for own, (_, at) in zip(every, dampers, strict=True):
        if own.gradient is not None:
            add_columns(gradient, at, own.gradient)
    return Response(force, gradient, failures)


def _current_ahead(past: Motion, motion: Motion, tau: float) -> Motion:
    """Inputs of the past, of which the current is that of `tau` seconds ago."""
    return replace(past, i=delayed(motion.i, tau, motion.dt, motion.period))


def _by_current(model: Model, past: Motion, substeps: int) -> Floats:
    """The part of dF/dt that comes with the current, (N,), N/s: its change with a current that is earlier."""
    if np.ptp(past.i) == 0.0:
        return np.zeros(past.i.size)
    forces = simulation_of(replace(model, elements=tuple(e for e in model.elements if e.spec.path != "sensor")))
    early, late = (
        forces.along(replace(past, i=delayed(past.i, tau, past.dt, past.period)), substeps).force
        for tau in (-past.dt, past.dt)
    )
    return np.asarray((early - late) / (2.0 * past.dt))


def _wanted(model: Model, gradient: bool | Mask) -> Mask | None:
    """The parameters by which a gradient is wanted, (P,); None where none is."""
    if isinstance(gradient, bool):
        return np.ones(model.free().size, dtype=np.bool_) if gradient else None
    return gradient


def _repeats(force: Floats, warm: int, period: int) -> bool:
    """Whether the period ends as what was ahead of it did: then the next is like it. What ran away stays away."""
    late = min(warm, period) // 2
    before, last = force[warm - late : warm], force[force.size - late :]
    change, size = np.max(np.abs(last - before), initial=0.0), np.max(np.abs(force[warm:]), initial=0.0)
    return not change > _SETTLED * size


def _tiled(response: Response, motion: Motion) -> Response:
    """The response along the whole motion, each period the last that was simulated."""
    size = motion.x.size
    full = None if response.gradient is None else repeated(response.gradient[-motion.period :], size)
    return Response(repeated(response.force[-motion.period :], size), full, response.failures)


def without_hum(model: Model) -> Model:
    """The model less what has a parameter of its own in every run, as the phase of a hum."""
    return replace(model, elements=tuple(e for e in model.elements if not e.spec.tone))
