"""A model of several axes in a model file: scales of the axes, a network for each load, and a base of the main axis."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from identification.blackbox.fields import facts_in, facts_to_json, names_in, number_in, object_in
from identification.blackbox.given import Base
from identification.blackbox.modelfile import scale_in, scale_to_json, weights_in
from identification.errors import ModelError, ModelFileError
from identification.models.modelfile import (
    FORMAT,
    FORMAT_VERSION,
    Json,
    Kind,
    kind_of,
    model_from_json,
    parsed_file,
    write_json,
)
from identification.multiaxis.axes import LOADS, MOTIONS
from identification.multiaxis.model import Load, MultiAxis

MULTIAXIS: Final = Kind(name="multiaxis", reader="identification.multiaxis.modelfile:multiaxis_from_json")


def write_multiaxis(path: str | os.PathLike[str], model: MultiAxis) -> None:
    """Write a model file: complete under its name, or not at all; raises ModelFileError."""
    write_json(path, multiaxis_to_json(model))


def multiaxis_in(path: str | os.PathLike[str]) -> MultiAxis | None:
    """The model of a file, None where the file is a model of another kind.

    Raises
    ------
    ModelFileError
        one line that names the file, the place in it, the value and what would be right.
    """
    place = Path(path)
    try:
        data = parsed_file(place)
        return multiaxis_from_json(data) if kind_of(data) == MULTIAXIS.name else None
    except ModelFileError:
        raise
    except ModelError as error:
        raise ModelFileError(f"{place}: {error}") from error


def multiaxis_to_json(model: MultiAxis) -> dict[str, Json]:
    """The model as JSON data."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "name": model.name,
        "kind": MULTIAXIS.name,
        "sample_rate": model.rate_hz,
        "signals": {name: scale_to_json(scale) for name, scale in model.scales.items()},
        "loads": {name: _load_to_json(load) for name, load in model.loads.items()},
        "correlations": {load: dict(axes) for load, axes in model.correlations.items()},
        "base": None if model.base is None else dict(model.base.file),
        "facts": facts_to_json(model.facts),
    }


def multiaxis_from_json(data: Json) -> MultiAxis:
    """A model of several axes from parsed JSON; raises ModelError with the place and the cure."""
    loads = object_in("loads", data.get("loads"))
    foreign = next((name for name in loads if name not in LOADS), None)
    if foreign is not None:
        raise ModelError(f"loads.{foreign} is no load: use {', '.join(LOADS)}")
    signals = object_in("signals", data.get("signals"))
    found = object_in("correlations", data.get("correlations", {}))
    return MultiAxis(
        name=data.get("name", ""),
        rate_hz=number_in("sample_rate", data.get("sample_rate")),
        scales={name: scale_in(f"signals.{name}", one) for name, one in signals.items()},
        loads={name: _load_in(f"loads.{name}", one) for name, one in loads.items()},
        correlations={load: _numbers_by_name(f"correlations.{load}", axes) for load, axes in found.items()},
        base=_base_in(data.get("base")),
        facts=facts_in(data),
    )


def _load_to_json(load: Load) -> dict[str, Json]:
    return {"axes": list(load.axes), "scale": scale_to_json(load.scale), "weights": load.weights.tolist()}


def _load_in(where: str, data: Json) -> Load:
    given = object_in(where, data)
    axes = tuple(names_in(f"{where}.axes", given.get("axes")))
    foreign = next((axis for axis in axes if axis not in MOTIONS), None)
    if foreign is not None or not axes or len(set(axes)) < len(axes):
        raise ModelError(f"{where}.axes is {list(axes)}: name each once, of {', '.join(MOTIONS)}")
    return Load(
        axes, scale_in(f"{where}.scale", given.get("scale")), weights_in(f"{where}.weights", given.get("weights"), None)
    )


def _base_in(data: Json) -> Base | None:
    if data is None:
        return None
    try:
        return Base(model_from_json(data, only=("physical",)), data)
    except ModelError as error:
        raise ModelError(f"base: {error}") from error


def _numbers_by_name(where: str, data: Json) -> dict[str, float]:
    return {name: number_in(f"{where}.{name}", one) for name, one in object_in(where, data).items()}
