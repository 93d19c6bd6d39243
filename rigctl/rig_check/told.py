"""What a rig, or the map of a controller of another make, says: identity, limits, readings."""

from __future__ import annotations

import numpy as np

from rigctl.axis import UNPOWERED
from rigctl.device import describe
from rigctl.limits import Limits
from rigctl.rig_check.protocol import Finding, Verdict, noted
from rigctl.transport import Capability, Identity, Status

__all__ = ["identity_told", "limits_told", "state_told"]


def identity_told(identity: Identity) -> list[Finding]:
    """Who the rig is; what a controller of another make does not tell is said to be unknown."""
    capabilities = ", ".join(str(one.name).lower() for one in Capability if one & identity.capabilities) or "none"
    values = {
        "make, model, serial number": f"{identity.vendor} {identity.model}, {identity.serial or 'not known'}",
        "register map": "of another make, by its map" if identity.foreign else f"version {identity.map_version}",
        "channels": str(identity.channel_count - len(identity.unmeasured)),
        "sample rates": _rates(identity),
        "FIFO, capture store": "not known: this computer keeps what the controller does not hold"
        if identity.foreign
        else f"{identity.fifo_samples}, {identity.capture_samples} samples",
        "capabilities": capabilities,
    }
    if identity.foreign:
        values["watchdog, by its map"] = identity.watchdog or "not known"
    return [noted("identity", what, text) for what, text in values.items()]


def _rates(identity: Identity) -> str:
    low, high = identity.sample_rate_min_hz, identity.sample_rate_max_hz
    if low == high:
        return f"{low:g} Hz"
    return f"{low:g} … {high:g} Hz in steps of {identity.rate_step_hz:g} Hz"


def limits_told(identity: Identity) -> list[Finding]:
    """The machine's limits; for a controller of another make, which of them it takes."""
    found = [noted("limits", what, text) for what, text in _limits(identity.limits).items()]
    low = identity.low_pressure
    stage = "none" if low is None else f"{1e3 * low.velocity_m_s:g} mm/s, {low.force_n:g} N"
    found.append(noted("limits", "low pressure", stage))
    if not identity.foreign:
        return found
    taken = ", ".join(identity.takes_limits)
    return [
        *found,
        noted("limits", "whose", "those of its map; what the map leaves out is this program's, not the controller's"),
        Finding(part="limits", what="taken by the controller", found=f"{taken}: written and read back")
        if taken
        else noted("limits", "taken by the controller", "none: its own are fixed, and not known beyond its map"),
    ]


def _limits(limits: Limits) -> dict[str, str]:
    return {
        "stroke": f"{1e3 * limits.position_min_m:g} … {1e3 * limits.position_max_m:g} mm",
        "speed": f"{limits.velocity_m_s:g} m/s",
        "acceleration": f"{limits.acceleration_m_s2:g} m/s²",
        "force": f"{limits.force_n:g} N",
        "current": f"{limits.current_min_a:g} … {limits.current_max_a:g} A",
        "temperature": f"{limits.temperature_max_degc:g} °C",
        "following error": f"{1e3 * limits.following_error_m:g} mm",
    }


def state_told(identity: Identity, status: Status) -> list[Finding]:
    """State, latched faults and the readings of the sensors at rest."""
    faults = describe(status.faults, status.detector)
    return [
        Finding(
            part="state",
            what="state",
            found=status.state.name,
            verdict=Verdict.GOOD if status.state in UNPOWERED else Verdict.BAD,
            wanted="without power",
        ),
        Finding(
            part="state",
            what="latched faults",
            found=faults or "none",
            verdict=Verdict.BAD if faults else Verdict.GOOD,
            wanted="none",
        ),
        *_readings(identity, status),
    ]


def _readings(identity: Identity, status: Status) -> list[Finding]:
    texts = {
        "force": f"{status.force_n:.1f} N",
        "displacement": f"{1e3 * status.displacement_m:.3f} mm",
        "current": f"{status.current_a:.3f} A",
        "temperature": f"{status.temperature_degc:.1f} °C",
        "pressure": f"{status.pressure_pa / 1e6:.2f} MPa",
    }
    return [
        noted("state", what, "not measured")
        if what in identity.unmeasured
        else Finding(part="state", what=what, found=text, verdict=Verdict.NOTE if np.isfinite(value) else Verdict.BAD)
        for (what, text), value in zip(texts.items(), status.measured[0], strict=True)
    ]
