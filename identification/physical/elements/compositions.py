"""Compositions of elements: the damper models of the literature, and one without a force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

Rows = Sequence[tuple[str, Mapping[str, float]]]

_SPRING: Rows = [("linear_stiffness", {"k": 1e3}), ("force_offset", {"F0": 0.0})]

LITERATURE: Final[Mapping[str, Rows]] = {
    # The least that a damper may be: F = c v.
    "linear dashpot": [("viscous_damping", {"c": 1e3})],
    # Stanway, Sproston & Stevens 1987: F = f_c sgn(v) + c0 v + f0.
    "Bingham": [("viscous_damping", {"c": 1e3}), ("coulomb_friction", {"f_c": 100.0}), _SPRING[1]],
    # Wen 1976: F = alpha h + c0 v + k0 x + f0; A = 1, since alpha and A only act as a product.
    "Bouc–Wen": [
        ("viscous_damping", {"c": 1e3}),
        ("bouc_wen", {"alpha": 1e5, "A": 1.0, "n": 2.0, "beta": 1e5, "gamma": 1e5}),
        *_SPRING,
    ],
    # Spencer, Dyke, Sain & Carlson 1997: c1 dy/dt = alpha h + k0 (x − y) + c0 (v − dy/dt); F = c1 dy/dt + k1 (x − x0).
    "modified Bouc–Wen": [
        ("series_dashpot", {"c": 1e4}),
        ("viscous_damping", {"c": 1e3}),
        ("bouc_wen", {"alpha": 1e5, "A": 1.0, "n": 2.0, "beta": 1e5, "gamma": 1e5}),
        ("linear_stiffness", {"k": 1e3}),
        ("parallel_stiffness", {"k": 1e2}),
        ("force_offset", {"F0": 0.0}),
    ],
    # Kwok, Ha, Nguyen, Li & Samali 2006: F = c v + k x + alpha tanh(beta v + delta sgn x) + f0.
    "hyperbolic tangent": [
        ("viscous_damping", {"c": 1e3}),
        ("tanh_hysteresis", {"alpha": 300.0, "beta": 40.0, "delta": 0.3}),
        *_SPRING,
    ],
    # The same with alpha, beta, delta and c0 as functions of current and v_m = sqrt(v² − a x): 13 parameters, of which
    # one (alpha5) is a matter of scale: alpha is the product of a line in the current and a parabola in v_m.
    "modified hyperbolic tangent": [
        ("viscous_damping", {"c": 1e3, "c_control": 0.0}),
        (
            "modulated_tanh_hysteresis",
            {
                "alpha1": 0.0,
                "alpha2": 1.0,
                "alpha3": 0.0,
                "alpha4": 0.0,
                "alpha5": 300.0,
                "beta1": 20.0,
                "beta2": -0.3,
                "delta1": 0.0,
                "delta2": 0.3,
            },
        ),
        *_SPRING,
    ],
    # Snyder, Kamath & Wereley 2001: F = c_po v ± f_y beyond yield, c_pr (v ∓ v_0) before it, by the sign of dv/dt.
    "nonlinear hysteretic biviscous": [
        ("hysteretic_biviscous", {"c_po": 1e3, "c_pr": 2e4, "f_y": 300.0, "v_0": 0.01}),
        _SPRING[1],
    ],
    # Ma, Rakheja & Su 2007: F = F_t (1 − e^(−alpha y))/(1 + e^(−alpha y)) (1 + k_v |v|), y = v − v_h sgn(a). Here
    # v_h is the share h of v_m; the sum of exponentials is a hyperbolic tangent of half the argument.
    "generalised sigmoid": [
        ("sigmoid_hysteresis", {"F_t": 300.0, "alpha": 80.0, "h": 0.1, "k_v": 1.0}),
        *_SPRING,
    ],
    # A spring beside a Maxwell branch in series with a saturating dashpot: F = k1 (x − x1) + k2 (x − x2) = Fc1(dx1/dt),
    # k2 (x − x2) = c2 (dx2/dt − dx1/dt), Fc1(v) = (2/π) F1 arctan(S v) + d v + F2.
    "enriched Maxwell": [
        ("relaxing_compliance", {"k1": 1e6, "k2": 1e6, "c2": 1e4}),
        ("arctan_damping", {"F1": 300.0, "S": 60.0, "d": 1e3, "F2": 0.0}),
    ],
    # A piecewise-linear dashpot with a rubber bush in series.
    "piecewise linear with bush": [
        ("series_compliance", {"k": 1e6, "c": 0.0}),
        ("piecewise_linear_damping", {"c1": 5e3, "c2": 5e2, "f_r": 300.0}),
    ],
    # Canudas de Wit, Olsson, Åström & Lischinsky 1995: F = sigma0 m + sigma1 dm/dt + sigma2 v.
    "LuGre": [
        ("viscous_damping", {"c": 1e3}),
        ("lugre_friction", {"sigma0": 1e5, "sigma1": 10.0, "f_c": 200.0, "f_s": 250.0, "w_s": 0.01}),
        *_SPRING,
    ],
}
"""Every model of the literature by its name: its elements, with start values for a damper of some hundred newton."""

HELD: Final[Mapping[str, Sequence[str]]] = {"piecewise linear with bush": ("series_compliance.c",)}
"""What a model of the literature holds beside what its elements always do, as `element.parameter`."""


def yielding(c: float, alpha: float, beta: float, k: float, offset: float, gains: Mapping[str, float]) -> Rows:
    """A damper that yields: viscous damping, a hysteresis of tanh form, a stiffness and an offset.

    `gains` are slopes over the current: `c` of the damping and `alpha` of the yield force; empty without a current.
    """
    damping, hysteresis = {"c": c}, {"alpha": alpha, "beta": beta, "delta": 0.3}
    if gains:
        damping["c_control"], hysteresis["alpha_control"] = gains["c"], gains["alpha"]
    return [
        ("viscous_damping", damping),
        ("tanh_hysteresis", hysteresis),
        ("linear_stiffness", {"k": k}),
        ("force_offset", {"F0": offset}),
    ]


NO_FORCE: Final[Rows] = [("viscous_damping", {"c": 0.0})]
"""What stands in the place of a model where another program has simulated the force."""
