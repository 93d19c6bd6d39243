"""Tare: the reading of the load cell without load, refused where it cannot be one."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from rigctl import scaling
from rigctl.axis import Axis
from rigctl.clock import Clock
from rigctl.errors import ProcedureError
from rigctl.preparation import Tare
from rigctl.procedures.averages import mean_of
from rigctl.procedures.criteria import TARE_AGE_S, TARE_NOISE_SHARE, TARE_SHARE
from rigctl.procedures.rest import read_at_rest
from rigctl.transport import Identity

READINGS = 200  # at 100 readings a second: two seconds, 100 periods of mains


@dataclass(frozen=True, slots=True, kw_only=True)
class TareSettings:
    """How long to read, and what is refused."""

    readings: int = READINGS
    limit_n: float | None = None  # default: a share of the rig's force limit

    def __post_init__(self) -> None:
        if not 20 <= self.readings <= 100_000:
            raise ProcedureError(f"tare: readings is {self.readings}: it must lie in 20 … 100000")
        if self.limit_n is not None and not 0 < self.limit_n < float("inf"):
            raise ProcedureError(f"tare: limit is {self.limit_n} N: it must be positive")


def rig_name(identity: Identity) -> str:
    """Vendor, model and serial number: what a tare belongs to."""
    return f"{identity.vendor} {identity.model} {identity.serial}"


def tare(axis: Axis, clock: Clock, identity: Identity, settings: TareSettings | None = None) -> Tare:
    """Read the load cell at rest and return the mean with its uncertainty. Moves nothing.

    Raises
    ------
    ProcedureError
        When the piston moves, the force is not steady, or its mean is beyond what a tare may be.
    RigError
        As :func:`rigctl.procedures.rest.read_at_rest` does.
    """
    settings = settings or TareSettings()
    limit = settings.limit_n or TARE_SHARE * identity.limits.force_n
    rest = read_at_rest(axis, clock, settings.readings)
    mean = mean_of(rest.force_n, resolution=scaling.FORCE_N)
    if abs(mean.value) > limit:
        raise ProcedureError(
            f"the load cell reads {mean.value:.1f} N, a tare may be {limit:g} N at most: "
            "detach the specimen, or have the cell checked"
        )
    if mean.uncertainty > TARE_NOISE_SHARE * limit:
        raise ProcedureError(
            f"the force at rest is not steady: the tare would be uncertain by {mean.uncertainty:.2g} N "
            f"(standard deviation {mean.standard_deviation:.2g} N), {TARE_NOISE_SHARE * limit:.2g} N are allowed"
        )
    return Tare(
        rig=rig_name(identity),
        measured_at=datetime.now(UTC).isoformat(timespec="seconds"),
        offset_n=mean.value,
        standard_deviation_n=mean.standard_deviation,
        uncertainty_n=mean.uncertainty,
        readings=rest.force_n.size,
        window_s=rest.window_s,
        limit_n=limit,
        displacement_m=float(np.mean(rest.displacement_m)),
        temperature_degc=float(np.mean(rest.temperature_degc)),
    )


def check_tare(stored: Tare, identity: Identity, now: datetime) -> None:
    """Raise ProcedureError, one line, where a stored tare belongs to another rig or is too old."""
    if stored.rig != rig_name(identity):
        raise ProcedureError(
            f"the tare belongs to the rig {stored.rig!r}, this one is {rig_name(identity)!r}: tare again"
        )
    age_s = (now - datetime.fromisoformat(stored.measured_at)).total_seconds()
    if age_s > TARE_AGE_S:
        raise ProcedureError(f"the tare is {age_s / 3600:.0f} h old, {TARE_AGE_S / 3600:.0f} h are allowed: tare again")
