"""Rows of the spring family: forces over position that store energy, outside the dissipative sum."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from identification.criteria import CHANCE, FORM
from identification.physical.elements.friction import BESIDE_MOUNT
from identification.physical.elements.spec import (
    TINY,
    UNBOLTED,
    UNBOUNDED,
    WITHOUT_DAMPER,
    Alias,
    ElementSpec,
    Family,
    ParameterSpec,
    Remedy,
    Surroundings,
    Values,
    of_shape,
)

if TYPE_CHECKING:
    from identification.scales import Scales


def _follows_warmth(own: Values, scales: Scales) -> float | None:
    """The pressure of an ideal gas follows the absolute temperature; none where that does not vary."""
    return 1.0 if scales.warmth > FORM.varying_temperature else None


# Share of half the stroke within which a stop of both sides is a spring: a convention, and where its `z_max` ended
# before a stop of one side might begin in the middle. Half and double: so is the travel of a stiff middle that is none.
_MIDDLE = 0.05


def _is_spring(values: Values, around: Surroundings) -> bool:
    """Whether a stop acts on both sides from the middle on. One that acts on one side is a stop from there too."""
    return abs(values["side"]) < 1.0 - FORM.minor and values["z_max"] < _MIDDLE * 0.5 * around.stroke


ROWS: Final = (
    ElementSpec(
        name="linear_stiffness",
        family=Family.SPRING,
        title="linear stiffness",
        equation="f = k·z",
        parameters=(ParameterSpec("k", "N/m", remedy=Remedy.FREQUENCY), BESIDE_MOUNT),
        starts=lambda s: [{"k": s.gap / s.x_rms}],
        linear_in_velocity=True,
        alias=Alias("a hose or a guide of the rig that acts as a spring", WITHOUT_DAMPER),
    ),
    ElementSpec(
        name="cubic_stiffness",
        family=Family.SPRING,
        title="cubic stiffness",
        equation="f = k3·z³/(1 + bend·z²)",
        parameters=(
            ParameterSpec("k3", "N/m³", UNBOUNDED, remedy=Remedy.STROKE),
            # A spring that softens does so towards another stiffness, and not without end.
            of_shape("levels off", "bend", "1/m²", lambda own, s: s.x_max**-2),
            BESIDE_MOUNT,
        ),
        starts=lambda s: [{"k3": s.gap / s.x_rms**3}],
        linear_in_velocity=True,
    ),
    ElementSpec(
        name="gas_spring",
        family=Family.SPRING,
        title="gas spring",
        # y is T/T0·(1 + z/length)^(n − 1): the energy of an ideal gas behind a wall (Els and Grobbelaar 1993).
        equation="f = −f0·(1 + warm·(T − 25)/298.15)·y·(1 + z/length)^(−n), "
        "dy/dt = heat·((1 + z/length)^(n − 1) − y); y = 1 without heat",
        parameters=(
            ParameterSpec("f0", "N", preload=True),
            ParameterSpec("length", "m", TINY, limits=lambda s: (1.02 * s.x_max, 30.0 * s.x_max), remedy=Remedy.STROKE),
            ParameterSpec(
                "n", "–", TINY, high=5.0, bound_is_meant=True, limits=lambda s: (0.5, 3.0), remedy=Remedy.STROKE
            ),
            ParameterSpec("heat", "1/s", default=0.0, refinement=True, remembers=True, remedy=Remedy.FREQUENCY),
            # How the gas came into a run: 0, out of a motion like that of the run; 1, out of rest where the run begins.
            ParameterSpec("rested", "–", high=1.0, default=0.0, refinement=True, bound_is_meant=True),
            # 1 where the pressure of the gas follows the temperature that was recorded, less where it is cooler.
            replace(of_shape("warm", "warm", "–", _follows_warmth, remedy=Remedy.ANY), warms=True),
            BESIDE_MOUNT,
        ),
        starts=lambda s: [{"f0": s.gap, "length": part * s.x_max, "n": 1.3} for part in (2.5, 1.3)],
        linear_in_velocity=True,
        does_both=("force_offset", "linear_stiffness"),
        alias=Alias("for its preload, an offset of the load cell", UNBOLTED),
    ),
    ElementSpec(
        name="warm_gas_spring",
        family=Family.SPRING,
        title="gas spring whose pressure follows the temperature",
        equation="f = −f0·(T + 273.15)/(T_ref + 273.15)·(1 + z/length)^(−n)",
        parameters=(
            ParameterSpec("f0", "N", preload=True, remedy=Remedy.STROKE),
            ParameterSpec("length", "m", TINY, remedy=Remedy.STROKE),
            ParameterSpec("n", "–", TINY, high=5.0, bound_is_meant=True, remedy=Remedy.STROKE),
            ParameterSpec("T_ref", "°C", -273.0, constant=25.0),
        ),
        nameable=False,  # a gas spring has a name, with a `warm`
        linear_in_velocity=True,
        needs_temperature=True,
    ),
    ElementSpec(
        name="end_stop",
        family=Family.SPRING,
        title="end stop",
        equation="f = s·(1 + s·side)·(k·o + k2·o²), o = max(0, |z − centre| − z_max), s = sgn(z − centre)",
        parameters=(
            ParameterSpec("k", "N/m", bound_is_meant=True, remedy=Remedy.FREQUENCY),  # one that hardens may begin soft
            ParameterSpec("z_max", "m", bound_is_meant=True, limits=lambda s: (0.0, s.x_max), remedy=Remedy.STROKE),
            # Of most machines one end has the harder stop, or alone has one: 1 in extension, −1 in compression.
            ParameterSpec("side", "–", -1.0, high=1.0, default=0.0, refinement=True, bound_is_meant=True),
            # Rubber and foam harden as they are pressed: beginning with the whole force at the end of the stroke.
            of_shape(
                "progressive",
                "k2",
                "N/m²",
                lambda own, s: own["k"] / max(s.x_max - own["z_max"], CHANCE.visible * s.x_max),
            ),
            # Built in off the middle, a machine meets one end before the other.
            of_shape("off centre", "centre", "m", lambda own, s: 0.1 * own["z_max"], low=UNBOUNDED),
            BESIDE_MOUNT,
        ),
        mistaken=_is_spring,
        # The last two: a buffer at one end that hardens.
        starts=lambda s: [
            *({"k": s.force / s.x_max, "z_max": part * s.x_max} for part in (0.45, 0.65, 0.85)),
            *(
                {"k": s.gap / s.x_max, "z_max": 0.4 * s.x_max, "side": side, "k2": 3.0 * s.gap / s.x_max**2}
                for side in (1.0, -1.0)
            ),
        ],
        linear_in_velocity=True,
    ),
    ElementSpec(
        name="progressive_stop",
        family=Family.SPRING,
        title="progressive stop on one side",
        equation="f = s·(k·o + k2·o²), o = max(0, s·(z − z_stop)), s = sgn(z_stop)",
        parameters=(
            ParameterSpec("k", "N/m", remedy=Remedy.STROKE),
            ParameterSpec("k2", "N/m²", default=0.0, bound_is_meant=True, remedy=Remedy.STROKE),
            ParameterSpec("z_stop", "m", UNBOUNDED, remedy=Remedy.STROKE),
        ),
        nameable=False,  # an end stop has a name, with a side and a k2
        linear_in_velocity=True,
    ),
)
