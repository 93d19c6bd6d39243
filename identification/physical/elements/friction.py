"""Rows of the friction family: a force over the direction of sliding, or with a memory of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from identification.physical.elements.spec import TINY, UNBOUNDED, ElementSpec, Family, ParameterSpec, Values

if TYPE_CHECKING:
    from identification.scales import Scales

# Measured friction builds up over a velocity w_r; the canonical form jumps.
_BUILD_UP = ParameterSpec("w_r", "m/s", default=0.0, refinement=True)


def _stribeck_starts(s: Scales) -> Sequence[Values]:
    return [{"f_c": 0.7 * s.gap, "f_s": 1.4 * s.gap, "w_s": w} for w in (0.3 * s.speeds[0], s.speeds[0], s.speeds[1])]


def _presliding_starts(s: Scales) -> Sequence[Values]:
    return [{"f_c": s.gap, "sigma": s.gap / (part * s.x_rms)} for part in (0.01, 0.05, 0.25)]


def _bouc_wen_starts(s: Scales) -> Sequence[Values]:
    guesses = []
    for part, n in ((0.02, 1.5), (0.1, 1.5), (0.4, 1.5), (1.6, 1.0)):  # the widest loop never saturates
        h = part * s.x_rms  # the internal displacement at which the force saturates
        guesses.append({"alpha": s.gap / h, "A": 1.0, "n": n, "beta": 0.5 / h**n, "gamma": 0.5 / h**n})
    return guesses


ROWS: Final = (
    ElementSpec(
        name="bouc_wen",
        family=Family.FRICTION,
        title="Bouc–Wen hysteresis",
        equation="f = (alpha + alpha_control·u)·h, dh/dt = A·w − gamma·|w|·h·|h|^(n−1) − beta·w·|h|^n",
        parameters=(
            ParameterSpec("alpha", "N/m"),
            ParameterSpec("A", "–", TINY),
            ParameterSpec("n", "–", 1.0, high=10.0),
            ParameterSpec("beta", "1/m^n", UNBOUNDED),
            ParameterSpec("gamma", "1/m^n"),  # below zero it would make energy out of nothing
            ParameterSpec("alpha_control", "N/(m·A)", UNBOUNDED, default=0.0, refinement=True, gain=True),
        ),
        starts=_bouc_wen_starts,
        memory=True,
        explicit_rate=True,
        linear_in_velocity=True,
    ),
    ElementSpec(
        name="coulomb_friction",
        family=Family.FRICTION,
        title="Coulomb friction",
        equation="f = f_c·sgn(w)",
        parameters=(ParameterSpec("f_c", "N"), _BUILD_UP),
        starts=lambda s: [{"f_c": s.gap}],
        smooth_over="w_r",
    ),
    ElementSpec(
        name="stribeck_friction",
        family=Family.FRICTION,
        title="Stribeck friction",
        equation="f = (f_c + (f_s − f_c)·exp(−(w/w_s)²))·sgn(w)",
        parameters=(ParameterSpec("f_c", "N"), ParameterSpec("f_s", "N"), ParameterSpec("w_s", "m/s", TINY), _BUILD_UP),
        starts=_stribeck_starts,
        smooth_over="w_r",
    ),
    ElementSpec(
        name="presliding_friction",
        family=Family.FRICTION,
        title="presliding friction",
        equation="df/dt = sigma·w·(1 − sgn(w)·f/f_c)",
        parameters=(ParameterSpec("sigma", "N/m", TINY), ParameterSpec("f_c", "N", TINY)),
        starts=_presliding_starts,
        memory=True,
    ),
)
