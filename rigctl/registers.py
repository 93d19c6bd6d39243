"""Decodes registers, of any wire: identity, limits, status."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from rigctl import modbus_map as table
from rigctl.device import Fault, RigState
from rigctl.errors import IdentityError
from rigctl.limits import Limits
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
    )


def _limits(values: dict[str, table.Value]) -> Limits:
    return Limits(**{f.name: float(values[f.name]) for f in fields(Limits)})


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
    special = ("state", "faults", "first_fault", "arrived")
    plain = {f.name: values[f.name] for f in fields(Status) if f.name not in special}
    return Status(
        state=RigState(values["state"]),
        faults=Fault(values["faults"]),
        first_fault=Fault(values["first_fault"]),
        arrived=bool(values["arrived"]),
        **plain,
    )
