"""Rows of the motion family: elements of the literature that also look at the rig's motion, or carry bristles."""

from __future__ import annotations

from typing import Final

from identification.physical.elements.spec import TINY, UNBOUNDED, ElementSpec, Family, ParameterSpec, Remedy

ROWS: Final = (
    ElementSpec(
        name="lugre_friction",
        family=Family.MOTION,
        title="LuGre friction",
        equation="f = sigma0·m + sigma1·dm/dt, dm/dt = w − sigma0·|w|·m/g, g = f_c + (f_s − f_c)·exp(−(w/w_s)²)",
        parameters=(
            ParameterSpec("sigma0", "N/m", TINY, remedy=Remedy.FREQUENCY),
            ParameterSpec("sigma1", "N·s/m"),
            ParameterSpec("f_c", "N", TINY, remedy=Remedy.SPEEDS),
            ParameterSpec("f_s", "N", TINY, remedy=Remedy.SPEEDS),
            ParameterSpec("w_s", "m/s", TINY, remedy=Remedy.SPEEDS),
        ),
        memory=True,
        nameable=False,
        dry_friction=True,
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
