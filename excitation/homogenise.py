"""Homogenised multisines: the spectra asked for, phases that cover the working range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from excitation.coverage import coverage_within
from excitation.coverage_cost import Axis, SoftLimit
from excitation.direct import optimise_phases
from excitation.direct_range import LIMIT_WEIGHT, optimise_within
from excitation.duym import duym
from excitation.multisine import Period, current_tones, displacement_tones, fit_into_limits
from excitation.multisine_spec import HomogeniseSpec, MultisineSpec
from excitation.periodic import Multitone
from excitation.portable_math import uniform
from excitation.quantities import at_damper, current_behind_rig, motion_quantities
from excitation.region import Region, Variable, derivative_pair
from excitation.working_range import EASY, RangeScale, range_at, scale_asked, scale_for

__all__ = ["homogenised"]

_SOFT_LIMIT_CREST = 1.6  # the optimisation lowers the crest factor of a limited, uncovered quantity to this, no further
_SOFT_LIMIT_WEIGHT = 10.0  # relative to the sum of squared modes

_LONG = 2**16  # samples from which one search is made: it takes seconds, and cells hold enough samples
_STARTS = 8
"""Searches of a range with D > GOOD, each from other random phases; the best counts. One in two gets there: the worst
of 20 seeds has 0.50 %, with half as many 0.54 %. Half of them where D is beyond twice GOOD: they differ by less."""
_DUYM_WORK = 2**25  # samples that rounds go through in all: saves time only, a fixed point comes after some ten rounds
_FREE_CREST = 5.0  # a limit this far out is not reached whatever the phases

_CRESTS_TRIED = (1.4, 1.5, EASY)
"""Crest factors of limited, uncovered quantities that a design tries in this order. 1.4: below it no spectrum tried had
D ≤ 0.5 %. More values give a range a little wider, for the time of one more search each."""

GOOD = 0.5
"""Coverage index, percent, at which a range counts as covered: cells differ from the mean by 7 % rms.

Half the index of as many independent uniform samples counts as well where that is more (short periods, many cells).
At half of it ranges come out some percent narrower, at double they are wider and less even."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Found:
    phases: tuple[NDArray[np.float64], ...]
    region: Region | None  # that was aimed at; None: whatever the motion reaches


def homogenised(spec: MultisineSpec) -> Period:
    """The random-phase design with other phases: same lines, same amplitudes up to the common scale.

    Raises DesignError as the random-phase design does.
    """
    spec = replace(spec, homogenise=spec.homogenise or HomogeniseSpec())
    found = _found(replace(spec, level=1.0, periods=1, opposite_current=False))
    return replace(_period(spec, found.phases), aimed_at=found.region)


def _period(spec: MultisineSpec, phases: tuple[NDArray[np.float64], ...]) -> Period:
    motion, current = displacement_tones(spec).with_phases(phases[0]), current_tones(spec)
    if current is not None and len(phases) == 2:
        current = current.with_phases(phases[1])
    return fit_into_limits(spec, motion, current)


@lru_cache(maxsize=8)
def _found(spec: MultisineSpec) -> _Found:
    """Phases in turns of displacement and, where it is covered, current. Cached, because the levels of a series
    and a design that is scaled to fit have the same phases."""
    asked = spec.homogenise or HomogeniseSpec()
    motion, current = displacement_tones(spec), current_tones(spec)
    tones = [motion] if current is None or "current" not in spec.covered_variables else [motion, current]
    axes = [_axis(spec, name, tones) for name in spec.covered_variables]
    region = None
    if asked.method == "duym":
        phases = duym(tones, axes, asked.grid, _rounds(spec, asked), (spec.seed, spec.realisation))
    elif asked.range == "reached":
        phases = optimise_phases(tones, axes, _soft_limits(spec, motion), asked.grid, asked.iterations)
    else:
        phases, region = _over_a_range(spec, tones, axes)
    for one in phases:
        one.flags.writeable = False
    return _Found(phases=phases, region=region)


def _rounds(spec: MultisineSpec, asked: HomogeniseSpec) -> int | None:
    """Rounds of Duym's iteration: fewer on long periods, so that a design takes seconds. The range "reached" keeps what
    earlier releases did."""
    if asked.iterations is not None or asked.range == "reached" or spec.period_samples <= _DUYM_WORK // 200:
        return asked.iterations
    return max(1, _DUYM_WORK // spec.period_samples)


def _over_a_range(
    spec: MultisineSpec, tones: Sequence[Multitone], axes: Sequence[Axis]
) -> tuple[tuple[NDArray[np.float64], ...], Region]:
    """Phases for the widest range of those tried that is covered, or for the range that is asked for."""
    asked = spec.homogenise or HomogeniseSpec()
    motion, current = tones[0], current_tones(spec)
    scales = [scale_for(spec, motion, current, crest) for crest in _CRESTS_TRIED]
    if asked.range == "asked":
        scales = [scale_asked(spec, motion, current)]
    pair = derivative_pair(spec.covered_variables)
    if pair is not None:
        axes = [replace(a, amplitude=a.amplitude * (np.sqrt(0.75) if p in pair else 1.0)) for p, a in enumerate(axes)]
    enough = max(GOOD, 50.0 * (np.prod(asked.grid) - 1) / spec.period_samples)
    for scale in dict.fromkeys(scales):
        region = range_at(spec, motion, scale)
        phases, reached = _search(spec, tones, axes, scale, region)
        if reached <= enough:
            break
    ends_at = GOOD if len(asked.grid) == 2 else enough  # three variables do not get there by starting again
    for again in range(1, _STARTS if spec.period_samples < _LONG else 1):
        if reached <= ends_at or (again >= _STARTS // 2 and reached > 2.0 * GOOD):
            break
        others = [
            t.with_phases(uniform((spec.seed, spec.realisation, 11, again, n), t.lines.size))
            for n, t in enumerate(tones)
        ]
        other, index = _search(spec, others, axes, scale, region)
        if index < reached:
            phases, reached = other, index
    return phases, region


def _search(
    spec: MultisineSpec, tones: Sequence[Multitone], axes: Sequence[Axis], scale: RangeScale, region: Region
) -> tuple[tuple[NDArray[np.float64], ...], float]:
    """Phases from those of ``tones``, and their coverage index of the region."""
    asked = spec.homogenise or HomogeniseSpec()
    soft = _limits_at(spec, tones, scale)
    return optimise_within(
        tones, axes, soft, region.pair, asked.grid,
        lambda phases: covered_share(spec, _period(spec, phases), region), asked.iterations,
    )  # fmt: skip


def covered_share(spec: MultisineSpec, period: Period, region: Region) -> float:
    """The coverage index of what the damper gets, over the region."""
    return coverage_within(region, [period.received(name) for name in region.names], spec.grid).index


def _limits_at(spec: MultisineSpec, tones: Sequence[Multitone], scale: RangeScale) -> list[SoftLimit]:
    """Every limit that what is covered does not keep by itself, as a crest factor at the scale."""
    motion, soft = tones[0], []
    for quantity in motion_quantities(spec, motion):
        if quantity.limit is None or (quantity.variable in spec.covered_variables and quantity.is_received(spec)):
            continue
        crest = quantity.limit / (scale.motion * quantity.rms(motion))
        if crest < _FREE_CREST:
            axis = Axis(tones=0, amplitude=_unit(motion.amplitude * quantity.gain), offset_turns=quantity.turns)
            soft.append(SoftLimit(axis=axis, limit=crest / np.sqrt(3.0), weight=LIMIT_WEIGHT))
    if len(tones) == 2 and spec.response is not None and spec.response.current is not None:
        command = Axis(tones=1, amplitude=_unit(tones[1].amplitude), offset_turns=0.0)
        soft.append(SoftLimit(axis=command, limit=1.0, weight=LIMIT_WEIGHT))
    return soft


def _axis(spec: MultisineSpec, name: Variable, tones: Sequence[Multitone]) -> Axis:
    """A covered variable as the damper gets it."""
    if name == "current":
        behind = current_behind_rig(spec, tones[1].with_phases(np.zeros(tones[1].lines.size)))
        return Axis(tones=1, amplitude=_unit(behind.amplitude), offset_turns=behind.phase_turns)
    quantity = at_damper(spec, motion_quantities(spec, tones[0]), name)
    return Axis(tones=0, amplitude=_unit(tones[0].amplitude * quantity.gain), offset_turns=quantity.turns)


def _unit(amplitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scaled to rms 1/√3, that of a uniform distribution over ±1."""
    return np.asarray(amplitude * np.sqrt(2.0 / 3.0 / np.sum(amplitude * amplitude)))


def _soft_limits(spec: MultisineSpec, motion: Multitone) -> list[SoftLimit]:
    """The limits of the motion on quantities that are not covered, each at the level that it has when the covered
    axes reach theirs.
    """
    asked = spec.displacement
    omega = motion.omega(spec.sample_rate_hz)
    amplitudes = (motion.amplitude, motion.amplitude * omega, motion.amplitude * omega * omega)
    rms = [float(np.sqrt(0.5 * np.sum(amplitude * amplitude))) for amplitude in amplitudes]
    values = (asked.max_displacement_m, asked.max_velocity_m_s, asked.max_acceleration_m_s2)
    covered = [o for o, name in enumerate(_MOTION) if name in spec.covered_variables]
    # the factor on the motion at which the covered axes reach their limits, uniform over ±√3 rms
    factor = min(float(values[o] or np.inf) / (np.sqrt(3.0) * rms[o]) for o in covered)
    soft = []
    for order, limit in enumerate(values):
        if order in covered or limit is None:
            continue
        crest = max(_SOFT_LIMIT_CREST, limit / (factor * rms[order]))
        if crest < _FREE_CREST:
            axis = Axis(tones=0, amplitude=_unit(amplitudes[order]), offset_turns=0.25 * order)
            soft.append(SoftLimit(axis=axis, limit=crest / np.sqrt(3.0), weight=_SOFT_LIMIT_WEIGHT))
    return soft


_MOTION = ("displacement", "velocity", "acceleration")
