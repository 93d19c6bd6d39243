"""Rows of the modifiers: factors on the dissipative sum."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from identification.physical.elements.spec import (
    TINY,
    UNBOUNDED,
    Alias,
    ElementSpec,
    Family,
    ParameterSpec,
    Remedy,
    of_shape,
)

ROWS: Final = (
    ElementSpec(
        name="position_dependent_damping",
        family=Family.MODIFIER,
        title="position-dependent damping",
        equation="dissipative sum × (1 + p·z² + gain·½·(tanh((z − z_0 + half)/edge) − tanh((z − z_0 − half)/edge)))",
        parameters=(
            ParameterSpec("p", "1/m²", UNBOUNDED, remedy=Remedy.STROKE),
            # A zone of its own, as a groove or a bypass has: it need not lie in the middle.
            replace(of_shape("zone", "gain", "–", lambda own, s: 0.2, low=-1.0), signed=True),
            of_shape("zone", "z_0", "m", lambda own, s: 0.0, low=UNBOUNDED),
            of_shape("zone", "half", "m", lambda own, s: 0.6 * s.x_rms),
            of_shape("zone", "edge", "m", lambda own, s: 0.3 * s.x_rms, low=TINY, neutral=1.0),
        ),
        # Over the whole stroke; in a zone in the middle or to one side, narrow or wide.
        starts=lambda s: [
            {"p": 0.2 / s.x_rms**2},
            *(
                {"p": 0.0, "gain": 0.5, "z_0": side * s.x_rms, "half": half * s.x_rms, "edge": 0.3 * s.x_rms}
                for side, half in ((0.0, 0.6), (1.0, 0.6), (-1.0, 0.6), (1.5, 1.2), (-1.5, 1.2))
            ),
        ],
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
    ElementSpec(
        name="zone_damping",
        family=Family.MODIFIER,
        title="damping with a zone of position of its own",
        equation="dissipative sum × (1 + gain·½·(tanh((z − z_0 + half)/edge) − tanh((z − z_0 − half)/edge)))",
        parameters=(
            ParameterSpec("gain", "–", -1.0, remedy=Remedy.STROKE),
            ParameterSpec("z_0", "m", UNBOUNDED, remedy=Remedy.STROKE),
            ParameterSpec("half", "m", remedy=Remedy.STROKE),
            ParameterSpec("edge", "m", TINY, remedy=Remedy.STROKE),
        ),
        nameable=False,  # damping over position has a name, and a zone as its finer shape
        linear_in_velocity=True,
    ),
    # Where the oil behind the piston comes down to its vapour pressure the pressure difference grows no further as the
    # valves would have it (Segel & Lang 1981; Duym 2000 on automotive dampers): from an onset speed on, on the side
    # of the starved chamber, the force lags behind its curve. The power law is a form of this project: with m = 1 a
    # linear damper stays at the force of the onset, with m below 1 it still grows, above 1 it falls.
    ElementSpec(
        name="cavitation",
        family=Family.MODIFIER,
        title="cavitation from a speed on, on one side",
        equation="dissipative sum × min(1, (w_on/|w|)^m) where w has the sign of w_on",
        parameters=(
            ParameterSpec("w_on", "m/s", UNBOUNDED, remedy=Remedy.SPEEDS),
            ParameterSpec("m", "–", default=1.0, remedy=Remedy.SPEEDS),
        ),
        nameable=False,  # a curve that bends on one side has names
    ),
)
