"""The kinds of excitations: those that files name, and those that a configuration can ask for."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["DESIGNED", "FILE", "HOMOGENISED", "NOISE", "REPLAY", "Kind"]


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

NOISE = "noise"
"""Lines of random amplitudes: its samples are of the kind ``Kind.MULTISINE``."""

REPLAY = "replay"
"""A measured record: its samples are of the kind ``Kind.CUSTOM``."""

FILE = "file"
"""The samples of an excitation file as they are: its kind is that of the file."""

DESIGNED: tuple[str, ...] = (
    Kind.MULTISINE,
    HOMOGENISED,
    Kind.SINE,
    Kind.TRIANGLE,
    Kind.STEPS,
    Kind.SWEEP,
    NOISE,
    Kind.ROAD,
    REPLAY,
    FILE,
)
"""The values of `kind` in a configuration: what this package can design."""
