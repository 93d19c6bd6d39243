"""What the time loops work on, by name: the core, the motion, the mount, and the arrays that a run needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.physical.elements import CATALOGUE, ElementSpec, Family, ParameterSpec, code_of
from identification.physical.elements.equations.memory import PARTIALS, SLIDERS

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

UNSCALED, SCALED, FACTOR = range(3)  # how modifiers act on the partial by a parameter, see `core.modify`
POSITION_AND_CURRENT, EVERYTHING = 1, 2  # what a core is driven by beside its velocity
E, Z, W, EXPECTED, TOLERANCE, RATE, BRANCH, FIRST_RATE, CHANGE, MET_AT_ONCE, STATE = range(11)
"""Places in the state of a mounted core: extension of the mount, position and velocity of the core at the last step,
de/dt to expect at the first stage of the next, the tolerance of a velocity, de/dt and the branch's force at the end,
de/dt at the first stage and its change from there to the end, whether the last stage was met at the first guess."""


class Core(NamedTuple):
    """The parallel elements of a core."""

    codes: Integers  # (E,)
    offsets: Integers  # (E + 1,) first parameter of each element
    p: Floats  # (P,)
    column: Integers  # (P,) the column of the gradient of each parameter, −1 where none is wanted
    memory: Flags  # (E,) whether an element carries a state
    scaling: Integers  # (P,) UNSCALED, SCALED or FACTOR
    modified: bool  # some element multiplies the dissipative sum
    rare: bool  # some element is of the motion family
    leans: bool  # the sum of the damping curves has another size in rebound than in compression
    remembers: bool  # some element carries a state
    jumps: bool  # the force jumps where w changes its sign
    driven: int  # 0: the force follows from w alone; POSITION_AND_CURRENT; EVERYTHING
    only: int  # the one memory of a core that is linear in velocity; −1 of any other


class Drive(NamedTuple):
    """What moves a damper, sample by sample, (N,) each; `du` (C, N) is ∂u by the first C columns of the gradient."""

    x: Floats
    v: Floats
    u: Floats
    temperature: Floats
    a: Floats
    v_m: Floats
    dt: float
    du: Floats


class Mount(NamedTuple):
    """A spring and damper in series, beyond a gap and what air gives way by, with a relaxing branch or friction; or the
    gradient's column of each."""

    k: float  # N/m
    c: float  # N·s/m
    gap: float  # m
    k2: float  # N/m
    c2: float  # N·s/m
    c_control: float  # N·s/(m·A)
    air: float  # m
    f_half: float  # N
    side: float  # in −1 … 1: the area that presses on the air in extension is 1 + side times the mean
    k_slip: float  # N/m
    f_slip: float  # N, 0 without friction


class Carried(NamedTuple):
    """What goes from step to step."""

    memory: Floats  # (E,)
    sens: Floats  # (E + 2, M) sensitivities of the memories, of the branch's force and of the core's last velocity
    de: Floats  # (M,) of the extension
    state: Floats  # (STATE,)


class Work(NamedTuple):
    """Room for one evaluation of a core."""

    trial: Floats  # (E,) memories at a trial state
    parts: Floats  # (E, PARTIALS) their partials
    leg: Floats  # (PARTIALS,)
    dp: Floats  # (P + 1,) partials of the force by the parameters
    dm: Floats  # (E,) and by the memories


class Stages(NamedTuple):
    """Room for the sensitivities of one step, (M,) each."""

    base: Floats  # of the extension at the base of a stage
    rate: Floats  # of de/dt
    branch: Floats  # of the branch's force


class Space(NamedTuple):
    """All arrays that one run of `rigid` works in, zero at the beginning."""

    carried: Carried
    kept: Carried  # for a retry of a sample
    work: Work
    stages: Stages


@dataclass(frozen=True, slots=True)
class _Layout:
    """What the loops need to know of a core before its parameters have values."""

    codes: Integers
    offsets: Integers
    memory: Flags
    scaling: Integers
    modified: bool
    rare: bool
    only: int
    shares: tuple[int, ...]  # places of the parameters by which the damping curves lean to one side
    smooth_over: tuple[int, ...]  # places of the parameters without which the force jumps at rest
    gains: tuple[int, ...]  # places of the gains on the current
    warm: bool  # the force follows the temperature
    warms: tuple[int, ...]  # places of the parameters with which it does where they are not zero
    by_velocity: bool  # the force follows from w alone where all gains are zero
    remembers: tuple[tuple[int, int], ...]  # elements that have a state where the parameter at that place is not zero
    sliders: tuple[tuple[int, int], ...]  # elements that are sliders where that is so


@lru_cache(maxsize=1024)
def _layout(names: tuple[str, ...]) -> _Layout:
    specs = [CATALOGUE[name] for name in names]
    offsets = np.concatenate([[0], np.cumsum([len(s.parameters) for s in specs])]).astype(np.int64)
    memory = np.array([s.memory for s in specs], dtype=np.bool_)
    first = int(np.argmax(memory))
    explicit = memory.sum() == 1 and all(s.linear_in_velocity for s in specs) and specs[first].explicit_rate
    places = [(s, p, int(o) + k) for s, o in zip(specs, offsets, strict=False) for k, p in enumerate(s.parameters)]
    return _Layout(
        codes=np.array([code_of(name) for name in names], dtype=np.int64),
        offsets=offsets,
        memory=memory,
        scaling=np.array([_scaling(s, p) for s, p, _ in places], dtype=np.int64),
        modified=any(s.modifier for s in specs),
        rare=any(s.family == Family.MOTION for s in specs),
        only=first if explicit else -1,
        shares=tuple(at for _, p, at in places if p.of_curves),
        smooth_over=tuple(at for s, p, at in places if p.name == s.smooth_over),
        gains=tuple(at for _, p, at in places if p.gain),
        warm=any(s.needs_temperature for s in specs),
        warms=tuple(at for _, p, at in places if p.warms),
        remembers=tuple(
            (k, int(o) + j)
            for k, (s, o) in enumerate(zip(specs, offsets, strict=False))
            for j, p in enumerate(s.parameters)
            if p.remembers
        ),
        sliders=tuple(
            (k, int(o) + j)
            for k, (s, o) in enumerate(zip(specs, offsets, strict=False))
            for j, p in enumerate(s.parameters)
            if p.switch and not p.beside
        ),
        by_velocity=all(s.family == Family.DAMPING and not (s.by_position or s.needs_current) for s in specs),
    )


def core_of(names: tuple[str, ...], values: Floats, column: Integers) -> Core:
    """The core as the loops see it, from the names of its elements and their parameters in order."""
    names, values, column = _with_sliders(names, values, column)
    own = _layout(names)
    by_velocity = own.by_velocity and not any(values[k] for k in own.gains)
    warm = own.warm or any(values[k] for k in own.warms)
    memory, only = own.memory, own.only
    if states := [k for k, at in own.remembers if values[at] != 0.0]:
        memory, only = memory.copy(), -1
        memory[states] = True
    return Core(
        codes=own.codes,
        offsets=own.offsets,
        p=values,
        column=column,
        memory=memory,
        scaling=own.scaling,
        modified=own.modified,
        rare=own.rare,
        leans=any(values[k] != 0.0 or column[k] >= 0 for k in own.shares),
        remembers=bool(memory.any()),
        jumps=any(values[k] == 0.0 for k in own.smooth_over),
        driven=EVERYTHING if own.modified or own.rare or warm else 0 if by_velocity else POSITION_AND_CURRENT,
        only=only,
    )


def _with_sliders(names: tuple[str, ...], values: Floats, column: Integers) -> tuple[tuple[str, ...], Floats, Integers]:
    """The same with every friction that is sliders as so many elements of the same parameters and columns, each with a
    memory, and numbered where the switch is."""
    at = _layout(names).sliders
    if not any(values[place] for _, place in at):
        return names, values, column
    ends = _layout(names).offsets
    many = {k: place for k, place in at if values[place] != 0.0}
    out: list[str] = []
    parts, columns = [], []
    for k, name in enumerate(names):
        own = slice(ends[k], ends[k + 1])
        for number in range(SLIDERS if k in many else 1):
            part = values[own].copy()
            if k in many:
                part[many[k] - ends[k]] = number + 1.0
            out.append(name)
            parts.append(part)
            columns.append(column[own])
    return tuple(out), np.concatenate(parts), np.concatenate(columns)


def space_of(elements: int, parameters: int, columns: int) -> Space:
    """Arrays for a run with so many elements and parameters of the core, and columns of the gradient."""
    return Space(
        carried=_carried(elements, columns),
        kept=_carried(elements, columns),
        work=Work(
            trial=np.zeros(elements), parts=np.zeros((elements, PARTIALS)), leg=np.zeros(PARTIALS),
            dp=np.zeros(parameters + 1), dm=np.zeros(elements),
        ),
        stages=Stages(base=np.zeros(columns), rate=np.zeros(columns), branch=np.zeros(columns)),
    )  # fmt: skip


def _carried(elements: int, columns: int) -> Carried:
    return Carried(np.zeros(elements), np.zeros((elements + 2, columns)), np.zeros(columns), np.zeros(STATE))


def _scaling(spec: ElementSpec, parameter: ParameterSpec) -> int:
    if spec.modifier:
        return FACTOR
    return SCALED if spec.dissipative and not parameter.outside else UNSCALED
