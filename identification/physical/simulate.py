"""Simulate a model along a motion: mount and core in the compiled loops, control before them, sensor after them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.models.motion import Motion, delayed
from identification.physical.beside import parts
from identification.physical.collocation import nodes_of
from identification.physical.elements.equations.control import effective_current
from identification.physical.elements.equations.sensor import (
    ahead_of_current,
    delay_of,
    low_pass_of,
    low_passed,
    sensor_force,
)
from identification.physical.elements.equations.series import add_columns
from identification.physical.elements.mount import RIGID_DAMPING, RIGID_STIFFNESS
from identification.physical.elements.stability import may_grow, unbounded
from identification.physical.model import Element, Model
from identification.physical.mounted import mounted
from identification.physical.program import POSITION_AND_CURRENT, Drive, Mount, core_of, space_of
from identification.physical.rigid import rigid

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Number = TypeVar("Number", float, int)

_SAME_TEMPERATURE_K = 0.05  # a body this steady is at one temperature: fade is some 0.5 % per kelvin
_SETTLED = 1e-4  # of the force: a period that ends as near to the one before has forgotten the start
_AHEAD = (0.25, 1.0, 2.0, 4.0)  # periods before one that repeats; what holds on longer is a matter of how it began
_REVERSAL_SUBSTEPS = 4
_SOFT = {"soft": "air", "f_soft": "f_half"}  # how the halves of a joint meet, and as what that acts in a mount
_PLAY_SUBSTEPS = 16  # a rigid contact rings at some kHz; all of its error sits in the samples of an impact


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
    taus = [delay_of(e.spec, _values(e)) for e in sensor]
    ahead = sum(ahead_of_current(e.spec, _values(e)) for e in sensor)
    moved = {0.0: motion, sum(taus): motion.shifted(sum(taus))}
    past = _current_ahead(moved[sum(taus)], motion, sum(taus) + ahead) if ahead else moved[sum(taus)]
    response = _steady_damper(model, past, wanted, substeps)
    force, grad = response.force, response.gradient
    offset = sum(len(e.parameters) for e in model.elements if e.spec.path != "sensor")
    place = 0 if wanted is None else int(wanted[:offset].sum())
    for index, e in enumerate(sensor):
        later = sum(taus[index + 1 :])
        lag, turn = low_pass_of(e.spec, _values(e))
        own = _of_none(e) if wanted is None else wanted[offset : offset + len(e.parameters)]
        force = low_passed(force, lag, turn, motion)
        if grad is not None and (lag > 0.0 or turn > 0.0):
            grad[:, :place] = low_passed(grad[:, :place], lag, turn, motion)
        if later not in moved:
            moved[later] = motion.shifted(later)
        value, columns = sensor_force(e.spec, _values(e), moved[later], force, own)
        force = force + value
        if grad is not None:
            if ahead_of_current(e.spec, _values(e)) and own[0]:
                columns[:, 0] += low_passed(_by_current(model, past, substeps), lag, turn, motion)
            count = int(own.sum())
            grad[:, place : place + count] = columns[:, own]
            place += count
        offset += len(e.parameters)
    if not np.all(np.isfinite(force)):
        bad = int(np.argmin(np.isfinite(force)))
        raise SimulationError(
            f"'{model.name}' gives {force[bad]} at sample {bad} (x = {motion.x[bad]:.4g} m, "
            f"v = {motion.v[bad]:.4g} m/s): check its parameters against the range of the run"
        )
    return Response(force, grad, response.failures)


def _current_ahead(past: Motion, motion: Motion, tau: float) -> Motion:
    """Inputs of the past, of which the current is that of `tau` seconds ago."""
    return replace(past, i=delayed(motion.i, tau, motion.dt, motion.period))


def _by_current(model: Model, past: Motion, substeps: int) -> Floats:
    """The part of dF/dt that comes with the current, (N,), N/s: its change with a current that is earlier."""
    if np.ptp(past.i) == 0.0:
        return np.zeros(past.i.size)
    early, late = (
        _steady_damper(model, replace(past, i=delayed(past.i, tau, past.dt, past.period)), None, substeps).force
        for tau in (-past.dt, past.dt)
    )
    return (early - late) / (2.0 * past.dt)


def _wanted(model: Model, gradient: bool | Mask) -> Mask | None:
    """The parameters by which a gradient is wanted, (P,); None where none is."""
    if isinstance(gradient, bool):
        return np.ones(model.free().size, dtype=np.bool_) if gradient else None
    return gradient


def _of_none(e: Element) -> Mask:
    return np.zeros(len(e.parameters), dtype=np.bool_)


def _values(e: Element) -> list[float]:
    return [p.value for p in e.parameters]


def _check_bounded(model: Model, motion: Motion) -> None:
    """Raise SimulationError where a hysteresis grows without end within the stroke of the motion."""
    for e in (e for e in model.on("core") if may_grow(e.name)):
        named = {spec.name: p.value for spec, p in zip(e.spec.parameters, e.parameters, strict=True)}
        if reason := unbounded(e.name, named, float(np.ptp(motion.x))):
            raise SimulationError(f"'{model.name}': {reason}")


def _steady_damper(model: Model, motion: Motion, wanted: Mask | None, substeps: int) -> Response:
    """Response of mount and core; a periodic motion is simulated until it repeats, then its last period does."""
    drifts = _warms(model) and np.ptp(motion.temperature) > _SAME_TEMPERATURE_K
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
    return bool(model.on("mount")) or any(e.remembers for e in (*model.on("control"), *model.on("core")))


def _warms(model: Model) -> bool:
    return any(e.spec.needs_temperature for e in model.elements)


def _settled(model: Model, motion: Motion, warm: int) -> Motion:
    """One period of the motion after `warm` samples of those before it, at one temperature."""
    some = motion.one_period(warm)
    if _warms(model):
        some = replace(some, temperature=np.full(some.x.size, float(np.mean(motion.temperature))))
    return some


def _forgotten(model: Model, motion: Motion, parts: Sequence[float]) -> int:
    """Index of the run-in that may do for a memory behind a mount: bolted to the rig it takes a tenth of the time, and
    forgets no later."""
    if not (model.on("mount") and any(e.remembers for e in model.on("core"))):
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
    """Response of mount and core, and of what acts beside them; a gradient has the columns of the sensor too, zero."""
    own_parts = parts(model)
    if own_parts == (model,):
        return _one_part(model, motion, wanted, substeps)
    force, failures = np.zeros(motion.x.size), 0
    gradient = None if wanted is None else np.zeros((motion.x.size, int(wanted.sum())))
    for part in own_parts:
        owned = np.array([e.id in part.ids for e, _ in model.slots()], dtype=np.bool_)
        own = _one_part(part, motion, None if wanted is None else wanted[owned], substeps)
        force, failures = force + own.force, failures + own.failures
        if gradient is not None and wanted is not None and own.gradient is not None:
            add_columns(gradient, np.flatnonzero(owned[wanted]), own.gradient)
    return Response(force, gradient, failures)


def _one_part(model: Model, motion: Motion, wanted: Mask | None, substeps: int) -> Response:
    mount, control, core = model.on("mount"), model.on("control"), model.on("core")
    u, du = effective_current(control, motion.i, motion.dt, motion.period, motion.remanence)
    gradient, mask = wanted is not None, np.zeros(model.free().size, dtype=np.bool_) if wanted is None else wanted
    edges = np.cumsum([sum(len(e.parameters) for e in path) for path in (mount, control, core)])
    of_mount, of_control, of_core = np.split(mask[: edges[-1]], edges[:-1])
    n_mount, n_control, n_core = (int(m.sum()) for m in (of_mount, of_control, of_core))
    used = n_mount + n_control + n_core
    specs, names = [e.spec for e in core], tuple(e.name for e in core)
    # The kernels count control columns first, so that du lies in the first rows.
    program = core_of(names, np.array([v for e in core for v in _values(e)]), _numbered(of_core, n_control))
    jac = np.zeros((motion.x.size, used)) if gradient else np.zeros((0, used))
    force = np.zeros(motion.x.size)
    v_m = _amplitude_velocity(motion) if any(s.needs_amplitude for s in specs) else motion.a
    drive = Drive(motion.x, motion.v, u, motion.temperature, motion.a, v_m, motion.dt, du[of_control])
    space = space_of(program.codes.size, program.p.size, used)
    failures = 0
    if mount:
        stiffness, fine = mount_of(mount, any(e.remembers for e in core))
        mounting = (stiffness, _mount_columns(mount, _numbered(of_mount, n_control + n_core)))
        nodes = nodes_of(used, substeps)
        if gradient or stiffness.c_control != 0.0:
            program = program._replace(driven=max(program.driven, POSITION_AND_CURRENT))
        failures = mounted(program, drive, mounting, (substeps, fine * substeps, True), force, jac, space, nodes)
    else:
        eps = 1e-9 * float(np.max(np.abs(motion.v), initial=0.0))
        rigid(program, drive, eps, force, jac, space, True)
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


def mount_of(mount: Sequence[Element], remembers: bool) -> tuple[Mount, int]:
    """The mount as the loops see it, and the substeps at an event."""
    pairs = [(s, p) for e in mount for s, p in zip(e.spec.parameters, e.parameters, strict=True)]
    placed = {str(s.place): p.value for s, p in pairs if s.place}
    worn = not set(placed) - {"gap", "air", "f_half", "side", *_SOFT}  # a joint without a bush
    k, c = (RIGID_STIFFNESS, RIGID_DAMPING) if worn else (0.0, 0.0)
    placed = _met_softly(placed)
    values = {"k": k, "c": c, "gap": 0.0, "k2": 0.0, "c2": 0.0, "c_control": 0.0, "air": 0.0, "f_half": 1.0,
              "side": 0.0, "k_slip": 1.0, "f_slip": 0.0, **placed}  # fmt: skip
    substeps = _REVERSAL_SUBSTEPS if remembers or values["f_slip"] > 0.0 else 1
    return Mount(**values), _PLAY_SUBSTEPS if values["gap"] > 0.0 else substeps


def _mount_columns(mount: Sequence[Element], numbers: NDArray[np.int64]) -> Mount:
    """The column of the gradient of each part of the mount, −1 where none is wanted."""
    places = [s.place for e in mount for s in e.spec.parameters]
    columns = {str(place): int(number) for place, number in zip(places, numbers, strict=True)}
    columns = _met_softly(columns)
    return Mount(**{name: columns.get(name, -1) for name in Mount._fields})


def _met_softly(placed: Mapping[str, Number]) -> dict[str, Number]:
    """What lies at each place of a mount: the halves of a joint meet as air gives way, unless there is air."""
    joint = {_SOFT[place]: p for place, p in placed.items() if place in _SOFT}
    return joint | {place: p for place, p in placed.items() if place not in _SOFT}


def without_hum(model: Model) -> Model:
    """The model less what has a parameter of its own in every run, as the phase of a hum."""
    return replace(model, elements=tuple(e for e in model.elements if not e.spec.tone))
