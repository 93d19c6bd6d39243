"""Rows of the sensor path: what stands between the force of the core and the recorded one."""

from __future__ import annotations

from typing import Final

from identification.physical.elements.spec import UNBOUNDED, ElementSpec, Family, ParameterSpec

ROWS: Final = (
    ElementSpec(
        name="force_delay",
        family=Family.SENSOR,
        title="time skew of the force channel",
        equation="F(t) = f(t − tau)",
        parameters=(ParameterSpec("tau", "s"),),
        starts=lambda s: [{"tau": 0.03 * s.motion_time}],
    ),
    ElementSpec(
        name="force_offset",
        family=Family.SENSOR,
        title="load-cell offset",
        equation="F = f + F0",
        parameters=(ParameterSpec("F0", "N", UNBOUNDED),),
        starts=lambda s: [{"F0": s.gap}],
    ),
    ElementSpec(
        name="moving_mass",
        family=Family.SENSOR,
        title="mass between load cell and damper",
        equation="F = f + m·a",
        parameters=(ParameterSpec("m", "kg"),),
        starts=lambda s: [{"m": s.gap / s.a_rms}],
    ),
    ElementSpec(
        name="parallel_stiffness",
        family=Family.SENSOR,
        title="spring beside damper and mount",
        equation="F = f + k·x",
        parameters=(ParameterSpec("k", "N/m"),),
        nameable=False,
    ),
    ElementSpec(
        name="force_drift",
        family=Family.SENSOR,
        title="load-cell drift",
        equation="F = f + rate·t",
        parameters=(ParameterSpec("rate", "N/s", UNBOUNDED),),
        starts=lambda s: [{"rate": s.gap / s.duration}],
    ),
    ElementSpec(
        name="mains_hum",
        family=Family.SENSOR,
        title="mains hum on the force channel",
        equation="F = f + amplitude·sin(2π·frequency·t + phase)",
        parameters=(
            ParameterSpec("amplitude", "N"),
            ParameterSpec("frequency", "Hz"),
            ParameterSpec("phase", "rad", UNBOUNDED, default=0.0, of_run=True),
        ),
    ),
)
