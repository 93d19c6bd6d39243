"""A learned inverse in a model file: the network under the names of what it gives and sees, and its forward model."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Final

from identification.blackbox.fields import facts_in, facts_to_json, number_in, object_in
from identification.blackbox.modelfile import alone_from_json, blackbox_to_json
from identification.errors import ModelError
from identification.inverse.model import Inverse
from identification.inverse.reach import Limits
from identification.inverse.recipe import swapped
from identification.models.modelfile import FORMAT, FORMAT_VERSION, Json, Kind, model_from_json, write_json

INVERSE: Final = Kind(name="inverse", reader="identification.inverse.modelfile:inverse_from_json")
_SWAPPED: Final = {"force": "current", "current": "force"}


def write_inverse(path: str | os.PathLike[str], model: Inverse) -> None:
    """Write a model file: complete under its name, or not at all; raises ModelFileError."""
    write_json(path, inverse_to_json(model))


def inverse_to_json(model: Inverse) -> dict[str, Json]:
    """The model as JSON data."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "name": model.name,
        "kind": INVERSE.name,
        "limits": [model.limits.low, model.limits.high],
        "network": _renamed(blackbox_to_json(model.network)),
        "forward": dict(model.forward_file),
        "facts": facts_to_json(model.facts),
    }


def inverse_from_json(data: Json) -> Inverse:
    """A learned inverse from parsed JSON; raises ModelError with the place and the cure."""
    limits = data.get("limits")
    if not isinstance(limits, list) or len(limits) != 2:
        raise ModelError("limits must be a list of two currents, A, the lower first")
    try:
        network = alone_from_json(_renamed(object_in("network", data.get("network"))))
    except ModelError as error:
        raise ModelError(f"network: {error}") from error
    try:
        forward = model_from_json(object_in("forward", data.get("forward")))
    except ModelError as error:
        raise ModelError(f"forward: {error}") from error
    return Inverse(
        name=data.get("name", ""),
        network=network,
        limits=Limits(*(number_in(f"limits[{k}]", one) for k, one in enumerate(limits))),
        forward=forward,
        forward_file=data["forward"],
        facts=facts_in(data),
    )


def _renamed(data: Mapping[str, Json]) -> dict[str, Json]:
    """The JSON data of a network with force and current in each other's place; twice: as it was."""
    out = dict(data)
    if isinstance(data.get("signals"), Mapping):
        out["signals"] = {_SWAPPED.get(name, name): one for name, one in data["signals"].items()}
    if isinstance(data.get("members"), list):
        out["members"] = [_member(one) for one in data["members"]]
    return out


def _member(data: Json) -> Json:
    names = data.get("regressors") if isinstance(data, Mapping) else None
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        return data
    return {**data, "regressors": [swapped(name) for name in names]}
