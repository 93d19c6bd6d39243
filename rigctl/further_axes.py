"""The channels of the further axes of a rig of several, in the order of a captured sample."""

from __future__ import annotations

from collections.abc import Mapping

# Motions and loads of the further axes of a rig of several; the main axis has no suffix.
FURTHER_AXES: Mapping[str, str] = {
    **{f"displacement_{axis}": "m" for axis in "yz"},
    **{f"displacement_r{axis}": "rad" for axis in "xyz"},
    **{f"force_{axis}": "N" for axis in "yz"},
    **{f"torque_{axis}": "N·m" for axis in "xyz"},
}
