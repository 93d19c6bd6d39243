"""What the options of a command say of an FMU."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identification.fmu import Choice

__all__ = ["fmu_choice"]


def fmu_choice(model: Path, inputs: Sequence[str], output: str, parameters: Sequence[str]) -> Choice | None:
    """The choice for a model that is an FMU, None for another; raises InputError or ModelError."""
    from api.errors import InputError
    from identification.fmu import Choice

    if model.suffix.lower() == ".fmu":
        return Choice(inputs=_pairs("--fmu-input", inputs), force=output, parameters=_pairs("--fmu-set", parameters))
    if inputs or output or parameters:
        raise InputError(f"{model}: --fmu-input, --fmu-output and --fmu-set go with a model that ends in .fmu")
    return None


def _pairs(option: str, texts: Sequence[str]) -> dict[str, str]:
    from api.errors import InputError

    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals and value):
            raise InputError(f"{option} is {text!r}: write NAME=VALUE")
    return dict(text.split("=", 1) for text in texts)
