"""Rows of the motion family: elements of the literature that also look at the rig's motion, or carry bristles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from identification.criteria import FORM
from identification.physical.elements.friction import BESIDE_MOUNT
from identification.physical.elements.spec import (
    TINY,
    UNBOUNDED,
    ElementSpec,
    Family,
    Growth,
    ParameterSpec,
    Remedy,
    Values,
)

if TYPE_CHECKING:
    from identification.scales import Scales


def _lugre_starts(s: Scales) -> Sequence[Values]:
    return [
        {"f_c": 0.7 * s.gap, "f_s": 1.4 * s.gap, "w_s": w, "sigma0": s.gap / (part * s.x_rms), "sigma1": 0.0}
        for part, w in ((0.01, 0.3 * s.speeds[0]), (0.01, s.speeds[0]), (0.05, s.speeds[1]))
    ]


def _falling_from(presliding: Values, s: Scales) -> Sequence[Values]:
    """Curves that start as high as a presliding friction that fits, and build up over the same travel."""
    level = {"f_c": 0.8 * presliding["f_c"], "f_s": 1.1 * presliding["f_c"]}
    return [{**level, "sigma0": presliding["sigma"], "sigma1": 0.0, "w_s": w} for w in s.speeds[:3]]


def _does_not_fall(values: Values, _: object) -> bool:
    return values["f_s"] <= (1.0 + FORM.tolerance) * values["f_c"]


ROWS: Final = (
    ElementSpec(
        name="lugre_friction",
        family=Family.MOTION,
        title="LuGre friction",
        equation="f = sigma0·m + sigma1·dm/dt, dm/dt = w − sigma0·|w|·m/g, g = f_c + (f_s − f_c)·exp(−(w/w_s)²)",
        parameters=(
            ParameterSpec(
                "sigma0",
                "N/m",
                TINY,
                limits=lambda s: (0.1 * s.gap / s.x_rms, 1e4 * s.force / s.x_rms),
                remedy=Remedy.FREQUENCY,
            ),
            ParameterSpec("sigma1", "N·s/m", held=True),  # a dashpot in parallel, but while bristles bend
            ParameterSpec("f_c", "N", TINY, remedy=Remedy.SPEEDS),
            ParameterSpec("f_s", "N", TINY, remedy=Remedy.SPEEDS),
            ParameterSpec("w_s", "m/s", TINY, limits=lambda s: (0.02 * s.speeds[0], s.speeds[3]), remedy=Remedy.SPEEDS),
            BESIDE_MOUNT,
        ),
        starts=_lugre_starts,
        memory=True,
        dry_friction=True,
        growth=Growth(of="presliding_friction", starts=_falling_from),
        denied=_does_not_fall,
    ),
    ElementSpec(
        name="modulated_tanh_hysteresis",
        family=Family.MOTION,
        title="hyperbolic-tangent hysteresis that follows current and motion",
        equation="f = (alpha1·u + alpha2)·(alpha3·v_m² + alpha4·v_m + alpha5)"
        "·tanh(beta1·v_m^beta2·w + (delta1·u + delta2)·sgn(z))",
        parameters=(
            ParameterSpec("alpha1", "1/A", UNBOUNDED, gain=True, remedy=Remedy.CURRENT),
            ParameterSpec("alpha2", "–", UNBOUNDED, held=True, remedy=Remedy.CURRENT),
            ParameterSpec("alpha3", "N·s²/m²", UNBOUNDED),
            ParameterSpec("alpha4", "N·s/m", UNBOUNDED),
            ParameterSpec("alpha5", "N", UNBOUNDED),
            ParameterSpec("beta1", "(s/m)^(1+beta2)", TINY),
            ParameterSpec("beta2", "–", -3.0, high=3.0),
            ParameterSpec("delta1", "1/A", UNBOUNDED, gain=True, remedy=Remedy.CURRENT),
            ParameterSpec("delta2", "–", UNBOUNDED),
        ),
        nameable=False,
        needs_amplitude=True,
    ),
    ElementSpec(
        name="hysteretic_biviscous",
        family=Family.MOTION,
        title="hysteretic biviscous damping",
        equation="f = c_pr·(w − v_0·sgn(a)), held within c_po·w ± (f_y + f_y_control·u)",
        parameters=(
            ParameterSpec("c_po", "N·s/m"),
            ParameterSpec("c_pr", "N·s/m", TINY),
            ParameterSpec("f_y", "N"),
            ParameterSpec("f_y_control", "N/A", UNBOUNDED, default=0.0, gain=True),
            ParameterSpec("v_0", "m/s"),
        ),
        nameable=False,
    ),
    ElementSpec(
        name="sigmoid_hysteresis",
        family=Family.MOTION,
        title="generalised sigmoid hysteresis",
        equation="f = (F_t + F_t_control·u)·tanh(alpha·(w − h·v_m·sgn(a))/2)·(1 + k_v·|w|)",
        parameters=(
            ParameterSpec("F_t", "N"),
            ParameterSpec("F_t_control", "N/A", UNBOUNDED, default=0.0, gain=True),
            ParameterSpec("alpha", "s/m", TINY, remedy=Remedy.SPEEDS),
            ParameterSpec("h", "–"),
            ParameterSpec("k_v", "s/m"),
        ),
        nameable=False,
        needs_amplitude=True,
    ),
)
