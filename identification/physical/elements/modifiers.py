"""Rows of the modifiers: factors on the dissipative sum."""

from __future__ import annotations

from typing import Final

from identification.physical.elements.spec import TINY, UNBOUNDED, Alias, ElementSpec, Family, ParameterSpec, Remedy

ROWS: Final = (
    ElementSpec(
        name="position_dependent_damping",
        family=Family.MODIFIER,
        title="position-dependent damping",
        equation="dissipative sum × (1 + p·z²)",
        parameters=(ParameterSpec("p", "1/m²", UNBOUNDED, remedy=Remedy.STROKE),),
        starts=lambda s: [{"p": 0.2 / s.x_rms**2}],
        linear_in_velocity=True,
    ),
    ElementSpec(
        name="temperature_fade",
        family=Family.MODIFIER,
        title="temperature fade",
        equation="dissipative sum × exp(−kappa·(T − T_ref))",
        parameters=(ParameterSpec("kappa", "1/K", UNBOUNDED), ParameterSpec("T_ref", "°C", UNBOUNDED, constant=25.0)),
        starts=lambda s: [{"kappa": 0.1 / max(s.warmth, 1.0), "T_ref": 25.0}],
        linear_in_velocity=True,
        needs_temperature=True,
        alias=Alias("a fade with the time under load", "let the damper cool and repeat the first run"),
    ),
    ElementSpec(
        name="reversal_force_lag",
        family=Family.MODIFIER,
        title="force lag after reversal",
        equation="dissipative sum × (1 − exp(−s/length)), s the travel since w last changed its sign",
        parameters=(
            ParameterSpec("length", "m", TINY, limits=lambda s: (1e-6 * s.x_rms, 5.0 * s.x_rms), remedy=Remedy.STROKE),
        ),
        starts=lambda s: [{"length": part * s.x_rms} for part in (0.01, 0.05, 0.2)],
        memory=True,
    ),
)
