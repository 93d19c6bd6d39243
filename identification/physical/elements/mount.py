"""Rows of the mount: elements in series between the rig and the core."""

from __future__ import annotations

from typing import Final

from identification.physical.elements.spec import TINY, UNBOUNDED, ElementSpec, Family, ParameterSpec

ROWS: Final = (
    ElementSpec(
        name="series_compliance",
        family=Family.MOUNT,
        title="series compliance (bush, oil column)",
        equation="f = k·e + c·de/dt, e = x − z",
        parameters=(ParameterSpec("k", "N/m", TINY), ParameterSpec("c", "N·s/m", default=0.0)),
        starts=lambda s: [{"k": s.force / (part * s.x_rms), "c": 0.0} for part in (0.005, 0.03, 0.15)],
    ),
    ElementSpec(
        name="relaxing_compliance",
        family=Family.MOUNT,
        title="spring beside a Maxwell branch (standard linear solid) in series",
        equation="f = k1·e + y, dy/dt = k2·de/dt − (k2/c2)·y, e = x − z",
        parameters=(
            ParameterSpec("k1", "N/m", TINY),
            ParameterSpec("k2", "N/m", TINY),
            ParameterSpec("c2", "N·s/m", TINY),
        ),
        nameable=False,
    ),
    ElementSpec(
        name="series_dashpot",
        family=Family.MOUNT,
        title="dashpot in series",
        equation="f = (c + c_control·u)·de/dt, e = x − z",
        parameters=(
            ParameterSpec("c", "N·s/m", TINY),
            ParameterSpec("c_control", "N·s/(m·A)", UNBOUNDED, default=0.0, gain=True),
        ),
        nameable=False,
    ),
    ElementSpec(
        name="free_play",
        family=Family.MOUNT,
        title="free play in the mount",
        equation="no force while |e| < gap/2, e = x − z",
        parameters=(ParameterSpec("gap", "m"),),
        starts=lambda s: [{"gap": part * s.x_rms} for part in (0.005, 0.03, 0.15)],
    ),
)
