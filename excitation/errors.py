"""Everything excitation raises on purpose.

ExcitationError (a ValueError: the input, not the machine, is at fault)
├── DesignError           a configuration or a specification that cannot be used
├── EnvelopeError         a test that the rig cannot play
└── ExcitationFileError   an excitation or plan file that cannot be read or written

Each message is one line: what, where, the value, and what would be right.
"""

from __future__ import annotations

__all__ = ["DesignError", "EnvelopeError", "ExcitationError", "ExcitationFileError"]


class ExcitationError(ValueError):
    """Everything excitation raises on purpose."""


class DesignError(ExcitationError):
    """The configuration cannot be used: the message names the key, its value and what would be right."""


class EnvelopeError(ExcitationError):
    """The rig cannot play the test: the message names test, limit, by how much, and what would fit."""


class ExcitationFileError(ExcitationError):
    """The file cannot be read or written: the message names file, place and what would be right."""
