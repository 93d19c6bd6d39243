"""Mounting and removal of a specimen: the hands are at the rig only while it has no power."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rigctl.clock import Clock
from rigctl.errors import LimitError, ProcedureError
from rigctl.operator_acts import look
from rigctl.preparation import Tare
from rigctl.procedures.criteria import MOUNTING_FORCE_SHARE, ZERO_SHARE
from rigctl.procedures.force_zero import force_zero
from rigctl.procedures.motion import Position, creep, position
from rigctl.procedures.operator import Operator
from rigctl.procedures.station import Station, commanded, powered
from rigctl.procedures.tare import TareSettings, tare
from rigctl.transport import Transport

BY_HAND = "This rig has no low pressure that a program can choose: set the supply to low pressure by hand. "
CLEAR = "The rig is now moved at reduced speed{}: is everybody clear of it?"


@dataclass(frozen=True, slots=True, kw_only=True)
class MountingSettings:
    """Where the specimen is mounted, and the forces that are allowed meanwhile."""

    at_m: float = 0.0  # displacement at which the specimen is attached
    reach_m: float = 0.02  # largest movement of the force-controlled zero
    limit_n: float | None = None  # default: a share of the rig's force limit
    within_n: float | None = None
    tare: TareSettings | None = None  # before the specimen is attached; None: no tare

    def __post_init__(self) -> None:
        if not 0 < self.reach_m < 1:
            raise LimitError(f"mounting: reach is {self.reach_m} m: it must lie above 0 and below 1")
        for name in ("limit_n", "within_n"):
            value = getattr(self, name)
            if value is not None and not 0 < value < float("inf"):
                raise LimitError(f"mounting: {name} is {value}: it must be positive")


@dataclass(frozen=True, slots=True, kw_only=True)
class Mounted:
    """A specimen in the rig: where the force is zero, and the tare from before it was attached."""

    zero: Position
    tare: Tare | None


def mount(
    transport: Transport,
    clock: Clock,
    operator: Operator,
    settings: MountingSettings | None = None,
    *,
    should_stop: Callable[[], bool] = lambda: False,
) -> Mounted:
    """Tare, travel to the place of mounting, let the person attach the specimen, and find the zero of the force.

    Raises
    ------
    Declined
        When the person did not confirm: the rig has no power.
    ProcedureError
        When a step was refused: the rig has no power.
    """
    settings = settings or MountingSettings()
    measured = None
    if settings.tare is not None:
        operator.confirm("Is nothing attached to the load cell but the fixture?")
        with commanded(transport, clock) as station:
            measured = tare(station.axis, clock, station.identity, settings.tare)
    tare_n = 0.0 if measured is None else measured.offset_n
    operator.confirm(_low_pressure(transport, clock))
    with powered(transport, clock) as station:
        creep(station, settings.at_m, limit_n=_limit_n(station, settings), tare_n=tare_n, should_stop=should_stop)
    operator.confirm("The rig has no power. Attach the specimen, then stand clear: is it attached and everybody clear?")
    with powered(transport, clock) as station:
        zero = _zero(station, settings, tare_n, should_stop)
    return Mounted(zero=zero, tare=measured)


def remove(
    transport: Transport,
    clock: Clock,
    operator: Operator,
    settings: MountingSettings | None = None,
    *,
    tare_n: float = 0.0,
    should_stop: Callable[[], bool] = lambda: False,
) -> Position:
    """Relieve the specimen, switch the power off, and let the person detach it; return where that was.

    Where the force does not vanish (a gas spring) the person is told what remains, and decides.
    """
    settings = settings or MountingSettings()
    operator.confirm(_low_pressure(transport, clock))
    with powered(transport, clock) as station:
        try:
            here = _zero(station, settings, tare_n, should_stop)
        except ProcedureError:
            here = position(station, tare_n=tare_n)
    left = f"The specimen carries {here.force_n:.0f} N ± {2 * here.uncertainty_n:.0f} N."
    operator.confirm(f"The rig has no power. {left} Detach it: is it out?")
    return here


def jog(
    transport: Transport,
    clock: Clock,
    *,
    to_m: float | None = None,
    by_m: float = 0.0,
    limit_n: float | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> Position:
    """Move slowly to a displacement, or by one, and switch the power off; return where the piston stands."""
    with powered(transport, clock) as station:
        target = station.axis.status().displacement_m + by_m if to_m is None else to_m
        settings = MountingSettings(limit_n=limit_n)
        creep(station, target, limit_n=_limit_n(station, settings), should_stop=should_stop)
        return position(station)


def _low_pressure(transport: Transport, clock: Clock) -> str:
    """What to ask before the first movement: whether low pressure is the rig's own, or set by hand."""
    low = look(transport, clock)[0].low_pressure
    if low is None:
        return BY_HAND + CLEAR.format("")
    return CLEAR.format(f" and low pressure, at most {1e3 * low.velocity_m_s:g} mm/s and {low.force_n:g} N")


def _zero(station: Station, settings: MountingSettings, tare_n: float, should_stop: Callable[[], bool]) -> Position:
    return force_zero(
        station,
        within_n=settings.within_n or ZERO_SHARE * station.identity.limits.force_n,
        limit_n=_limit_n(station, settings),
        reach_m=settings.reach_m,
        tare_n=tare_n,
        should_stop=should_stop,
    )


def _limit_n(station: Station, settings: MountingSettings) -> float:
    machine = MOUNTING_FORCE_SHARE * station.identity.limits.force_n
    return machine if settings.limit_n is None else min(settings.limit_n, machine)
