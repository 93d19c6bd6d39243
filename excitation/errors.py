"""Everything excitation raises on purpose.

ExcitationError (a ValueError: the input, not the machine, is at fault)
├── DesignError           a configuration or a specification that cannot be used
├── EnvelopeError         a test that the rig cannot play
├── AnalysisError         runs of which a periodic analysis can say nothing
└── ExcitationFileError   an excitation or plan file that cannot be read or written

Each message is one line: what, where, the value, and what would be right.
"""

from __future__ import annotations

from typing import TypeAlias

Findings: TypeAlias = "tuple[tuple[tuple[str | int, ...], str], ...]"

__all__ = ["AnalysisError", "DesignError", "EnvelopeError", "ExcitationError", "ExcitationFileError", "Findings"]


class ExcitationError(ValueError):
    """Everything excitation raises on purpose."""


class DesignError(ExcitationError):
    """The configuration cannot be used: the message names the key, its value and what would be right.

    ``findings``: everything that is wrong with it, each as its keys and indices from the outside in, and one line;
    empty where only the message says it.
    """

    def __init__(self, message: str, *, findings: Findings = ()) -> None:
        super().__init__(message)
        self.findings = findings

    def below(self, where: str, *place: str | int) -> DesignError:
        """The error as part of something larger: ``where`` begins its lines, ``place`` its keys."""
        begins = f"{where}: " if where else ""
        found = tuple(((*place, *keys), f"{begins}{line}") for keys, line in self.findings)
        return DesignError(f"{begins}{self}", findings=found or ((place, f"{begins}{self}"),))


class EnvelopeError(ExcitationError):
    """The rig cannot play the test: the message names test, limit, by how much, and what would fit."""


class AnalysisError(ExcitationError):
    """Runs of which a periodic analysis can say nothing: the message says why and what would be right."""


class ExcitationFileError(ExcitationError):
    """The file cannot be read or written: the message names file, place and what would be right."""
