"""The kinds of excitations: those that files name, and those that a configuration can ask for."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["DESIGNED", "HOMOGENISED", "Kind"]


class Kind(StrEnum):
    """What an excitation is: the values of `excitation_kind` in run and excitation files."""

    MULTISINE = "multisine"
    SINE = "sine"
    TRIANGLE = "triangle"
    STEPS = "steps"
    SWEEP = "sweep"
    ROAD = "road"
    CUSTOM = "custom"


HOMOGENISED = "homogenised"
"""A way to design a multisine: its samples are of the kind ``Kind.MULTISINE``."""

DESIGNED: tuple[str, ...] = (Kind.MULTISINE, HOMOGENISED, Kind.SINE, Kind.TRIANGLE, Kind.STEPS)
"""The values of `kind` in a configuration: what this package can design."""
