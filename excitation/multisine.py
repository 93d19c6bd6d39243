"""Random-phase multisines: displacement and, where asked, current, scaled into their limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import to_config
from excitation.coverage import Coverage, coverage
from excitation.crest import low_crest, schroeder
from excitation.errors import DesignError
from excitation.kinds import Kind
from excitation.lines import band_lines, excited_lines
from excitation.multisine_spec import CurrentSpec, DisplacementSpec, MultisineSpec, Variable
from excitation.periodic import Multitone
from excitation.portable_math import uniform
from excitation.signal import JSON, Excitation
from excitation.spectra import RecordSpectrum, TableSpectrum, control, quarter_car, road, table

__all__ = [
    "Limit",
    "Period",
    "as_excitation",
    "covered",
    "current_tones",
    "displacement_tones",
    "fit_into_limits",
    "random_phase",
]

# share of a limit that is used, so that rounding, here or in a reader, does not exceed it
_SHARE_OF_LIMIT = 1.0 - 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """A limit and how much of it is used: 1 where it binds."""

    name: str
    value: float
    unit: str
    used: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Period:
    """One period within the limits, as lines and as samples."""

    displacement: Multitone  # m
    current: Multitone | None  # A, without its mean
    displacement_m: NDArray[np.float64]  # (N,)
    velocity_m_s: NDArray[np.float64]  # (N,)
    acceleration_m_s2: NDArray[np.float64]  # (N,)
    current_a: NDArray[np.float64] | None  # (N,)
    limits: tuple[Limit, ...]  # of the motion

    @property
    def binding_limit(self) -> Limit:
        return max(self.limits, key=lambda limit: limit.used)

    def variable(self, name: Variable) -> NDArray[np.float64]:
        values = {
            "displacement": self.displacement_m,
            "velocity": self.velocity_m_s,
            "current": self.current_a,
        }[name]
        if values is None:
            raise DesignError("current is not part of this design: add [current] to cover it")
        return values


def random_phase(spec: MultisineSpec) -> Period:
    """A multisine with phases drawn from U[0, 1) turns by seed and realisation, or of a low crest factor.

    Raises DesignError where a band holds no line or a table does not span it.

    References
    ----------
    Pintelon & Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012: random-phase
    multisines.
    """
    motion, current = displacement_tones(spec), current_tones(spec)
    if spec.phases != "random":
        phases = _low_phases(replace(spec, level=1.0, periods=1))
        motion = motion.with_phases(phases[0])
        current = None if current is None else current.with_phases(phases[1])
    return fit_into_limits(spec, motion, current)


_DERIVATIVE_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}


@lru_cache(maxsize=8)
def _low_phases(spec: MultisineSpec) -> tuple[NDArray[np.float64], ...]:
    """Phases of a low crest factor of displacement (or the derivative that is asked for) and current,
    cached for
    the levels of a series."""
    motion, current = displacement_tones(spec), current_tones(spec)
    order, amplitude = _DERIVATIVE_ORDER[spec.crest_of], motion.amplitude
    for _ in range(order):
        amplitude = amplitude * motion.omega(spec.sample_rate_hz)
    found = [_of_low_crest(spec, motion.lines, amplitude) - 0.25 * order]  # each derivative adds a quarter turn
    if current is not None:
        found.append(_of_low_crest(spec, current.lines, current.amplitude))
    for phases in found:
        phases.flags.writeable = False
    return tuple(found)


def _of_low_crest(spec: MultisineSpec, lines: NDArray[np.int64], amplitude: NDArray[np.float64]) -> NDArray[np.float64]:
    if spec.phases == "schroeder":
        return schroeder(amplitude)
    return low_crest(lines, amplitude, seed=spec.seed + spec.realisation)


def displacement_tones(spec: MultisineSpec) -> Multitone:
    """Lines, amplitudes up to a common factor and random phases of the displacement."""
    asked = spec.displacement
    lines = _lines(spec, asked)
    frequency_hz = lines.astype(np.float64) * (spec.sample_rate_hz / spec.period_samples)
    return Multitone(
        period_samples=spec.period_samples,
        lines=lines,
        amplitude=_displacement_spectrum(asked, frequency_hz),
        phase_turns=uniform((spec.seed, spec.realisation, 0), lines.size),
    )


def current_tones(spec: MultisineSpec) -> Multitone | None:
    """Lines, amplitudes up to a common factor and random phases of the current; None without one."""
    asked = spec.current
    if asked is None:
        return None
    lines = _lines(spec, asked)
    frequency_hz = lines.astype(np.float64) * (spec.sample_rate_hz / spec.period_samples)
    return Multitone(
        period_samples=spec.period_samples,
        lines=lines,
        amplitude=_current_spectrum(asked, frequency_hz),
        phase_turns=uniform((spec.seed, spec.realisation, 1), lines.size),
    )


def _lines(spec: MultisineSpec, asked: DisplacementSpec | CurrentSpec) -> NDArray[np.int64]:
    band = band_lines(asked.f_min_hz, asked.f_max_hz, spec.sample_rate_hz, spec.period_samples)
    return excited_lines(band, asked.lines, asked.detection_group, spec.seed)[0]


def _displacement_spectrum(asked: DisplacementSpec, frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    match asked.spectrum:
        case TableSpectrum() as known:
            return table(frequency_hz, known.frequency_hz, known.amplitude)
        case RecordSpectrum() as known:
            if not known.frequency_hz:
                raise DesignError(f"spectrum.record {known.record!r} has not been read: read it before the design")
            return table(frequency_hz, known.frequency_hz, known.amplitude)
        case "quarter-car":
            return quarter_car(frequency_hz, asked.quarter_car, asked.road)
        case "road":
            return road(frequency_hz, asked.road)
        case _:
            return np.ones_like(frequency_hz)


def _current_spectrum(asked: CurrentSpec, frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    match asked.spectrum:
        case TableSpectrum() as known:
            return table(frequency_hz, known.frequency_hz, known.amplitude)
        case "control":
            return control(frequency_hz, asked.corner_hz)
        case _:
            return np.ones_like(frequency_hz)


def fit_into_limits(spec: MultisineSpec, motion: Multitone, current: Multitone | None) -> Period:
    """Scales the displacement as a whole until its first limit is reached (times ``level``), and the current
    into
    its range; phases and the shape of the spectra stay."""
    peaks = [float(np.abs(u).max()) for u in _motion(spec, motion)]
    asked = spec.displacement
    limits = [("displacement", asked.max_displacement_m, "m"), ("velocity", asked.max_velocity_m_s, "m/s")]
    if asked.max_acceleration_m_s2 is not None:
        limits.append(("acceleration", asked.max_acceleration_m_s2, "m/s²"))
    factor = min(value / peak for (_, value, _), peak in zip(limits, peaks, strict=False)) * _SHARE_OF_LIMIT
    used = [
        Limit(name=name, value=value, unit=unit, used=factor * peak / value)
        for (name, value, unit), peak in zip(limits, peaks, strict=False)
    ]
    motion = motion.scaled(factor * spec.level)
    displacement, velocity, acceleration = _motion(spec, motion)
    scaled_current, current_a = _fit_current(spec.current, current)
    return Period(
        displacement=motion,
        current=scaled_current,
        displacement_m=displacement,
        velocity_m_s=velocity,
        acceleration_m_s2=acceleration,
        current_a=current_a,
        limits=tuple(used),
    )


def _motion(spec: MultisineSpec, motion: Multitone) -> tuple[NDArray[np.float64], ...]:
    rate = spec.sample_rate_hz
    return motion.samples(), motion.derivative(rate), motion.second_derivative(rate)


def _fit_current(
    asked: CurrentSpec | None, tones: Multitone | None
) -> tuple[Multitone | None, NDArray[np.float64] | None]:
    """The mean is chosen so that the smallest and the largest value reach min and max: the whole range is used."""
    if asked is None or tones is None:
        return None, None
    shape = tones.samples()
    low, high = float(shape.min()), float(shape.max())
    factor = (asked.max_a - asked.min_a) / (high - low) * _SHARE_OF_LIMIT
    mean = 0.5 * ((asked.max_a + asked.min_a) - factor * (high + low))
    tones = tones.scaled(factor)
    return tones, np.clip(mean + tones.samples(), asked.min_a, asked.max_a)


def as_excitation(spec: MultisineSpec, period: Period, kind: str) -> Excitation:
    """The period repeated, with the configuration that makes it again and the figures that it reaches."""
    return Excitation(
        kind=Kind.MULTISINE,
        sample_rate_hz=spec.sample_rate_hz,
        period_samples=spec.period_samples,
        displacement_m=np.tile(period.displacement_m, spec.periods),
        current_a=None if period.current_a is None else np.tile(period.current_a, spec.periods),
        design={"kind": kind, **to_config(spec)},
        figures=_figures(spec, period, covered(spec, period)),
    )


def covered(spec: MultisineSpec, period: Period) -> Coverage:
    """How evenly the period fills the box of the variables that the specification names."""
    return coverage([period.variable(name) for name in spec.covered_variables], spec.grid)


def _figures(spec: MultisineSpec, period: Period, reached: Coverage) -> Mapping[str, JSON]:
    binding = period.binding_limit
    return {
        "coverage": reached.index,
        "coverage_normalised": reached.normalised,
        "coverage_variables": list(spec.covered_variables),
        "coverage_grid": list(spec.grid),
        "binding_limit": binding.name,
        "limits": {
            limit.name: {
                "limit": limit.value,
                "reached": limit.used * limit.value * spec.level,
                "unit": limit.unit,
            }
            for limit in period.limits
        },
        "peak_acceleration": float(np.abs(period.acceleration_m_s2).max()),
        "crest_factor": crest_factor(period.displacement_m),
    }


def crest_factor(values: NDArray[np.float64]) -> float:
    """max abs(u) / rms(u): 1 at best, √2 for a sine."""
    return float(np.abs(values).max() / np.sqrt(np.mean(values * values)))
