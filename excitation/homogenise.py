"""Homogenised multisines: the spectra asked for, phases that cover the working range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from excitation.direct import Axis, SoftLimit, optimise_phases
from excitation.duym import duym
from excitation.multisine import Period, current_tones, displacement_tones, fit_into_limits
from excitation.multisine_spec import HomogeniseSpec, MultisineSpec, Variable
from excitation.periodic import Multitone

__all__ = ["homogenised"]

_SOFT_LIMIT_CREST = 1.6  # the optimisation lowers the crest factor of a limited, uncovered quantity to this, no further
_SOFT_LIMIT_WEIGHT = 10.0  # relative to the sum of squared modes


def homogenised(spec: MultisineSpec) -> Period:
    """The random-phase design with other phases: same lines, same amplitudes up to the common scale.

    Raises DesignError as the random-phase design does.
    """
    spec = replace(spec, homogenise=spec.homogenise or HomogeniseSpec())
    motion, current = displacement_tones(spec), current_tones(spec)
    phases = _phases(replace(spec, level=1.0, periods=1))
    motion = motion.with_phases(phases[0])
    if current is not None and len(phases) == 2:
        current = current.with_phases(phases[1])
    return fit_into_limits(spec, motion, current)


@lru_cache(maxsize=8)
def _phases(spec: MultisineSpec) -> tuple[NDArray[np.float64], ...]:
    """Phases in turns of displacement and, where it is covered, current. Cached, because the levels of a series
    and a design that is scaled to fit have the same phases."""
    asked = spec.homogenise or HomogeniseSpec()
    motion, current = displacement_tones(spec), current_tones(spec)
    tones = [motion] if current is None or "current" not in spec.covered_variables else [motion, current]
    axes = [_axis(spec, name, tones) for name in spec.covered_variables]
    if asked.method == "duym":
        found = duym(tones, axes, asked.grid, asked.iterations, (spec.seed, spec.realisation))
    else:
        found = optimise_phases(tones, axes, _soft_limits(spec, motion), asked.grid, asked.iterations)
    for phases in found:
        phases.flags.writeable = False
    return found


def _axis(spec: MultisineSpec, name: Variable, tones: Sequence[Multitone]) -> Axis:
    if name == "current":
        return Axis(tones=1, amplitude=_unit(tones[1].amplitude), offset_turns=0.0)
    if name == "velocity":
        rate = tones[0].amplitude * tones[0].omega(spec.sample_rate_hz)
        return Axis(tones=0, amplitude=_unit(rate), offset_turns=0.25)
    return Axis(tones=0, amplitude=_unit(tones[0].amplitude), offset_turns=0.0)


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
    covered = [o for o, name in enumerate(("displacement", "velocity")) if name in spec.covered_variables]
    # the factor on the motion at which the covered axes reach their limits, uniform over ±√3 rms
    factor = min(float(values[o] or np.inf) / (np.sqrt(3.0) * rms[o]) for o in covered)
    soft = []
    for order, limit in enumerate(values):
        if order in covered or limit is None:
            continue
        crest = max(_SOFT_LIMIT_CREST, limit / (factor * rms[order]))
        if crest < 5.0:
            axis = Axis(tones=0, amplitude=_unit(amplitudes[order]), offset_turns=0.25 * order)
            soft.append(SoftLimit(axis=axis, limit=crest / np.sqrt(3.0), weight=_SOFT_LIMIT_WEIGHT))
    return soft
