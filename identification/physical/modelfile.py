"""A physical model in a model file: read with every mistake named, and written."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace

from identification.errors import ModelError
from identification.models.modelfile import (
    FORMAT,
    FORMAT_VERSION,
    Json,
    kind_of,
    load_model,
    shown,
    type_of,
    write_json,
)
from identification.physical.elements import CATALOGUE, PATHS, ElementSpec
from identification.physical.model import Element, Model, Parameter

_KEYS = {"value", "fixed", "min", "max", "std"}


def read_model(path: str | os.PathLike[str]) -> Model:
    """A physical model from its file.

    Raises
    ------
    ModelFileError
        one line that names the file, the place in it, the value and what would be right.
    """
    model = load_model(path, only=("physical",))
    assert isinstance(model, Model)  # what the reader below gives
    return model


def model_from_json(data: Json) -> Model:
    """A physical model from parsed JSON; raises ModelError with the place and the cure."""
    kind = kind_of(data)
    if kind != "physical":
        raise ModelError(f"kind is {kind!r}: only 'physical' models have named elements")
    paths = data.get("paths")
    if not isinstance(paths, Mapping):
        raise ModelError("paths is missing: it holds mount, control, core and sensor")
    unknown = set(paths) - set(PATHS)
    if unknown:
        raise ModelError(f"paths.{min(unknown)} is no path: use {', '.join(PATHS)}")
    return Model(name=data.get("name", ""), elements=tuple(e for p in PATHS for e in _elements(p, paths.get(p, []))))


def _elements(path: str, items: Json) -> list[Element]:
    if not isinstance(items, list):
        raise ModelError(f"paths.{path} is {type_of(items)}: it must be a list of elements")
    return [_element(f"paths.{path}[{k}]", path, item) for k, item in enumerate(items)]


def _element(where: str, path: str, item: Json) -> Element:
    if not isinstance(item, Mapping) or not isinstance(item.get("element"), str):
        raise ModelError(f"{where} has no 'element': name one of the catalogue")
    name = item["element"]
    spec = CATALOGUE.get(name)
    if spec is None:
        raise ModelError(f"{where}: element '{name}' is not in the catalogue: use one of {', '.join(CATALOGUE)}")
    if spec.path != path:
        raise ModelError(f"{where}: '{name}' belongs to {spec.path}, not to {path}: move it there")
    extra = set(item) - {"element", "id", "named", "parameters"}
    if extra:
        raise ModelError(f"{where}.{min(extra)} is unknown: an element has 'element', 'parameters', 'id' and 'named'")
    own_id = item.get("id", name)
    if not isinstance(own_id, str) or not own_id:
        raise ModelError(f"{where}.id is {shown(own_id)}: it must be '{name}' or '{name}#label'")
    named = item.get("named", False)
    if not isinstance(named, bool):
        raise ModelError(f"{where}.named is {shown(named)}: it must be true or false")
    given = item.get("parameters", {})
    if not isinstance(given, Mapping):
        raise ModelError(f"{where}.parameters is {type_of(given)}: it must be an object")
    unknown = set(given) - {p.name for p in spec.parameters}
    if unknown:
        raise ModelError(
            f"{where}: '{name}' has no parameter '{min(unknown)}': it has {', '.join(p.name for p in spec.parameters)}"
        )
    try:
        return Element(name, tuple(_parameters(spec, given)), own_id, named)
    except ModelError as error:
        raise ModelError(f"{where}: {error}") from error


def _parameters(spec: ElementSpec, given: Mapping[str, Json]) -> list[Parameter]:
    out = []
    for p in spec.parameters:
        default = p.constant if p.constant is not None else p.default
        if p.name not in given and default is None:
            raise ModelError(f"'{spec.name}' lacks its parameter '{p.name}' ({p.unit})")
        if p.name not in given:
            out.append(Parameter(value=float(default or 0.0), fixed=True))
        else:
            out.append(_parameter(f"{spec.name}.{p.name}", given[p.name], constant=p.constant is not None))
    return out


def _parameter(where: str, raw: Json, *, constant: bool) -> Parameter:
    if not isinstance(raw, Mapping):
        return Parameter(value=_number(where, raw), fixed=constant)
    unknown = set(raw) - _KEYS
    if unknown:
        raise ModelError(f"{where}.{min(unknown)} is unknown: a parameter has {', '.join(sorted(_KEYS))}")
    if "value" not in raw:
        raise ModelError(f"{where} has no 'value'")
    fixed = raw.get("fixed", False)
    if not isinstance(fixed, bool):
        raise ModelError(f"{where}.fixed is {shown(fixed)}: it must be true or false")
    numbers = {key: _number(f"{where}.{key}", raw[key]) for key in ("min", "max", "std") if raw.get(key) is not None}
    return Parameter(
        value=_number(where, raw["value"]),
        fixed=fixed or constant,
        low=numbers.get("min"),
        high=numbers.get("max"),
        std=numbers.get("std"),
    )


def _number(where: str, raw: Json) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float):
        raise ModelError(f"{where} is {shown(raw)}: it must be a number in SI units")
    return float(raw)


def model_to_json(model: Model) -> dict[str, Json]:
    """The model as JSON data, element by element on its four paths."""
    ids = _ids_to_tell(model)
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "name": model.name,
        "kind": "physical",
        "paths": {
            path: [
                {
                    "element": e.name,
                    **({"id": e.id} if e.id in ids else {}),
                    **({"named": True} if e.named else {}),
                    "parameters": {spec.name: _parameter_json(p) for spec, p in e.told},
                }
                for e in model.on(path)
            ]
            for path in PATHS
        },
    }


def _ids_to_tell(model: Model) -> set[str]:
    """The ids that a reader would not give by the order of the elements alone."""
    plain = replace(model, elements=tuple(replace(e, id=e.name) for e in model.elements))
    return set() if plain.ids == model.ids else {e.id for e in model.elements if e.id != e.name}


def _parameter_json(p: Parameter) -> Json:
    more = {"min": p.low, "max": p.high, "std": p.std}
    known: dict[str, Json] = {key: value for key, value in more.items() if value is not None}
    if p.fixed:
        known["fixed"] = True
    return {"value": p.value, **known} if known else p.value


def write_model(path: str | os.PathLike[str], model: Model) -> None:
    """Write a model file: complete under its name, or not at all; raises ModelFileError."""
    write_json(path, model_to_json(model))
