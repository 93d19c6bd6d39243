"""Rows of the damping family: a force over velocity, position and current at one moment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from identification.criteria import FORM
from identification.physical.elements.spec import (
    TINY,
    UNBOUNDED,
    Alias,
    Curve,
    ElementSpec,
    Family,
    ParameterSpec,
    Remedy,
    Surroundings,
    Values,
)

if TYPE_CHECKING:
    from identification.scales import Scales

# What makes a force fall with speed may break a core loose behind its mount: once more, too faint for that.
_FAINT = 0.1


def _slopes(s: Scales) -> tuple[float, float]:
    return 0.2 / s.v_rms, 3.0 / s.speeds[0]  # a curve steeper than the slow speeds is friction


def _knees(s: Scales) -> tuple[float, float]:
    return 0.1 * s.speeds[0], 30.0 * s.v_rms


def _arctan_starts(s: Scales) -> Sequence[Values]:
    return [{"F1": s.gap, "S": 1.0 / w, "d": 0.0} for w in (s.speeds[0], s.speeds[2])]


def _piecewise_starts(s: Scales) -> Sequence[Values]:
    return [{"c1": s.gap / w, "c2": 0.1 * s.gap / w, "f_r": s.gap} for w in (s.speeds[1], s.speeds[2])]


def _valve_starts(s: Scales) -> Sequence[Values]:
    slope, low, high = s.gap / s.v_rms, s.current_low, s.current_high
    return [{"c_soft": 0.5 * slope, "c_firm": 1.5 * slope, "u_soft": low, "u_firm": high, "w_knee": s.speeds[3]}]


def _quadratic_starts(s: Scales) -> Sequence[Values]:
    q = s.gap / s.v_rms**2
    return [{"q": q}, *({"q": q, "w_cap": w} for w in s.speeds[2:])]


def _relief_starts(s: Scales) -> Sequence[Values]:
    # No more than what is missing: more would make a core fall with speed, break loose and take its time at it.
    slope, knees = min(s.gap, 0.3 * s.force) / s.v_rms, (*s.speeds[1:], 0.6 * s.v_max)
    return [*({"c_drop": slope, "w_knee": w} for w in knees), {"c_drop": _FAINT * slope, "w_knee": knees[-1]}]


def _tanh_starts(s: Scales) -> Sequence[Values]:
    return [{"alpha": s.gap, "alpha_control": 0.0, "beta": 1.0 / w, "delta": 0.2} for w in (s.speeds[0], s.speeds[1])]


def _is_friction(values: Values, around: Surroundings) -> bool:
    """Whether a curve bends far below the lowest typical speed."""
    return FORM.disproportionate * values["f_r"] < values["c1"] * around.slow


def _is_yield(values: Values, around: Surroundings) -> bool:
    """Whether a bend takes several times the slope that force over velocity has: such a curve yields near rest."""
    drop = values["c_drop"] + values["c_drop_control"] * around.current
    return drop * around.speed > FORM.disproportionate * around.force


def _is_plain(values: Values, around: Surroundings) -> bool:
    """Whether a hysteresis has no loop and bends within the speeds of the motion, as others do; below, it yields."""
    return values["delta"] < FORM.build_up and FORM.disproportionate * around.slow * values["beta"] < 1.0


def _never_bends(values: Values, around: Surroundings) -> bool:
    """Whether a hysteresis stays so far below its yield force that it is a dashpot and a spring: tanh y departs from y
    by y²/3, up to the peak of a sine of the rms speed."""
    most = math.sqrt(2.0) * around.speed * values["beta"] + values["delta"]
    return most**2 / 3.0 < FORM.tolerance


def _without_loop(values: Values, others: Sequence[ElementSpec]) -> bool:
    """Whether a hysteresis beside a whole curve has no loop: it corrects that curve."""
    return values["delta"] < FORM.build_up and any(o.curve == Curve.WHOLE for o in others)


ROWS: Final = (
    ElementSpec(
        name="viscous_damping",
        family=Family.DAMPING,
        title="viscous damping",
        equation="f = (c + c_control·u)·w",
        parameters=(
            ParameterSpec("c", "N·s/m", remedy=Remedy.SPEEDS),
            ParameterSpec("c_control", "N·s/(m·A)", UNBOUNDED, default=0.0, gain=True, remedy=Remedy.CURRENT),
        ),
        starts=lambda s: [{"c": s.gap / s.v_rms, "c_control": 0.0}],
        linear_in_velocity=True,
        curve=Curve.LAW,
    ),
    ElementSpec(
        name="arctan_damping",
        family=Family.DAMPING,
        title="saturating (arctan) damping",
        equation="f = F1·(2/π)·arctan(S·w) + d·w + F2",
        parameters=(
            ParameterSpec("F1", "N", remedy=Remedy.SPEEDS),
            ParameterSpec("S", "s/m", TINY, limits=_slopes, remedy=Remedy.SPEEDS),
            ParameterSpec("d", "N·s/m", bound_is_meant=True, remedy=Remedy.SPEEDS),
            ParameterSpec("F2", "N", UNBOUNDED, default=0.0, outside=True),
        ),
        starts=_arctan_starts,
        curve=Curve.WHOLE,
    ),
    ElementSpec(
        name="piecewise_linear_damping",
        family=Family.DAMPING,
        title="piecewise-linear damping",
        equation="f = c1·w while |c1·w| < f_r, beyond it sgn(w)·(1 − c2/c1)·f_r + c2·w",
        parameters=(
            ParameterSpec("c1", "N·s/m", TINY, remedy=Remedy.SPEEDS),
            ParameterSpec("c2", "N·s/m", bound_is_meant=True, remedy=Remedy.SPEEDS),
            ParameterSpec("f_r", "N", remedy=Remedy.SPEEDS),
        ),
        starts=_piecewise_starts,
        mistaken=_is_friction,
        curve=Curve.WHOLE,
    ),
    ElementSpec(
        name="valve_damping",
        family=Family.DAMPING,
        title="controlled valve damping",
        equation="f = c(u)·w/√(1 + (w/w_knee)²), c from c_soft at u_soft to c_firm at u_firm",
        parameters=(
            ParameterSpec("c_soft", "N·s/m", remedy=Remedy.CURRENT),
            ParameterSpec("c_firm", "N·s/m", remedy=Remedy.CURRENT),
            ParameterSpec("u_soft", "A", UNBOUNDED, remedy=Remedy.CURRENT),
            ParameterSpec("u_firm", "A", UNBOUNDED, remedy=Remedy.CURRENT),
            ParameterSpec(
                "w_knee", "m/s", TINY, limits=lambda s: (0.1 * s.speeds[0], 30.0 * s.v_rms), remedy=Remedy.SPEEDS
            ),
        ),
        starts=_valve_starts,
        needs_current=True,
        curve=Curve.WHOLE,
    ),
    ElementSpec(
        name="quadratic_damping",
        family=Family.DAMPING,
        title="quadratic (orifice) damping",
        equation="f = q·sgn(w)·min(|w|, w_cap)², without w_cap q·w·|w|",
        parameters=(
            ParameterSpec("q", "N·s²/m²", remedy=Remedy.SPEEDS),
            # Once a valve beside them is open it takes what flow there is more: that of the ports stays as it is.
            ParameterSpec(
                "w_cap",
                "m/s",
                default=0.0,
                refinement=True,
                limits=lambda s: (0.2 * s.speeds[0], 0.95 * s.v_max),
                remedy=Remedy.SPEEDS,
            ),
        ),
        starts=_quadratic_starts,
        denied=lambda v, others: v["w_cap"] > 0.0 and not any(o.name == "relief_valve" for o in others),
        curve=Curve.LAW,
    ),
    ElementSpec(
        name="relief_valve",
        family=Family.DAMPING,
        title="relief valve",
        equation="f = −(c_drop + c_drop_control·u)·sgn(w)·(h(|w|) − h(0)), "
        "h(s) = (s − w_knee + √((s − w_knee)² + w_round²))/2: max(0, s − w_knee), the knee rounded over w_round",
        parameters=(
            ParameterSpec("c_drop", "N·s/m", remedy=Remedy.SPEEDS),
            ParameterSpec(
                "w_knee", "m/s", TINY, limits=lambda s: (0.2 * s.speeds[0], 0.95 * s.v_max), remedy=Remedy.SPEEDS
            ),
            ParameterSpec(
                "c_drop_control", "N·s/(m·A)", UNBOUNDED, default=0.0, refinement=True, gain=True, remedy=Remedy.CURRENT
            ),
            # A stack of shims opens one after the other; the canonical form bends at one speed.
            ParameterSpec("w_round", "m/s", default=0.0, refinement=True, remedy=Remedy.SPEEDS),
        ),
        starts=_relief_starts,
        mistaken=_is_yield,
        alias=Alias(
            "a fluid or a seal that yields at this force", "go far below the speed of the bend: a yield force stays"
        ),
        curve=Curve.BEND,
    ),
    ElementSpec(
        name="damping_asymmetry",
        family=Family.DAMPING,
        title="rebound–compression asymmetry",
        equation="f = (c_a + c_a_control·u)·|w| + share·|f_d|, f_d the sum of the other damping curves",
        parameters=(
            ParameterSpec("c_a", "N·s/m", UNBOUNDED, remedy=Remedy.SPEEDS),
            ParameterSpec(
                "c_a_control", "N·s/(m·A)", UNBOUNDED, default=0.0, refinement=True, gain=True, remedy=Remedy.CURRENT
            ),
            # The two valves of a damper mostly bend alike: one side is the other times a factor.
            ParameterSpec(
                "share", "–", -1.0, high=1.0, default=0.0, refinement=True, of_curves=True, remedy=Remedy.SPEEDS
            ),
        ),
        starts=lambda s: [{"c_a": part * s.gap / s.v_rms} for part in (1.0, _FAINT)],
    ),
    ElementSpec(
        name="rebound_compression_damping",
        family=Family.DAMPING,
        title="damping with its own curve in rebound and in compression",
        equation="f = c·w·(share + (1 − share)/√(1 + (w/w_knee)²)), c and w_knee: c_r and w_r in rebound (w > 0), "
        "c_c and w_c in compression; share: what is left of the slope far beyond the knee",
        parameters=(
            ParameterSpec("c_r", "N·s/m", remedy=Remedy.SPEEDS),
            ParameterSpec("w_r", "m/s", TINY, limits=_knees, remedy=Remedy.SPEEDS),
            ParameterSpec("c_c", "N·s/m", remedy=Remedy.SPEEDS),
            ParameterSpec("w_c", "m/s", TINY, limits=_knees, remedy=Remedy.SPEEDS),
            ParameterSpec("share", "–", high=1.0, default=0.0, bound_is_meant=True, remedy=Remedy.SPEEDS),
        ),
        nameable=False,  # a base for a simulation: what it adds to another curve has names of fewer parameters
        curve=Curve.WHOLE,
    ),
    ElementSpec(
        name="hydraulic_bump_stop",
        family=Family.DAMPING,
        title="hydraulic bump stop",
        equation="f = q·(1 + side·sgn(z))·max(0, |z| − z_max)·w·|w|",
        parameters=(
            ParameterSpec("q", "N·s²/m³", remedy=Remedy.SPEEDS),
            ParameterSpec("z_max", "m", limits=lambda s: (0.05 * s.x_max, s.x_max), remedy=Remedy.STROKE),
            # As of an end stop: 1 in extension alone, −1 in compression.
            ParameterSpec("side", "–", -1.0, high=1.0, default=0.0, refinement=True, bound_is_meant=True),
        ),
        starts=lambda s: [{"q": s.force / (s.v_rms**2 * s.x_max), "z_max": part * s.x_max} for part in (0.65, 0.85)],
        by_position=True,
        alias=Alias("an end stop of rubber with much damping of its own", "move slowly to the end of the stroke"),
    ),
    ElementSpec(
        name="tanh_hysteresis",
        family=Family.DAMPING,
        title="hyperbolic-tangent hysteresis",
        equation="f = (alpha + alpha_control·u)·tanh(beta·w + delta·sgn(z))",
        parameters=(
            ParameterSpec("alpha", "N", remedy=Remedy.SPEEDS),
            ParameterSpec("alpha_control", "N/A", UNBOUNDED, default=0.0, gain=True, remedy=Remedy.CURRENT),
            # As steep as this it is a friction: a friction that fits as well is simpler, but none follows the current.
            ParameterSpec("beta", "s/m", TINY, limits=_slopes, high_is_meant=True, remedy=Remedy.SPEEDS),
            ParameterSpec("delta", "–", bound_is_meant=True, remedy=Remedy.SPEEDS),
            # A measured hysteresis turns over across a displacement z_r; the canonical form does so at one point.
            ParameterSpec("z_r", "m", default=0.0, refinement=True),
        ),
        starts=_tanh_starts,
        by_position=True,
        curve=Curve.WHOLE,
        unlikely=_is_plain,
        mistaken=_never_bends,
        denied=_without_loop,
    ),
    ElementSpec(
        name="eddy_current_damping",
        family=Family.DAMPING,
        title="eddy-current damping (Lorentz-shaped)",
        equation="f = 2·f_peak·(w/w_peak)/(1 + (w/w_peak)²)",
        parameters=(
            ParameterSpec("f_peak", "N", remedy=Remedy.SPEEDS),
            ParameterSpec("w_peak", "m/s", TINY, remedy=Remedy.SPEEDS),
        ),
        nameable=False,  # below its peak it is a saturating curve, which has a name
        curve=Curve.WHOLE,
    ),
    ElementSpec(
        name="shim_stack_damping",
        family=Family.DAMPING,
        title="bleed orifice beside a shim stack and a blow-off",
        equation="|w| = √(|f|/q) + max(0, |f| − f_open)/c_shim + max(0, |f| − f_blow)/c_blow, f of the sign of w",
        parameters=(
            ParameterSpec("q", "N·s²/m²", TINY, remedy=Remedy.SPEEDS),
            ParameterSpec("f_open", "N", remedy=Remedy.SPEEDS),
            ParameterSpec("c_shim", "N·s/m", TINY, remedy=Remedy.SPEEDS),
            ParameterSpec("f_blow", "N", remedy=Remedy.SPEEDS),
            ParameterSpec("c_blow", "N·s/m", TINY, remedy=Remedy.SPEEDS),
        ),
        nameable=False,  # a base: its parts have names of fewer parameters
        curve=Curve.WHOLE,
    ),
)
