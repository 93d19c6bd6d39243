"""Decodes registers, of any wire: identity, limits, status."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from rigctl import modbus_map as table
from rigctl import scaling
from rigctl.device import Fault, PressureStage, RigState
from rigctl.errors import IdentityError
from rigctl.limits import Limits, LowPressure
from rigctl.transport import Capability, Identity, Status


def identity_from(head: dict[str, table.Value], limits: dict[str, table.Value]) -> Identity:
    """Identity from its block and the machine's limits."""
    return Identity(
        map_version=int(head["map_version"]),
        vendor=str(head["vendor"]),
        model=str(head["model"]),
        serial=str(head["serial"]),
        channel_count=int(head["channel_count"]),
        sample_rate_min_hz=float(head["sample_rate_min_hz"]),
        sample_rate_max_hz=float(head["sample_rate_max_hz"]),
        fifo_samples=int(head["fifo_samples"]),
        capture_samples=int(head["capture_samples"]),
        capabilities=Capability(int(head["capabilities"])),
        limits=_limits(limits),
        rate_step_hz=scaling.SAMPLE_RATE_HZ,
        low_pressure=_low_pressure(limits),
    )


def _limits(values: dict[str, table.Value]) -> Limits:
    return Limits(**{f.name: float(values[f.name]) for f in fields(Limits)})


def _low_pressure(values: dict[str, table.Value]) -> LowPressure | None:
    speed, force = float(values["low_velocity_m_s"]), float(values["low_force_n"])
    return LowPressure(velocity_m_s=speed, force_n=force) if speed and force else None


def check_identity(url: str, head: dict[str, table.Value]) -> None:
    if head["magic"] != table.MAGIC:
        raise IdentityError(
            f"{url}: a foreign device: magic is 0x{int(head['magic']):04X}, it must be 0x{table.MAGIC:04X}"
        )
    if head["map_version"] != table.MAP_VERSION:
        raise IdentityError(
            f"{url}: the rig speaks register map {head['map_version']}, this program {table.MAP_VERSION}"
        )


def status_from(values: dict[str, Any]) -> Status:  # Any: a decoded register is a number or a text
    special = ("state", "stage", "faults", "first_fault", "arrived")
    plain = {f.name: values[f.name] for f in fields(Status) if f.name not in special}
    return Status(
        state=RigState(values["state"]),
        stage=PressureStage(values["pressure_stage"]),
        faults=Fault(values["faults"]),
        first_fault=Fault(values["first_fault"]),
        arrived=bool(values["arrived"]),
        **plain,
    )
