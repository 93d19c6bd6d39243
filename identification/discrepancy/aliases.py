"""What looks the same as a named effect under any motion of the actuator, and the physical test that splits them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final

from identification.physical.elements import CATALOGUE


@dataclass(frozen=True, slots=True)
class Alias:
    """Another cause of the same force, and the test beside the rig's programme that splits the two."""

    cause: str
    test: str


_UNBOLTED = "read the load cell with the damper unbolted"
_EMPTY = "play the same motion without the damper: what is measured then is the rig's"
_BAR = "put a rigid bar in the place of the damper: what yields then is the rig's"
_PROBE = "record the current at the coil with a probe of its own"

ALIASES: Final[Mapping[str, Alias]] = {
    "moving_mass": Alias("the inertia of the load cell and its fixture, or of parts inside the damper", _EMPTY),
    "force_delay": Alias("a lead of the displacement channel", "feed one electrical signal into both channels"),
    "force_offset": Alias("the preload of the gas, or a weight on the load cell", _UNBOLTED),
    "gas_spring": Alias("for its preload, an offset of the load cell", _UNBOLTED),
    "force_drift": Alias("a slow change of the gas pressure", f"{_UNBOLTED}, before and after a run"),
    "mains_hum": Alias("a vibration of the pump or the frame", "record at rest, with the pump on and off"),
    "linear_stiffness": Alias("a hose or a guide of the rig that acts as a spring", _EMPTY),
    "series_compliance": Alias("a frame or a fixture that yields", _BAR),
    "free_play": Alias("play in the rig's own joints", _BAR),
    "temperature_fade": Alias("a fade with the time under load", "let the damper cool and repeat the first run"),
    "control_lag": Alias("a slow current amplifier", _PROBE),
    "control_delay": Alias("a dead time of the current amplifier", _PROBE),
    "control_saturation": Alias("a current amplifier at its limit", _PROBE),
    "control_hysteresis": Alias("hysteresis of the current amplifier", _PROBE),
}


def aliases(names: Collection[str]) -> list[str]:
    """A sentence for every name that has an alias."""
    known = [(CATALOGUE[n].title, ALIASES[n]) for n in names if n in ALIASES]
    return [f"{title}: {a.cause} would look the same in every run; to tell them apart, {a.test}" for title, a in known]
