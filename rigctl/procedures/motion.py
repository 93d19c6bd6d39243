"""Slow movements under power, in steps, with a look at the force after each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, isfinite

import numpy as np

from rigctl import scaling
from rigctl.errors import LimitError, ProcedureError
from rigctl.procedures.averages import Mean, mean_of
from rigctl.procedures.criteria import SETTLED_S, STEP_M
from rigctl.procedures.rest import read_at_rest
from rigctl.procedures.station import Station

READINGS = 40  # for one force at rest: 0.4 s


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """Where the piston stands, and the force there; the standard uncertainty is that of the reading."""

    displacement_m: float
    force_n: float
    uncertainty_n: float


def creep(
    station: Station,
    to_m: float,
    *,
    limit_n: float,
    tare_n: float = 0.0,
    should_stop: Callable[[], bool] = lambda: False,
) -> None:
    """Move to a displacement at reduced speed, in steps of half a millimetre; stop at rest before the next one.

    Raises
    ------
    LimitError
        When the place is outside the rig's limits; nothing has moved.
    ProcedureError
        When the force reaches the limit; the rig is at rest, under power.
    """
    limits = station.identity.limits
    if not limits.position_min_m <= to_m <= limits.position_max_m:
        raise LimitError(
            f"displacement {to_m:g} m lies outside {limits.position_min_m:g} … {limits.position_max_m:g} m of the rig"
        )
    start = station.axis.status().displacement_m
    if not isfinite(start):
        raise ProcedureError(f"the displacement reads {start} m: nothing was moved, look at its sensor")
    for x in np.linspace(start, to_m, max(ceil(abs(to_m - start) / STEP_M), 1) + 1)[1:]:
        if should_stop():
            return
        status = station.move(float(x), should_stop)
        if not abs(status.force_n - tare_n) <= limit_n:  # the negation catches NaN of a broken sensor too
            raise ProcedureError(
                f"the force is {status.force_n - tare_n:.0f} N at {1e3 * status.displacement_m:.2f} mm, the limit of "
                f"this movement is {limit_n:g} N: the rig stands still there"
            )


def position(station: Station, *, tare_n: float = 0.0) -> Position:
    """Read displacement and force at rest."""
    station.clock.sleep(SETTLED_S)
    rest = read_at_rest(station.axis, station.clock, READINGS)
    force: Mean = mean_of(rest.force_n, resolution=scaling.FORCE_N)
    return Position(
        displacement_m=float(np.mean(rest.displacement_m)),
        force_n=force.value - tare_n,
        uncertainty_n=force.uncertainty,
    )
