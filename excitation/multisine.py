"""Random-phase multisines: displacement and, where asked, current, scaled into their limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import to_config
from excitation.coverage import Coverage, coverage
from excitation.crest import schroeder
from excitation.errors import DesignError
from excitation.joint_crest import Limited, low_shares
from excitation.kinds import Kind
from excitation.lines import band_lines, chosen_lines
from excitation.multisine_spec import CurrentSpec, DisplacementSpec, MultisineSpec
from excitation.periodic import Multitone, Repeated
from excitation.portable_math import uniform
from excitation.quantities import current_behind_rig, motion_quantities
from excitation.range_figures import range_figures
from excitation.region import Region, Variable
from excitation.signal import JSON, Excitation, Samples, made_on_demand
from excitation.spectra import RecordSpectrum, TableSpectrum, control, quarter_car, road, table

__all__ = [
    "Limit",
    "Period",
    "as_excitation",
    "covered",
    "current_tones",
    "displacement_tones",
    "fit_into_limits",
    "fitted",
    "random_phase",
    "repeated",
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
    # by name, where the rig's response is known; else the damper gets what is commanded
    at_damper: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    aimed_at: Region | None = None  # the range that a homogenised design fills
    mean_current_a: float = 0.0

    @property
    def binding_limit(self) -> Limit:
        return max(self.limits, key=lambda limit: limit.used)

    def variable(self, name: Variable) -> NDArray[np.float64]:
        """What is commanded, (N,)."""
        values = {
            "displacement": self.displacement_m,
            "velocity": self.velocity_m_s,
            "acceleration": self.acceleration_m_s2,
            "current": self.current_a,
        }[name]
        if values is None:
            raise DesignError("current is not part of this design: add [current] to cover it")
        return values

    def received(self, name: Variable) -> NDArray[np.float64]:
        """What the damper gets, (N,)."""
        return self.at_damper.get(name, self.variable(name))


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
        phases = _low_phases(_decides_on_phases(spec))
        motion = motion.with_phases(phases[0])
        current = None if current is None else current.with_phases(phases[1])
    return fit_into_limits(spec, motion, current)


def _decides_on_phases(spec: MultisineSpec) -> MultisineSpec:
    """The design without what phases do not depend on; the range of the current counts only in a force estimate."""
    own = replace(spec, level=1.0, periods=1, opposite_current=False)
    if spec.current is None or spec.force is not None:
        return own
    return replace(own, current=replace(spec.current, min_a=0.0, max_a=1.0))


_GOOD_CREST = 1.375  # where a search for a low crest factor ends: the lowest found for 31 flat lines

_DERIVATIVE_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}


@lru_cache(maxsize=8)
def _low_phases(spec: MultisineSpec) -> tuple[NDArray[np.float64], ...]:
    """Phases of a low crest factor of displacement (or the derivative that is asked for) and current,
    cached for
    the levels of a series."""
    motion, current = displacement_tones(spec), current_tones(spec)
    if spec.crest_of == "limits" and spec.phases == "crest":
        return _low_shares(spec, motion, current)
    order, amplitude = _DERIVATIVE_ORDER.get(spec.crest_of, 0), motion.amplitude
    for _ in range(order):
        amplitude = amplitude * motion.omega(spec.sample_rate_hz)
    found = [_of_low_crest(spec, motion.lines, amplitude) - 0.25 * order]  # each derivative adds a quarter turn
    if current is not None:
        found.append(_of_low_crest(spec, current.lines, current.amplitude))
    for phases in found:
        phases.flags.writeable = False
    return tuple(found)


def _low_shares(spec: MultisineSpec, motion: Multitone, current: Multitone | None) -> tuple[NDArray[np.float64], ...]:
    """Phases with which the motion reaches its first limit at the largest scale, and the current's of a low crest
    factor."""
    asked = [
        [
            Limited(amplitude=motion.amplitude * q.gain, turns=q.turns, limit=q.limit)
            for q in motion_quantities(spec, motion)
            if q.limit is not None
        ]
    ]
    if current is not None:
        asked.append([Limited(amplitude=current.amplitude, turns=np.zeros(current.lines.size), limit=1.0)])
    found = []
    for tones, limited in zip((motion, current), asked, strict=False):
        assert tones is not None  # as many as are asked for
        found.append(_low(spec, tones.lines, limited))
        found[-1].flags.writeable = False
    return tuple(found)


def _of_low_crest(spec: MultisineSpec, lines: NDArray[np.int64], amplitude: NDArray[np.float64]) -> NDArray[np.float64]:
    if spec.phases == "schroeder":
        return schroeder(amplitude)
    alone = Limited(amplitude=amplitude, turns=np.zeros(lines.size), limit=1.0)
    return _low(spec, lines, [alone])


def _low(spec: MultisineSpec, lines: NDArray[np.int64], limited: Sequence[Limited]) -> NDArray[np.float64]:
    """Phases of the lowest share; a realisation beyond the first begins at phases of its own."""
    goal = _GOOD_CREST * max(q.rms_share for q in limited)
    first = spec.realisation == 0
    return low_shares(lines, limited, seed=spec.seed + spec.realisation, from_schroeder=first, goal=goal)


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
    spacing_hz = spec.sample_rate_hz / spec.period_samples
    flat = spec.phases == "crest"
    return chosen_lines(band, asked.lines, asked.detection_group, spec.seed, spacing_hz, flat=flat)


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
    """As below, for the phases that were found; ``opposite_current`` turns those of the current by half a turn."""
    if spec.opposite_current and current is not None:
        turned = current.phase_turns + 0.5
        current = current.with_phases(turned - np.floor(turned))
    return fitted(spec, motion, current)


def fitted(spec: MultisineSpec, motion: Multitone, current: Multitone | None) -> Period:
    """Scales the displacement as a whole until its first limit is reached (times ``level``), and the current
    into
    its range; phases and the shape of the spectra stay."""
    peaks = [float(np.abs(u).max()) for u in _motion(spec, motion)]
    asked = spec.displacement
    limits = [("displacement", asked.max_displacement_m, "m"), ("velocity", asked.max_velocity_m_s, "m/s")]
    if asked.max_acceleration_m_s2 is not None:
        limits.append(("acceleration", asked.max_acceleration_m_s2, "m/s²"))
    bounds = [(*limit, peak) for limit, peak in zip(limits, peaks, strict=False)] + _bounds_behind_the_rig(spec, motion)
    factor = min(value / peak for _, value, _, peak in bounds) * _SHARE_OF_LIMIT
    used = [Limit(name=name, value=value, unit=unit, used=factor * peak / value) for name, value, unit, peak in bounds]
    motion = motion.scaled(factor * spec.level)
    displacement, velocity, acceleration = _motion(spec, motion)
    scaled_current, mean_current_a = _fit_current(spec.current, current)
    current_a = None if scaled_current is None else _current_samples(spec, scaled_current, mean_current_a)
    return Period(
        displacement=motion,
        current=scaled_current,
        displacement_m=displacement,
        velocity_m_s=velocity,
        acceleration_m_s2=acceleration,
        current_a=current_a,
        limits=tuple(used),
        at_damper=_received(spec, motion, scaled_current, mean_current_a),
        mean_current_a=mean_current_a,
    )


def _bounds_behind_the_rig(spec: MultisineSpec, motion: Multitone) -> list[tuple[str, float, str, float]]:
    """Name, limit, unit and peak of what is limited besides the command: the motion at the damper, and the force."""
    if spec.response is None and spec.force is None:
        return []
    return [
        (q.name, q.limit, q.unit, float(np.abs(q.tones(motion).samples()).max()))
        for q in motion_quantities(spec, motion)
        if q.at_damper and q.limit is not None
    ]


def _received(
    spec: MultisineSpec, motion: Multitone, current: Multitone | None, mean_current_a: float
) -> dict[str, NDArray[np.float64]]:
    """What the damper gets, by name, of the channels whose response is known."""
    if spec.response is None:
        return {}
    made = {}
    if spec.response.displacement is not None:
        behind = [q for q in motion_quantities(spec, motion) if q.at_damper and q.variable != "force"]
        made = {q.variable: q.tones(motion).samples() for q in behind}
    if current is not None and spec.response.current is not None:
        made["current"] = mean_current_a + current_behind_rig(spec, current).samples()
    return made


def _motion(spec: MultisineSpec, motion: Multitone) -> tuple[NDArray[np.float64], ...]:
    rate = spec.sample_rate_hz
    return motion.samples(), motion.derivative(rate), motion.second_derivative(rate)


def _fit_current(asked: CurrentSpec | None, tones: Multitone | None) -> tuple[Multitone | None, float]:
    """The scaled tones and the mean, so that the smallest and the largest value reach min and max: the whole range."""
    if asked is None or tones is None:
        return None, 0.0
    shape = tones.samples()
    low, high = float(shape.min()), float(shape.max())
    factor = (asked.max_a - asked.min_a) / (high - low) * _SHARE_OF_LIMIT
    return tones.scaled(factor), 0.5 * ((asked.max_a + asked.min_a) - factor * (high + low))


def _current_samples(spec: MultisineSpec, tones: Multitone, mean_a: float) -> NDArray[np.float64]:
    assert spec.current is not None  # there are tones of it
    return np.clip(mean_a + tones.samples(), spec.current.min_a, spec.current.max_a)


def as_excitation(spec: MultisineSpec, period: Period, kind: str) -> Excitation:
    """The period repeated, with the configuration that makes it again and the figures that it reaches.

    The lines are kept, and the samples made of them whenever they are read.
    """
    figures = {**_figures(spec, period, covered(spec, period)), **range_figures(spec, period)}
    return repeated(spec, period, {"kind": kind, **to_config(spec)}, figures)


def repeated(
    spec: MultisineSpec, period: Period, design: Mapping[str, JSON], figures: Mapping[str, JSON]
) -> Excitation:
    """The period repeated, with a design and figures that are known."""
    current: Samples | None = None
    if period.current is not None and spec.current is not None:
        current = Repeated(
            tones=period.current,
            periods=spec.periods,
            mean=period.mean_current_a,
            least=spec.current.min_a,
            largest=spec.current.max_a,
        )
    return made_on_demand(
        kind=Kind.MULTISINE,
        sample_rate_hz=spec.sample_rate_hz,
        period_samples=spec.period_samples,
        samples=spec.period_samples * spec.periods,
        displacement_m=Repeated(tones=period.displacement, periods=spec.periods),
        current_a=current,
        design=design,
        figures=figures,
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
