"""What a user says of a model whose variables carry names of their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from identification.errors import ModelError
from identification.models.protocol import SIGNALS


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What the user says: channel → variable, the force's variable (with a minus where it is reversed), parameters."""

    inputs: Mapping[str, str] = field(default_factory=dict)
    force: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for channel in self.inputs:
            if channel not in SIGNALS:
                raise ModelError(f"FMU input {channel!r}: a run drives {', '.join(SIGNALS)}: write CHANNEL=VARIABLE")
