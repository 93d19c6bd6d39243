"""The user's connections for a model whose variables have other names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from identification.errors import ModelError
from identification.signals import SIGNALS


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Channel → variable, the variable of the force (with a minus where its sign is reversed), and parameters."""

    inputs: Mapping[str, str] = field(default_factory=dict)
    force: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for channel in self.inputs:
            if channel not in SIGNALS:
                raise ModelError(f"FMU input {channel!r}: a run drives {', '.join(SIGNALS)}: write CHANNEL=VARIABLE")
