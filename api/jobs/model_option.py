"""A model in a request: the JSON of a model file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from identification.errors import ModelError

__all__ = ["check_model", "model_name"]


def check_model(model: Mapping[str, Any], *, where: str = "model", of_axes: bool = False) -> None:
    """Raise ModelError where it is not a model; ``where`` it stands in the request. Any: JSON of the request.

    ``of_axes``: a model of several axes is one too.
    """
    from identification.models import KINDS, model_from_json  # a second of libraries: a service that starts
    from identification.multiaxis import MAIN_FORCE  # does not wait

    try:
        model_from_json(model, kinds=(*KINDS, MAIN_FORCE) if of_axes else KINDS)
    except ModelError as error:
        raise ModelError(f"{where}: {error}") from error


def model_name(model: Mapping[str, Any]) -> str:
    """The name in the model."""
    return str(model.get("name") or "the given model")
