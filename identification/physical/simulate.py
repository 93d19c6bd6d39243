"""Simulate a model along a motion: mount and core in the compiled loops, control before them, sensor after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.physical.collocation import collocation_space
from identification.physical.control import effective_current
from identification.physical.elements import Code
from identification.physical.model import Element, Model
from identification.physical.motion import Motion
from identification.physical.mount import C2, C_CONTROL, GAP, K2, C, K
from identification.physical.mounted import mounted
from identification.physical.rigid import rigid, workspace

Floats = NDArray[np.float64]

RIGID_STIFFNESS = 3.0e7  # N/m: a worn joint without a bush meets steel
RIGID_DAMPING = 3.0e3  # N·s/m
_SAME_TEMPERATURE_K = 0.05  # a body this steady is at one temperature: fade is some 0.5 % per kelvin
_SETTLED = 1e-4  # of the force: a period that ends as near to the one before has forgotten the start
_MOST_PERIODS = 5  # until a motion repeats; a memory that holds on for longer is a matter of how the run began
_REVERSAL_SUBSTEPS = 4
_PLAY_SUBSTEPS = 16  # a rigid contact rings at some kHz; all of its error sits in the samples of an impact
_NEED_AMPLITUDE = (Code.MODULATED_TANH, Code.SIGMOID)
_PLACES = {  # of the parameters of each mount element in the mount's array
    Code.COMPLIANCE: (K, C),
    Code.FREE_PLAY: (GAP,),
    Code.RELAXING: (K, K2, C2),
    Code.DASHPOT: (C, C_CONTROL),
}


@dataclass(frozen=True, slots=True)
class Response:
    """What a model answers: force (N,), N, and, where asked, its gradient (N, P) by every parameter."""

    force: Floats
    gradient: Floats | None
    failures: int = 0  # steps whose equation did not converge


def simulate(model: Model, motion: Motion, *, gradient: bool = False, substeps: int = 1) -> Response:
    """Force of `model` along `motion`, (N,), N; with `gradient`, also ∂force/∂parameter, (N, P).

    `substeps` divides every sample of a mounted model, to see the solver's own error (see `accuracy.py`).

    Raises
    ------
    SimulationError
        when the force is not finite, with the first bad sample; when a hysteresis has no bound.
    """
    _check_bounded(model)
    sensor = model.on("sensor")
    taus = [e.value("tau") if e.spec.code == Code.FORCE_DELAY else 0.0 for e in sensor]
    past = motion.shifted(sum(taus))
    response = _steady_damper(model, past, gradient, substeps)
    force, grad = response.force, response.gradient
    offset = sum(len(e.parameters) for e in model.elements if e.spec.path != "sensor")
    for index, e in enumerate(sensor):
        later = sum(taus[index + 1 :])
        value, columns = _sensor_term(e, motion.shifted(later), force)
        force = force + value
        if grad is not None:
            grad[:, offset : offset + columns.shape[1]] = columns
        offset += columns.shape[1]
    if not np.all(np.isfinite(force)):
        bad = int(np.argmin(np.isfinite(force)))
        raise SimulationError(
            f"'{model.name}' gives {force[bad]} at sample {bad} (x = {motion.x[bad]:.4g} m, "
            f"v = {motion.v[bad]:.4g} m/s): check its parameters against the range of the run"
        )
    return Response(force, grad, response.failures)


def _check_bounded(model: Model) -> None:
    """Raise SimulationError where a Bouc–Wen hysteresis grows without end (Ikhouane & Rodellar 2007)."""
    for e in model.on("core"):
        if e.spec.code == Code.BOUC_WEN and not e.value("beta") + e.value("gamma") > 0.0:
            raise SimulationError(
                f"'{model.name}': bouc_wen.beta + bouc_wen.gamma is {e.value('beta') + e.value('gamma'):.4g}: "
                "it must be above zero, or the hysteresis grows without end"
            )


def _steady_damper(model: Model, motion: Motion, gradient: bool, substeps: int) -> Response:
    """Response of mount and core; a periodic motion is simulated until it repeats, then its last period does."""
    drifts = model.has("temperature_fade") and np.ptp(motion.temperature) > _SAME_TEMPERATURE_K
    if motion.settle == 0 or drifts:
        return _damper(model, motion, gradient, substeps)
    if not _remembers(model):
        return _tiled(_damper(model, _periods(model, motion, 1), gradient, substeps), motion)
    response = _damper(model, _periods(model, motion, 2), gradient, substeps)
    if not _repeats(response.force, motion.period):
        response = _damper(model, _periods(model, motion, _MOST_PERIODS), gradient, substeps)
    return _tiled(response, motion)


def _remembers(model: Model) -> bool:
    """Whether the force depends on more than the present motion and current."""
    lags = any(e.spec.code in (Code.LAG, Code.HYSTERESIS) for e in model.on("control"))
    return lags or bool(model.on("mount")) or any(e.spec.memory for e in model.on("core"))


def _periods(model: Model, motion: Motion, count: int) -> Motion:
    """So many periods of the motion, at one temperature."""
    some = motion.periods(count)
    if model.has("temperature_fade"):
        some = replace(some, temperature=np.full(some.x.size, float(np.mean(motion.temperature))))
    return some


def _repeats(force: Floats, period: int) -> bool:
    """Whether the last period ends as the one before it did: then the next is like it."""
    before, last = force[-2 * period : -period], force[-period:]
    late = slice(period // 2, None)
    return bool(np.max(np.abs(last[late] - before[late])) <= _SETTLED * np.max(np.abs(last), initial=0.0))


def _tiled(response: Response, motion: Motion) -> Response:
    """The response along the whole motion: the transient as far as it was simulated, then its last period."""
    period, samples = motion.period, response.force.size
    index = np.arange(motion.x.size)
    early = min(motion.settle * period, samples - period)
    index = np.where(index < early, index, samples - period + index % period)
    full = None if response.gradient is None else response.gradient[index]
    return Response(response.force[index], full, response.failures)


def _damper(model: Model, motion: Motion, gradient: bool, substeps: int) -> Response:
    mount, control, core = model.on("mount"), model.on("control"), model.on("core")
    u, du = effective_current(control, motion.i, motion.dt, motion.period, motion.remanence)
    n_mount = sum(len(e.parameters) for e in mount)
    n_control = du.shape[0]
    codes = np.array([int(e.spec.code) for e in core], dtype=np.int64)
    sizes = [len(e.parameters) for e in core]
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    p = np.array([q.value for e in core for q in e.parameters], dtype=np.float64)
    total = sum(len(e.parameters) for e in model.elements)
    used = n_mount + n_control + p.size
    # The kernels count control columns first, so that du lies in the first rows.
    column = n_control + np.arange(p.size, dtype=np.int64)
    jac = np.zeros((motion.x.size, used)) if gradient else np.zeros((0, used))
    force = np.zeros(motion.x.size)
    v_m = _amplitude_velocity(motion) if any(e.spec.code in _NEED_AMPLITUDE for e in core) else motion.a
    inputs = (motion.x, motion.v, u, motion.temperature, motion.a, v_m)
    common = (codes, offsets, p, column, motion.dt, inputs, du)
    space = workspace(codes.size, p.size, used)
    failures = 0
    if mount:
        stiffness, columns, fine = _mount(mount, core, n_control + p.size)
        space = (*space, collocation_space(used, substeps))
        failures = mounted(*common, stiffness, columns, substeps, fine * substeps, force, jac, space)
    else:
        eps = 1e-9 * float(np.max(np.abs(motion.v), initial=0.0))
        rigid(*common, eps, force, jac, space)
    if not gradient:
        return Response(force, None, failures)
    if not mount and used == total:
        return Response(force, jac, failures)
    out = np.zeros((motion.x.size, total))
    out[:, :n_mount] = jac[:, n_control + p.size :]
    out[:, n_mount : n_mount + n_control] = jac[:, :n_control]
    out[:, n_mount + n_control : used] = jac[:, n_control : n_control + p.size]
    return Response(force, out, failures)


def _amplitude_velocity(motion: Motion) -> Floats:
    """v_m = sqrt(v² − a·x), (N,), m/s, x about mid-stroke: the peak velocity of a sine at any moment of it.

    Where another motion gives no real value, and within 0.1 % of the highest, it is held above zero.
    """
    middle = 0.5 * (motion.x.max() + motion.x.min())
    v_m = np.sqrt(np.maximum(motion.v**2 - motion.a * (motion.x - middle), 0.0))
    return np.asarray(np.maximum(v_m, 1e-3 * max(float(v_m.max(initial=0.0)), 1e-9)))


def _mount(mount: Sequence[Element], core: Sequence[Element], first: int) -> tuple[Floats, NDArray[np.int64], int]:
    """The mount's array (see `mount.py`), the gradient column of each entry, and the substeps at an event."""
    values = np.array([RIGID_STIFFNESS, RIGID_DAMPING, 0.0, 0.0, 0.0, 0.0])
    columns = np.full(6, -1, dtype=np.int64)
    substeps = _REVERSAL_SUBSTEPS if any(e.spec.memory for e in core) else 1
    for e in mount:
        places = _PLACES[e.spec.code]
        if e.spec.code != Code.FREE_PLAY:
            values[[K, C]] = 0.0
        for place, p in zip(places, e.parameters, strict=True):
            values[place] = p.value
            columns[place] = first
            first += 1
        if e.spec.code == Code.FREE_PLAY and values[GAP] > 0:
            substeps = _PLAY_SUBSTEPS
    return values, columns, substeps


def _sensor_term(e: Element, motion: Motion, force: Floats) -> tuple[Floats, Floats]:
    """What a sensor element adds to the force, (N,), and the gradient by its parameters, (N, K)."""
    values = [p.value for p in e.parameters]
    code = e.spec.code
    if code == Code.OFFSET:
        return np.full(force.size, values[0]), np.ones((force.size, 1))
    if code == Code.PARALLEL:
        return values[0] * motion.x, motion.x[:, None]
    if code == Code.MASS:
        return values[0] * motion.a, motion.a[:, None]
    if code == Code.DRIFT:
        return values[0] * motion.t, motion.t[:, None]
    if code == Code.HUM:
        turn = 2.0 * np.pi * values[1] * motion.t + values[2]
        columns = np.stack(
            [
                np.sin(turn),
                values[0] * 2.0 * np.pi * motion.t * np.cos(turn),
                values[0] * np.cos(turn),
            ],
            axis=1,
        )
        return values[0] * np.sin(turn), columns
    # A delay is already in the inputs; a later force is the slope of the force taken backwards.
    return np.zeros(force.size), -np.gradient(force, motion.dt)[:, None]


def without_hum(model: Model) -> Model:
    """The model less its mains hum: that has a phase of its own in every run."""
    return replace(model, elements=tuple(e for e in model.elements if e.name != "mains_hum"))
