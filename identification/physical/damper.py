"""Mount, control and core of a model with their values, ready for any motion: what needs no motion is done once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion
from identification.physical.collocation import nodes_of
from identification.physical.elements.equations.control import effective_current
from identification.physical.elements.mount import RIGID_DAMPING, RIGID_STIFFNESS
from identification.physical.model import Element, Model
from identification.physical.mounted import mounted
from identification.physical.program import POSITION_AND_CURRENT, Core, Drive, Mount, core_of, space_of
from identification.physical.rigid import rigid

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]
Number = TypeVar("Number", float, int)

_REVERSAL_SUBSTEPS = 4
_SOFT = {"soft": "air", "f_soft": "f_half"}  # how the halves of a joint meet, and as what that acts in a mount
_PLAY_SUBSTEPS = 16  # a rigid contact rings at some kHz; all of its error sits in the samples of an impact


@dataclass(frozen=True, slots=True)
class Response:
    """What a model answers: force (N,), N, and, where asked, its gradient (N, P) by every parameter."""

    force: Floats
    gradient: Floats | None
    failures: int = 0  # steps whose equation did not converge


@dataclass(frozen=True, slots=True, kw_only=True)
class Damper:
    """A mount, a control path and a core, and which partials are wanted."""

    control: tuple[Element, ...]
    by_control: Mask  # (C,) of the parameters of the control path, those by which partials are wanted
    core: Core
    mounting: tuple[Mount, Mount] | None
    fine: int  # substeps at an event
    follows_amplitude: bool
    columns: int  # of the gradient
    order: Integers | None  # of its columns as a model counts them, where the loops count otherwise
    gradient: bool  # whether one is wanted

    def along(self, motion: Motion, substeps: int, width: int = 0) -> Response:
        """Force along a motion, and its gradient by what is wanted, in the order of the model: (N, `width`), with zeros
        beyond, of at least (N, M)."""
        size = motion.x.size
        u, du = motion.i, np.zeros((0, size))
        if self.control:
            u, du = effective_current(self.control, motion.i, motion.dt, motion.period, motion.remanence)
            du = du[self.by_control]
        v_m = _amplitude_velocity(motion) if self.follows_amplitude else motion.a
        drive = Drive(motion.x, motion.v, u, motion.temperature, motion.a, v_m, motion.dt, du)
        force, jac = np.zeros(size), np.zeros((size if self.gradient else 0, max(self.columns, width)))
        space, failures = space_of(self.core.codes.size, self.core.p.size, self.columns), 0
        if self.mounting is None:
            rigid(self.core, drive, 1e-9 * motion.fastest, force, jac, space, True)
        else:
            steps, nodes = (substeps, self.fine * substeps, True), nodes_of(self.columns, substeps)
            failures = mounted(self.core, drive, self.mounting, steps, force, jac, space, nodes)
        if not self.gradient:
            return Response(force, None, failures)
        if self.order is not None:
            jac[:, : self.columns] = np.take(jac, self.order, axis=1)
        return Response(force, jac, failures)


def damper_of(model: Model, wanted: Mask | None) -> Damper:
    """The damper of a model; partials are `wanted` by some of its parameters, (P,), the sensor's beyond them or not."""
    mount, control, core = model.on("mount"), model.on("control"), model.on("core")
    counts = [sum(len(e.parameters) for e in path) for path in (mount, control, core)]
    mask = np.zeros(sum(counts), dtype=np.bool_) if wanted is None else wanted[: sum(counts)]
    of_mount, of_control, of_core = np.split(mask, np.cumsum(counts)[:2])
    n_mount, n_control, n_core = (int(m.sum()) for m in (of_mount, of_control, of_core))
    # The loops count the columns of the control path first, so that du lies in the first rows.
    first = n_control + n_core if n_control else 0
    numbers = _numbered(of_core, n_control or n_mount)
    program = core_of(tuple(e.name for e in core), np.array(_values(core)), numbers)
    mounting, fine = None, 1
    if mount:
        stiffness, fine = mount_of(mount, any(e.remembers for e in core))
        mounting = stiffness, _mount_columns(mount, _numbered(of_mount, first))
        if wanted is not None or stiffness.c_control != 0.0:
            program = program._replace(driven=max(program.driven, POSITION_AND_CURRENT))
    order = np.roll(np.arange(mask.sum()), n_mount) if n_control and n_mount else None
    return Damper(
        control=control, by_control=of_control, core=program, mounting=mounting, fine=fine,
        follows_amplitude=any(e.spec.needs_amplitude for e in core), columns=n_mount + n_control + n_core, order=order,
        gradient=wanted is not None,
    )  # fmt: skip


def _values(elements: Sequence[Element]) -> list[float]:
    return [p.value for e in elements for p in e.parameters]


def _numbered(wanted: Mask, first: int) -> Integers:
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


def _mount_columns(mount: Sequence[Element], numbers: Integers) -> Mount:
    """The column of the gradient of each part of the mount, −1 where none is wanted."""
    places = [s.place for e in mount for s in e.spec.parameters]
    columns = {str(place): int(number) for place, number in zip(places, numbers, strict=True)}
    columns = _met_softly(columns)
    return Mount(**{name: columns.get(name, -1) for name in Mount._fields})


def _met_softly(placed: Mapping[str, Number]) -> dict[str, Number]:
    """What lies at each place of a mount: the halves of a joint meet as air gives way, unless there is air."""
    joint = {_SOFT[place]: p for place, p in placed.items() if place in _SOFT}
    return joint | {place: p for place, p in placed.items() if place not in _SOFT}
