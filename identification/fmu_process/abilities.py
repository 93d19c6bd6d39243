"""What an FMU states that it can do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Can:
    """Whether a sample can be taken back, and whether a process holds one instance only."""

    back: bool
    once: bool


def can(description: Any) -> Can:
    """What the description of an FMU states; co-simulation comes first. Any: fmpy carries no types."""
    kind = description.coSimulation or description.modelExchange
    back = description.coSimulation is None or bool(kind.canGetAndSetFMUstate)
    return Can(back=back, once=bool(kind.canBeInstantiatedOnlyOncePerProcess))
