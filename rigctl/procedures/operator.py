"""The person at the rig, as a program sees one."""

from __future__ import annotations

from typing import Protocol

__all__ = ["Operator"]


class Operator(Protocol):
    """Asks the person at the rig; waits for the answer as long as it takes, with the rig without power."""

    def confirm(self, text: str) -> None:
        """Return when the person has confirmed; Declined otherwise."""
        ...

    def number(self, text: str, unit: str) -> float:
        """Return the finite number that the person has read; Declined where there is none."""
        ...
