"""Rows of the sensor path: what stands between the force of the core and the recorded one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from identification.criteria import FORM
from identification.physical.elements.spec import (
    UNBOLTED,
    UNBOUNDED,
    WITHOUT_DAMPER,
    Alias,
    ElementSpec,
    Family,
    ParameterSpec,
    Remedy,
    Values,
)

if TYPE_CHECKING:
    from identification.scales import Scales


def _late_starts(s: Scales) -> Sequence[Values]:
    """One channel late; with a current that varies, also the displacement late beside both others."""
    late = {"tau": 0.03 * s.motion_time}
    return [late, {"tau": -late["tau"], "late_motion": 1.0}] if s.current_high > s.current_low else [late]


ROWS: Final = (
    ElementSpec(
        name="force_delay",
        family=Family.SENSOR,
        title="time skew of the force channel",
        equation="F(t) + lag·dF/dt + turn²·d²F/dt² = f(t − tau)",
        parameters=(
            ParameterSpec(
                "tau",
                "s",
                UNBOUNDED,
                limits=lambda s: (-2.0 * s.motion_time, 2.0 * s.motion_time),
                remedy=Remedy.FREQUENCY,
            ),
            # An amplifier's or a recorder's low-pass: late alike, and weaker where the motion is fast.
            ParameterSpec("lag", "s", default=0.0, refinement=True, remedy=Remedy.FREQUENCY),
            # Of two poles: turn² is lag²/3 in Bessel's low-pass and lag²/2 in Butterworth's.
            ParameterSpec("turn", "s", default=0.0, refinement=True, late=True, remedy=Remedy.FREQUENCY),
            # A force is ahead of its motion where the displacement is recorded late; the current need not be late too.
            ParameterSpec(
                "late_motion",
                "–",
                high=1.0,
                constant=0.0,
                default=0.0,
                refinement=True,
                switch="where tau is negative the displacement is late, and the current is not",
            ),
        ),
        starts=_late_starts,
        moves_all=True,
        # Early and late at once is a mere shape; with more turn than lag a low-pass would ring.
        denied=lambda v, others: -v["tau"] > FORM.minor * v["lag"] > 0.0 or v["turn"] > v["lag"],
        unlikely=lambda v, _: v["tau"] < 0.0,  # no damper answers ahead of its motion: its mass does nearly that
        alias=Alias("a skew of the displacement channel", "feed one electrical signal into both channels"),
    ),
    ElementSpec(
        name="force_offset",
        family=Family.SENSOR,
        title="load-cell offset",
        equation="F = f + F0",
        parameters=(ParameterSpec("F0", "N", UNBOUNDED, outside=True),),
        starts=lambda s: [{"F0": s.gap}],
        alias=Alias("the preload of the gas, or a weight on the load cell", UNBOLTED),
    ),
    ElementSpec(
        name="moving_mass",
        family=Family.SENSOR,
        title="mass between load cell and damper",
        equation="F = f + m·a",
        parameters=(ParameterSpec("m", "kg", remedy=Remedy.FREQUENCY),),
        starts=lambda s: [{"m": s.gap / s.a_rms}],
        alias=Alias(
            "the inertia of the load cell and its fixture, or of parts inside the damper; of a viscous damper, a "
            "displacement that was recorded late",
            WITHOUT_DAMPER,
        ),
    ),
    ElementSpec(
        name="parallel_stiffness",
        family=Family.SENSOR,
        title="spring beside damper and mount",
        equation="F = f + k·x",
        parameters=(ParameterSpec("k", "N/m", remedy=Remedy.FREQUENCY),),
        nameable=False,
    ),
    ElementSpec(
        name="force_drift",
        family=Family.SENSOR,
        title="load-cell drift",
        equation="F = f + rate·t",
        parameters=(ParameterSpec("rate", "N/s", UNBOUNDED),),
        starts=lambda s: [{"rate": s.gap / s.duration}],
        alias=Alias("a slow change of the gas pressure", f"{UNBOLTED}, before and after a run"),
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
        tone=True,
        alias=Alias("a vibration of the pump or the frame", "record at rest, with the pump on and off"),
    ),
)
