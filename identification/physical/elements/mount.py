"""Rows of the mount: elements in series between the rig and the core."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from identification.criteria import FORM
from identification.physical.elements.spec import (
    TINY,
    UNBOUNDED,
    Alias,
    Departure,
    ElementSpec,
    Family,
    Growth,
    ParameterSpec,
    Remedy,
    Surroundings,
    Values,
    of_shape,
)

if TYPE_CHECKING:
    from identification.scales import Scales

RIGID_STIFFNESS: Final = 3e7
"""Contact stiffness that free play meets when no bush stands beside it, N/m."""
RIGID_DAMPING: Final = 3e3
"""Its damping, N·s/m."""

_BAR = "put a rigid bar in the place of the damper: what yields then is the rig's"


def _as_stiff_as_steel(compliance: Values, _: Values) -> bool:
    return compliance["k"] > FORM.contact * RIGID_STIFFNESS


def _half_as_stiff(own: Values, _: Scales) -> float:
    return 0.5 * own["k"]


def _has_two_branches(own: Values, others: Sequence[ElementSpec]) -> bool:
    """Whether what stands beside the spring both relaxes and rubs, or does so beyond a gap or behind air: the loops
    know one of these at a time."""
    more = [own["k2"] > 0.0, own["f_slip"] > 0.0]
    return sum(more) > 1 or (any(more) and any(o.path == "mount" for o in others))


def _gives_way(values: Values, around: Surroundings) -> bool:
    """Whether a joint without a bush gives way in its contact by many times its play: that is a compliance."""
    bushed = any(o.name == "series_compliance" for o in around.others)
    return not bushed and values["gap"] < FORM.play * around.force / RIGID_STIFFNESS


def _is_joint_or_spring(values: Values, around: Surroundings) -> bool:
    """Whether the air is hardly compressed by the forces measured, on the side that yields more too, is gone before
    they are there, or stands beside a play: then it is how the halves of that joint meet."""
    beside_play = any(o.name == "free_play" for o in around.others)
    hardly = values["f_half"] * (1.0 - abs(values["side"])) >= FORM.disproportionate * around.force
    return beside_play or hardly or values["f_half"] <= FORM.gone * around.force


def _is_nearly_play(values: Values, around: Surroundings) -> bool:
    """Whether the air is gone at forces far below those measured: a joint whose halves meet softly does nearly that."""
    return values["f_half"] <= FORM.play * around.force


def _little_force(air: Values, _: Scales) -> Sequence[Values]:
    """What air is to forces far below those that compress it by half."""
    return [{"k": 2.0 * air["f_half"] / max(air["air"], TINY), "c": 0.0}]


def _much_force(air: Values, _: Scales) -> Sequence[Values]:
    """What air is to forces far beyond: a play, met at once or half of the way softly; nearly half, as more is air."""
    half = 0.5 * air["air"]
    return [{"gap": air["air"]}, {"gap": half, "soft": 0.9 * half, "f_soft": air["f_half"]}]


ROWS: Final = (
    ElementSpec(
        name="series_compliance",
        family=Family.MOUNT,
        title="series compliance (bush, oil column)",
        equation="f = k·e + c·de/dt + y, e = x − z; dy/dt = k2·de/dt − (k2/c2)·y, or that of a rubber bush",
        parameters=(
            ParameterSpec(
                "k",
                "N/m",
                TINY,
                limits=lambda s: (0.2 * s.force / s.x_rms, 1e5 * s.force / s.x_rms),
                remedy=Remedy.FREQUENCY,
                place="k",
            ),
            ParameterSpec("c", "N·s/m", default=0.0, bound_is_meant=True, remedy=Remedy.SPEEDS, place="c"),
            # What rubber does beside that: a part of its force relaxes (Zener), or rubs in it (Berg 1998).
            of_shape("relaxes", "k2", "N/m", _half_as_stiff, place="k2", remedy=Remedy.FREQUENCY),
            of_shape(
                "relaxes",
                "c2",
                "N·s/m",
                lambda own, s: _half_as_stiff(own, s) * s.motion_time,
                low=TINY,
                neutral=1.0,
                place="c2",
                remedy=Remedy.SPEEDS,
            ),
            of_shape("rubs", "k_slip", "N/m", _half_as_stiff, low=TINY, neutral=1.0, place="k_slip"),
            of_shape("rubs", "f_slip", "N", lambda own, s: FORM.minor * s.force, place="f_slip"),
        ),
        starts=lambda s: [{"k": s.force / (part * s.x_rms), "c": 0.0} for part in (0.005, 0.03, 0.15)],
        denied=_has_two_branches,
        once=True,
        limits_of=(Growth(of="aerated_oil", starts=_little_force),),
        alias=Alias("a frame or a fixture that yields", _BAR),
        departure=Departure(
            of={"free_play": FORM.seat, "aerated_oil": 1.0},  # the oil yields too, by any share of what its air does
            is_only=_as_stiff_as_steel,
            words=lambda v: f"what gives way beside it, such as the oil or the halves of a joint, has {v['k']:.3g} N/m",
        ),
    ),
    ElementSpec(
        name="relaxing_compliance",
        family=Family.MOUNT,
        title="spring beside a Maxwell branch (standard linear solid) in series",
        equation="f = k1·e + y, dy/dt = k2·de/dt − (k2/c2)·y, e = x − z",
        parameters=(
            ParameterSpec("k1", "N/m", TINY, place="k", remedy=Remedy.FREQUENCY),
            ParameterSpec("k2", "N/m", TINY, place="k2", remedy=Remedy.FREQUENCY),
            ParameterSpec("c2", "N·s/m", TINY, place="c2", remedy=Remedy.SPEEDS),
        ),
        nameable=False,
        alone=True,
    ),
    # Elastic and friction force side by side as in Berg's rubber spring (1998), whose friction also begins with one
    # stiffness at a reversal and tends to a highest force; here by the equation of `presliding_friction`, which needs
    # one memory where Berg's needs the force and the place of the last reversal.
    ElementSpec(
        name="rubber_bush",
        family=Family.MOUNT,
        title="rubber bush whose stiffness and loss follow the amplitude",
        equation="f = k·e + c·de/dt + y, dy/dt = k_slip·de/dt·(1 − sgn(de/dt)·y/f_slip), e = x − z",
        parameters=(
            ParameterSpec("k", "N/m", TINY, place="k", remedy=Remedy.FREQUENCY),
            ParameterSpec("c", "N·s/m", default=0.0, bound_is_meant=True, place="c", remedy=Remedy.SPEEDS),
            ParameterSpec("k_slip", "N/m", TINY, place="k_slip", remedy=Remedy.STROKE),
            ParameterSpec("f_slip", "N", TINY, place="f_slip", remedy=Remedy.STROKE),
        ),
        nameable=False,  # it has two parameters more than a series compliance, which has a name
        alone=True,
    ),
    ElementSpec(
        name="series_dashpot",
        family=Family.MOUNT,
        title="dashpot in series",
        equation="f = (c + c_control·u)·de/dt, e = x − z",
        parameters=(
            ParameterSpec("c", "N·s/m", TINY, place="c", remedy=Remedy.SPEEDS),
            ParameterSpec(
                "c_control", "N·s/(m·A)", UNBOUNDED, default=0.0, gain=True, place="c_control", remedy=Remedy.CURRENT
            ),
        ),
        nameable=False,
        alone=True,
    ),
    ElementSpec(
        name="free_play",
        family=Family.MOUNT,
        title="free play in the mount",
        equation="e = (gap/2)·sgn(f) + (soft/2)·f/(f_soft + |f|) + the spring's, e = x − z; no force within the gap",
        parameters=(
            ParameterSpec(
                "gap", "m", place="gap", limits=lambda s: (1e-5 * s.x_rms, 2.0 * s.x_rms), remedy=Remedy.STROKE
            ),
            # The halves of a joint meet bit by bit: film, roughness and rubber before metal. Beside free air, which
            # does the same, it is the air that says how.
            ParameterSpec("soft", "m", default=0.0, refinement=True, late=True, place="soft", remedy=Remedy.STROKE),
            ParameterSpec(
                "f_soft", "N", TINY, default=1.0, refinement=True, late=True, place="f_soft", remedy=Remedy.SPEEDS
            ),
        ),
        starts=lambda s: [{"gap": part * s.x_rms} for part in (0.005, 0.03, 0.15)],
        once=True,
        limits_of=(Growth(of="aerated_oil", starts=_much_force),),
        alias=Alias("play in the rig's own joints", _BAR),
        denied=lambda own, _: own["soft"] > own["gap"],  # it is air then
        mistaken=_gives_way,
    ),
    ElementSpec(
        name="aerated_oil",
        family=Family.MOUNT,
        title="free air in the oil",
        equation="e = (air/2)/s·f/(f_half·s + |f|) + the spring's, s = 1 + side·sgn(f), e = x − z",
        parameters=(
            ParameterSpec("air", "m", place="air", remedy=Remedy.STROKE),
            ParameterSpec(
                "f_half",
                "N",
                TINY,
                place="f_half",
                limits=lambda s: (1e-3 * s.force, 10.0 * s.force),
                remedy=Remedy.SPEEDS,
            ),
            # A piston rod takes its area from one side: rebound presses with another area than compression.
            ParameterSpec("side", "–", -0.95, 0.95, default=0.0, refinement=True, place="side", remedy=Remedy.SPEEDS),
        ),
        # The last three: much air, a soft spring nearly, under even areas and under areas of 4 to 1 either way.
        starts=lambda s: [
            {"air": part * s.x_rms, "f_half": share * s.force, "side": side}
            for part, share, side in (
                (0.01, 0.2, 0.0),
                (0.05, 0.2, 0.0),
                (0.05, 0.5, 0.0),
                (0.6, 2.0, 0.0),
                (0.6, 2.0, 0.6),
                (0.6, 2.0, -0.6),
            )
        ],
        once=True,
        finer_of=("free_play",),
        mistaken=_is_joint_or_spring,
        unlikely=_is_nearly_play,
    ),
)
