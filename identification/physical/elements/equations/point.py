"""What an equation of the core is given, and what it answers."""

from __future__ import annotations

from typing import NamedTuple


class Point(NamedTuple):
    """State and inputs at which a core is evaluated, SI.

    `s` is the sign of sliding, given apart from `w` so that a stick can be asked for; `a` and `v_m` belong to the rig's
    motion.
    """

    z: float
    w: float
    s: float
    u: float
    temperature: float
    a: float
    v_m: float


class Force(NamedTuple):
    """A force with its slopes by z, w, u and by the element's own memory."""

    f: float
    by_z: float
    by_w: float
    by_u: float
    by_memory: float
    jump: float  # height of the step of dry friction at w = 0
    outside: float  # a constant force that is no part of the dissipative sum
