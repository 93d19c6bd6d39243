"""The range of working points that is asked for, and the part of it that limits and rig allow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from excitation.multisine_spec import MultisineSpec
from excitation.periodic import Multitone
from excitation.quantities import Quantity, at_damper, current_behind_rig, motion_quantities
from excitation.region import Region, derivative_pair

__all__ = ["EASY", "RangeScale", "achievable", "asked", "edge_crest", "range_at", "scale_asked", "scale_for"]

EASY = 1.6
"""Crest factor that a limited quantity besides the covered ones is allowed, where nothing better has been found.

With it D ≤ 0.5 % on the rest of the range is reached for all spectra tried (flat, road, quarter-car; see
benchmarks/bench_coverage.py); 1.4 is enough for a road and too little for a flat spectrum. A design tries lower
values first.
Half as much is no crest factor; at double the achievable range is half as wide as it could be.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeScale:
    """How large the motion and the current get: the factor on the relative amplitudes of the design."""

    motion: float
    current: float  # half the range of the current at the damper over that of the command


def edge_crest(spec: MultisineSpec, variable: str) -> float:
    """Crest factor of a variable that fills its range evenly: √3 on an interval, 2 on an axis of an ellipse."""
    names = spec.covered_variables
    pair = derivative_pair(names) or ()
    return 2.0 if any(names[place] == variable for place in pair) else float(np.sqrt(3.0))


def scale_for(spec: MultisineSpec, motion: Multitone, current: Multitone | None, crest: float) -> RangeScale:
    """The largest scale at which covered variables fill their range evenly and the crest factor of every other limited
    quantity need not be below ``crest``. What is commanded of a covered variable keeps its crest factor and
    what the rig adds, ``crest``/1.6 at most.
    """
    known = motion_quantities(spec, motion)
    factors = [q.limit / (_crest(spec, q, crest) * q.rms(motion)) for q in known if q.limit is not None]
    return RangeScale(motion=min(factors), current=_current_share(spec, current))


def scale_asked(spec: MultisineSpec, motion: Multitone, current: Multitone | None) -> RangeScale:
    """The scale at which the covered variables reach their limits, whatever the others do."""
    known = motion_quantities(spec, motion)
    received = [at_damper(spec, known, name) for name in spec.covered_variables if name != "current"]
    factors = [q.limit / (edge_crest(spec, q.variable) * q.rms(motion)) for q in received if q.limit is not None]
    if not factors:
        return scale_for(spec, motion, current, EASY)
    return RangeScale(motion=min(factors), current=_current_share(spec, current))


def _crest(spec: MultisineSpec, quantity: Quantity, crest: float) -> float:
    """The crest factor that the quantity is taken to have."""
    if quantity.variable not in spec.covered_variables:
        return crest
    edge = edge_crest(spec, quantity.variable)
    return edge if quantity.is_received(spec) else edge * max(1.0, crest / EASY)


def _current_share(spec: MultisineSpec, current: Multitone | None) -> float:
    """What the rig leaves of the current's range where command and current are as even as each other."""
    if current is None:
        return 1.0
    behind = current_behind_rig(spec, current)
    rms = [float(np.sqrt(np.sum(t.amplitude * t.amplitude))) for t in (behind, current)]
    return min(1.0, rms[0] / rms[1])


def range_at(spec: MultisineSpec, motion: Multitone, scale: RangeScale) -> Region:
    """What covered variables reach at a scale when they fill their range evenly."""
    known, names = motion_quantities(spec, motion), spec.covered_variables
    low, high = [], []
    for name in names:
        if name == "current":
            assert spec.current is not None  # MultisineSpec refuses a covered current without one
            lost = 0.5 * (spec.current.max_a - spec.current.min_a) * (1.0 - scale.current)
            low.append(spec.current.min_a + lost)
            high.append(spec.current.max_a - lost)
        else:
            half = scale.motion * edge_crest(spec, name) * at_damper(spec, known, name).rms(motion)
            low.append(-half)
            high.append(half)
    return Region(names=names, low=tuple(low), high=tuple(high), pair=derivative_pair(names))


def achievable(spec: MultisineSpec, motion: Multitone, current: Multitone | None, crest: float = EASY) -> Region:
    """The largest range that can be filled evenly while the other limited quantities keep the crest factor."""
    return range_at(spec, motion, scale_for(spec, motion, current, crest))


def asked(spec: MultisineSpec) -> Region | None:
    """The box of the limits of the covered variables; None where one of them has no limit."""
    given = spec.displacement
    limits = {
        "displacement": given.max_displacement_m,
        "velocity": given.max_velocity_m_s,
        "acceleration": given.max_acceleration_m_s2,
    }
    low, high = [], []
    for name in spec.covered_variables:
        if name == "current":
            assert spec.current is not None  # as above
            low.append(spec.current.min_a)
            high.append(spec.current.max_a)
            continue
        limit = limits[name]
        if limit is None:
            return None
        low.append(-limit)
        high.append(limit)
    return Region(names=spec.covered_variables, low=tuple(low), high=tuple(high))
