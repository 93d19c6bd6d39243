"""Rows of the friction family: a force over the direction of sliding, or with a memory of its own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from identification.criteria import CHANCE, FORM
from identification.physical.elements.spec import (
    TINY,
    UNBOUNDED,
    Curve,
    ElementSpec,
    Family,
    Growth,
    ParameterSpec,
    Remedy,
    Surroundings,
    Values,
)

if TYPE_CHECKING:
    from identification.scales import Scales

# Measured friction builds up over a velocity w_r; the canonical form jumps.
_BUILD_UP = ParameterSpec("w_r", "m/s", default=0.0, refinement=True)
# A rod seal, a buffer, the gas behind a rod and a coil spring act between the ends of a damper, also where its oil
# gives way; what is behind a bush moves by less than these.
BESIDE_MOUNT = ParameterSpec(
    "beside_mount", "–", high=1.0, constant=0.0, default=0.0, refinement=True, beside=True,
    switch="it acts between the ends, beside the mount",
)  # fmt: skip
# Of one bristle a small loop within a large one does not close; asperities that give way one after the other close it.
_SLIDERS = ParameterSpec(
    "sliders", "–", high=1.0, constant=0.0, default=0.0, refinement=True,
    switch="sliders that give way one after the other, first those of the shortest travel: every loop closes",
)  # fmt: skip


def _stribeck_starts(s: Scales) -> Sequence[Values]:
    return [{"f_c": 0.7 * s.gap, "f_s": 1.4 * s.gap, "w_s": w} for w in (0.3 * s.speeds[0], s.speeds[0], s.speeds[1])]


def _presliding_starts(s: Scales) -> Sequence[Values]:
    return [{"f_c": s.gap, "sigma": s.gap / (part * s.x_rms)} for part in (0.01, 0.05, 0.25)]


def _stiff_bristles(lugre: Values, _: Scales) -> Sequence[Values]:
    """LuGre friction whose bristles don't bend."""
    return [{name: lugre[name] for name in ("f_c", "f_s", "w_s")}]


def _level_bristles(lugre: Values, _: Scales) -> Sequence[Values]:
    """LuGre friction that does not fall, as high as it is at rest or when it slides."""
    return [{"f_c": lugre[level], "sigma": lugre["sigma0"]} for level in ("f_s", "f_c")]


def _level(friction: Values, _: Scales) -> Sequence[Values]:
    """A friction that is at once as high as another one is where it slides."""
    return [{"f_c": friction["f_c"]}]


def _first_order_loop(bouc_wen: Values, _: Scales) -> Sequence[Values]:
    """Bouc–Wen hysteresis with n = 1 and without beta: at the same stiffness, it saturates at the same force."""
    sigma, n = bouc_wen["alpha"] * bouc_wen["A"], bouc_wen["n"]
    lost = bouc_wen["gamma"] + bouc_wen["beta"]
    if sigma <= 0.0 or lost <= 0.0:
        return []
    return [{"sigma": sigma, "f_c": bouc_wen["alpha"] * float((bouc_wen["A"] / lost) ** (1.0 / n))}]


def _bouc_wen_starts(s: Scales) -> Sequence[Values]:
    guesses = []
    for part, n in ((0.02, 1.5), (0.1, 1.5), (0.4, 1.5), (1.6, 1.0)):  # the widest loop never saturates
        h = part * s.x_rms  # the internal displacement at which the force saturates
        guesses.append({"alpha": s.gap / h, "A": 1.0, "n": n, "beta": 0.5 / h**n, "gamma": 0.5 / h**n})
    return guesses


def _falling_from(coulomb: Values, s: Scales) -> Sequence[Values]:
    """Curves that start as high as a Coulomb friction that fits.

    By itself a Stribeck curve may follow how friction builds up, while the base's own curve takes up how it falls.
    """
    level = coulomb["f_c"]
    return [{"f_c": 0.8 * level, "f_s": 1.1 * level, "w_s": w} for w in s.speeds[:3]]


def _does_not_fall(values: Values, _: Sequence[ElementSpec]) -> bool:
    return values["f_s"] <= (1.0 + FORM.tolerance) * values["f_c"]


def _is_spring_or_dry(values: Values, around: Surroundings) -> bool:
    """Whether the hysteresis all but comes back the way it went, from half the stroke: then it is a spring. Or whether
    it is at its limit at once: then it is a dry friction."""
    lost = values["gamma"] * float((values["A"] * 0.5 * around.stroke) ** values["n"])
    rate = values["gamma"] + values["beta"]
    travel = float((values["A"] / rate) ** (1.0 / values["n"])) if rate > 0.0 else math.inf
    return lost < FORM.loop * values["A"] or travel < CHANCE.visible * around.stroke


def _is_curve(values: Values, around: Surroundings) -> bool:
    """Whether a friction builds up over more than the lowest typical speed: then it is a curve over velocity."""
    return values["w_r"] > around.slow


ROWS: Final = (
    ElementSpec(
        name="bouc_wen",
        family=Family.FRICTION,
        title="Bouc–Wen hysteresis",
        equation="f = (alpha + alpha_control·u)·h, dh/dt = A·w − gamma·|w|·h·|h|^(n−1) − beta·w·|h|^n",
        parameters=(
            ParameterSpec("alpha", "N/m", remedy=Remedy.SPEEDS),
            ParameterSpec("A", "–", TINY, held=True),  # alpha and A only act as a product
            ParameterSpec(
                "n", "–", 1.0, high=10.0, bound_is_meant=True, limits=lambda s: (1.0, 4.0), remedy=Remedy.STROKE
            ),
            ParameterSpec("beta", "1/m^n", UNBOUNDED, remedy=Remedy.SPEEDS),
            # Below zero it would make energy out of nothing.
            ParameterSpec("gamma", "1/m^n", limits=lambda s: (0.0, math.inf), remedy=Remedy.SPEEDS),
            ParameterSpec(
                "alpha_control", "N/(m·A)", UNBOUNDED, default=0.0, refinement=True, gain=True, remedy=Remedy.CURRENT
            ),
        ),
        starts=_bouc_wen_starts,
        memory=True,
        explicit_rate=True,
        linear_in_velocity=True,
        curve=Curve.WHOLE,
        mistaken=_is_spring_or_dry,
    ),
    ElementSpec(
        name="coulomb_friction",
        family=Family.FRICTION,
        title="Coulomb friction",
        equation="f = f_c·sgn(w)",
        parameters=(ParameterSpec("f_c", "N", remedy=Remedy.SPEEDS), _BUILD_UP, BESIDE_MOUNT),
        starts=lambda s: [{"f_c": s.gap}],
        smooth_over="w_r",
        dry_friction=True,
        limits_of=tuple(Growth(of=name, starts=_level) for name in ("presliding_friction", "stribeck_friction")),
        mistaken=_is_curve,
    ),
    ElementSpec(
        name="stribeck_friction",
        family=Family.FRICTION,
        title="Stribeck friction",
        equation="f = (f_c + (f_s − f_c)·exp(−(w/w_s)²))·sgn(w)",
        parameters=(
            ParameterSpec("f_c", "N", remedy=Remedy.SPEEDS),
            ParameterSpec("f_s", "N", remedy=Remedy.SPEEDS),
            ParameterSpec("w_s", "m/s", TINY, limits=lambda s: (0.02 * s.speeds[0], s.speeds[3]), remedy=Remedy.SPEEDS),
            _BUILD_UP,
            BESIDE_MOUNT,
        ),
        starts=_stribeck_starts,
        smooth_over="w_r",
        dry_friction=True,
        falls_with_speed=True,
        growth=Growth(of="coulomb_friction", starts=_falling_from),
        limits_of=(Growth(of="lugre_friction", starts=_stiff_bristles),),
        denied=_does_not_fall,
        mistaken=_is_curve,
    ),
    ElementSpec(
        name="presliding_friction",
        family=Family.FRICTION,
        title="presliding friction",
        equation="df/dt = sigma·w·(1 − sgn(w)·f/f_c)",
        parameters=(
            ParameterSpec(
                "sigma",
                "N/m",
                TINY,
                limits=lambda s: (0.1 * s.gap / s.x_rms, 1e4 * s.force / s.x_rms),
                remedy=Remedy.FREQUENCY,
            ),
            ParameterSpec("f_c", "N", TINY, remedy=Remedy.SPEEDS),
            BESIDE_MOUNT,
            _SLIDERS,
        ),
        starts=_presliding_starts,
        memory=True,
        dry_friction=True,
        limits_of=(
            Growth(of="lugre_friction", starts=_level_bristles),
            Growth(of="bouc_wen", starts=_first_order_loop),
        ),
    ),
    ElementSpec(
        name="frequency_selective_damping",
        family=Family.FRICTION,
        title="frequency-selective damping, soft at high frequency",
        equation="f = c·y, dy/dt = (w − y)/tau",
        parameters=(
            ParameterSpec("c", "N·s/m", remedy=Remedy.SPEEDS),
            ParameterSpec("tau", "s", TINY, remedy=Remedy.FREQUENCY),
        ),
        nameable=False,  # a bush in series does much the same, and has a name
        memory=True,
    ),
)
