"""Simulate a model along a motion: mount and core in the compiled loops, control before them, sensor after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.models.motion import Motion
from identification.physical.collocation import collocation_space
from identification.physical.control import effective_current
from identification.physical.elements import Code
from identification.physical.model import Element, Model
from identification.physical.mount import C2, C_CONTROL, GAP, K2, C, K
from identification.physical.mounted import mounted
from identification.physical.rigid import rigid, workspace

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

RIGID_STIFFNESS = 3.0e7  # N/m: a worn joint without a bush meets steel
RIGID_DAMPING = 3.0e3  # N·s/m
_SAME_TEMPERATURE_K = 0.05  # a body this steady is at one temperature: fade is some 0.5 % per kelvin
_SETTLED = 1e-4  # of the force: a period that ends as near to the one before has forgotten the start
_AHEAD = (0.25, 1.0, 2.0, 4.0)  # periods before one that repeats; what holds on longer is a matter of how it began
_EXPONENTIAL = 1.2  # a Bouc–Wen exponent below it grows e⁵-fold at most where this one would be infinite
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


def simulate(model: Model, motion: Motion, *, gradient: bool | Mask = False, substeps: int = 1) -> Response:
    """Force of `model` along `motion`, (N,), N; with `gradient`, also ∂force/∂parameter, (N, P), or of those parameters
    alone that a mask (P,) holds true.

    `substeps` divides every sample of a mounted model, to see the solver's own error (see `accuracy.py`).

    Raises
    ------
    SimulationError
        when the force is not finite, with the first bad sample; when a hysteresis has no bound within the stroke.
    """
    _check_bounded(model, motion)
    wanted = _wanted(model, gradient)
    sensor = model.on("sensor")
    taus = [e.value("tau") if e.spec.code == Code.FORCE_DELAY else 0.0 for e in sensor]
    past = motion.shifted(sum(taus))
    response = _steady_damper(model, past, wanted, substeps)
    force, grad = response.force, response.gradient
    offset = sum(len(e.parameters) for e in model.elements if e.spec.path != "sensor")
    place = 0 if wanted is None else int(wanted[:offset].sum())
    for index, e in enumerate(sensor):
        later = sum(taus[index + 1 :])
        value, columns = _sensor_term(e, motion.shifted(later), force)
        force = force + value
        if grad is not None and wanted is not None:
            columns = columns[:, wanted[offset : offset + columns.shape[1]]]
            grad[:, place : place + columns.shape[1]] = columns
            place += columns.shape[1]
        offset += len(e.parameters)
    if not np.all(np.isfinite(force)):
        bad = int(np.argmin(np.isfinite(force)))
        raise SimulationError(
            f"'{model.name}' gives {force[bad]} at sample {bad} (x = {motion.x[bad]:.4g} m, "
            f"v = {motion.v[bad]:.4g} m/s): check its parameters against the range of the run"
        )
    return Response(force, grad, response.failures)


def _wanted(model: Model, gradient: bool | Mask) -> Mask | None:
    """The parameters by which a gradient is wanted, (P,); None where none is."""
    if isinstance(gradient, bool):
        return np.ones(model.free().size, dtype=np.bool_) if gradient else None
    return gradient


def _check_bounded(model: Model, motion: Motion) -> None:
    """Raise SimulationError where a Bouc–Wen hysteresis grows without end within the stroke of the motion.

    With c = −(beta + gamma) > 0 it grows as it is loaded, dh/dx = A + c·hⁿ, and is infinite after a travel of
    (π/n)/sin(π/n)·A^(1/n − 1)·c^(−1/n); what a reversal unloads is no less, so no travel is longer than the stroke.
    """
    for e in model.on("core"):
        if e.spec.code == Code.BOUC_WEN and (growth := -e.value("beta") - e.value("gamma")) > 0.0:
            n, a, stroke = e.value("n"), e.value("A"), float(np.ptp(motion.x))
            least = max(n, _EXPONENTIAL)
            if not growth * float(a * stroke / (np.pi / least / np.sin(np.pi / least))) ** n < a:
                raise SimulationError(
                    f"'{model.name}': bouc_wen.beta + bouc_wen.gamma is {-growth:.4g}: below zero the hysteresis "
                    f"grows, here without end within the stroke of {stroke:.3g} m"
                )


def _steady_damper(model: Model, motion: Motion, wanted: Mask | None, substeps: int) -> Response:
    """Response of mount and core; a periodic motion is simulated until it repeats, then its last period does."""
    drifts = model.has("temperature_fade") and np.ptp(motion.temperature) > _SAME_TEMPERATURE_K
    if motion.settle == 0 or drifts:
        return _damper(model, motion, wanted, substeps)
    if not _remembers(model):
        return _tiled(_damper(model, _settled(model, motion, 0), wanted, substeps), motion)
    longest = max(motion.ahead, _AHEAD[0])
    parts = [part for part in _AHEAD if part <= longest]
    for part in parts[_forgotten(model, motion, parts) :]:
        warm = int(part * motion.period)
        response = _damper(model, _settled(model, motion, warm), wanted, substeps)
        if part == parts[-1] or _repeats(response.force, warm, motion.period):
            break
    return _tiled(response, motion)


def _remembers(model: Model) -> bool:
    """Whether the force depends on more than the present motion and current."""
    lags = any(e.spec.code in (Code.LAG, Code.HYSTERESIS) for e in model.on("control"))
    return lags or bool(model.on("mount")) or any(e.spec.memory for e in model.on("core"))


def _settled(model: Model, motion: Motion, warm: int) -> Motion:
    """One period of the motion after `warm` samples of those before it, at one temperature."""
    some = motion.one_period(warm)
    if model.has("temperature_fade"):
        some = replace(some, temperature=np.full(some.x.size, float(np.mean(motion.temperature))))
    return some


def _forgotten(model: Model, motion: Motion, parts: Sequence[float]) -> int:
    """Index of the run-in that may do for a memory behind a mount: bolted to the rig it takes a tenth of the time, and
    forgets no later."""
    if not (model.on("mount") and any(e.spec.memory for e in model.on("core"))):
        return 0
    core = replace(model, elements=(*model.on("control"), *model.on("core")))
    warm = [int(part * motion.period) for part in parts]
    force = _damper(core, _settled(model, motion, warm[-2] if len(warm) > 1 else 0), None, 1).force
    met = [_repeats(force[: some + motion.period], some, motion.period) for some in warm[:-1]]
    return met.index(True) if any(met) else len(parts) - 1


def _repeats(force: Floats, warm: int, period: int) -> bool:
    """Whether the period ends as what was ahead of it did: then the next is like it. What ran away stays away."""
    late = min(warm, period) // 2
    before, last = force[warm - late : warm], force[force.size - late :]
    change, size = np.max(np.abs(last - before), initial=0.0), np.max(np.abs(force[warm:]), initial=0.0)
    return not change > _SETTLED * size


def _tiled(response: Response, motion: Motion) -> Response:
    """The response along the whole motion, each period the last that was simulated."""
    index = response.force.size - motion.period + np.arange(motion.x.size) % motion.period
    full = None if response.gradient is None else response.gradient[index]
    return Response(response.force[index], full, response.failures)


def _damper(model: Model, motion: Motion, wanted: Mask | None, substeps: int) -> Response:
    mount, control, core = model.on("mount"), model.on("control"), model.on("core")
    u, du = effective_current(control, motion.i, motion.dt, motion.period, motion.remanence)
    gradient, mask = wanted is not None, np.zeros(model.free().size, dtype=np.bool_) if wanted is None else wanted
    edges = np.cumsum([sum(len(e.parameters) for e in path) for path in (mount, control, core)])
    of_mount, of_control, of_core = np.split(mask[: edges[-1]], edges[:-1])
    n_mount, n_control, n_core = (int(m.sum()) for m in (of_mount, of_control, of_core))
    used = n_mount + n_control + n_core
    codes = np.array([int(e.spec.code) for e in core], dtype=np.int64)
    offsets = np.concatenate([[0], np.cumsum([len(e.parameters) for e in core])]).astype(np.int64)
    p = np.array([q.value for e in core for q in e.parameters], dtype=np.float64)
    # The kernels count control columns first, so that du lies in the first rows.
    column = _numbered(of_core, n_control)
    jac = np.zeros((motion.x.size, used)) if gradient else np.zeros((0, used))
    force = np.zeros(motion.x.size)
    v_m = _amplitude_velocity(motion) if any(e.spec.code in _NEED_AMPLITUDE for e in core) else motion.a
    inputs = (motion.x, motion.v, u, motion.temperature, motion.a, v_m)
    common = (codes, offsets, p, column, motion.dt, inputs, du[of_control])
    space = workspace(codes.size, p.size, used)
    failures = 0
    if mount:
        stiffness, columns, fine = _mount(mount, core, _numbered(of_mount, n_control + n_core))
        space = (*space, collocation_space(used, substeps))
        failures = mounted(*common, stiffness, columns, substeps, fine * substeps, force, jac, space)
    else:
        eps = 1e-9 * float(np.max(np.abs(motion.v), initial=0.0))
        rigid(*common, eps, force, jac, space)
    if not gradient:
        return Response(force, None, failures)
    of_all = int(mask.sum())
    if n_mount == 0 and used == of_all:
        return Response(force, jac, failures)
    out = np.zeros((motion.x.size, of_all))
    out[:, :n_mount] = jac[:, n_control + n_core :]
    out[:, n_mount:used] = jac[:, : n_control + n_core]
    return Response(force, out, failures)


def _numbered(wanted: Mask, first: int) -> NDArray[np.int64]:
    """Columns of what is wanted, from `first` on, −1 for the rest; (P,)."""
    return np.where(wanted, first - 1 + np.cumsum(wanted), -1).astype(np.int64)


def _amplitude_velocity(motion: Motion) -> Floats:
    """v_m = sqrt(v² − a·x), (N,), m/s, x about mid-stroke: the peak velocity of a sine at any moment of it.

    Where another motion gives no real value, and within 0.1 % of the highest, it is held above zero.
    """
    middle = 0.5 * (motion.x.max() + motion.x.min())
    v_m = np.sqrt(np.maximum(motion.v**2 - motion.a * (motion.x - middle), 0.0))
    return np.asarray(np.maximum(v_m, 1e-3 * max(float(v_m.max(initial=0.0)), 1e-9)))


def _mount(
    mount: Sequence[Element], core: Sequence[Element], numbers: NDArray[np.int64]
) -> tuple[Floats, NDArray[np.int64], int]:
    """The mount's array (see `mount.py`), the gradient column of each entry, and the substeps at an event."""
    values = np.array([RIGID_STIFFNESS, RIGID_DAMPING, 0.0, 0.0, 0.0, 0.0])
    columns, number = np.full(6, -1, dtype=np.int64), iter(numbers)
    substeps = _REVERSAL_SUBSTEPS if any(e.spec.memory for e in core) else 1
    for e in mount:
        places = _PLACES[e.spec.code]
        if e.spec.code != Code.FREE_PLAY:
            values[[K, C]] = 0.0
        for place, p in zip(places, e.parameters, strict=True):
            values[place] = p.value
            columns[place] = next(number)
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
