"""Force-controlled zero: the displacement at which a mounted specimen carries no load."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign

from rigctl.errors import ProcedureError
from rigctl.procedures.criteria import STEP_M, ZERO_STEPS
from rigctl.procedures.motion import Position, creep, position
from rigctl.procedures.station import Station

FIRST_M = STEP_M / 2
LONGEST_M = 4 * STEP_M  # between two readings
LEAST_N_M = 1.0  # of a stiffness: less is noise


def force_zero(
    station: Station,
    *,
    within_n: float,
    limit_n: float,
    reach_m: float,
    tare_n: float = 0.0,
    should_stop: Callable[[], bool] = lambda: False,
) -> Position:
    """Move slowly until the force at rest is zero, and return where that is.

    Each movement is the secant step −f / k with the stiffness k between the last two readings, and at most twice the
    last one; the first one goes against the force.

    Raises
    ------
    ProcedureError
        When the force does not vanish within the reach; it says by how much it changes. The rig is at rest.
    """
    first = here = position(station, tare_n=tare_n)
    length = FIRST_M / 2
    move = -copysign(FIRST_M, here.force_n)
    for _ in range(ZERO_STEPS):
        if abs(here.force_n) <= within_n or should_stop():
            return here
        target = here.displacement_m + move
        if abs(target - first.displacement_m) > reach_m:
            break
        creep(station, target, limit_n=limit_n, tare_n=tare_n, should_stop=should_stop)
        before, here = here, position(station, tare_n=tare_n)
        length = min(2 * max(length, FIRST_M / 4), LONGEST_M)
        move = _next(before, here, length)
    travelled = here.displacement_m - first.displacement_m
    raise ProcedureError(
        f"no zero of the force within {1e3 * reach_m:g} mm: {first.force_n:.0f} N at "
        f"{1e3 * first.displacement_m:.2f} mm, {here.force_n:.0f} N after {1e3 * travelled:+.2f} mm: "
        "mount it at another length, or keep its gas force"
    )


def _next(before: Position, here: Position, longest_m: float) -> float:
    travel = here.displacement_m - before.displacement_m
    stiffness = (here.force_n - before.force_n) / travel if travel else 0.0
    if stiffness < LEAST_N_M:  # noise: go on against the force
        return -copysign(longest_m, here.force_n)
    return max(min(-here.force_n / stiffness, longest_m), -longest_m)
