"""A black box in a model file: numbers by name, read with every mistake named, and written."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.fields import (
    band_in,
    band_to_json,
    facts_in,
    facts_to_json,
    head_to_json,
    interval_in,
    names_in,
    number_in,
    object_in,
    visited_in,
    visited_to_json,
    weight_in,
)
from identification.blackbox.model import BlackBox, Member
from identification.blackbox.scaling import Scale, Scales
from identification.blackbox.structure import FORCE, MODEL, Structure, regressors
from identification.errors import ModelError
from identification.models.modelfile import Json, kind_of
from identification.signals import SIGNALS

Floats = NDArray[np.float64]

MOST_MEMBERS = 64
_SCALE = ("centre", "size", "low", "high")


def alone_from_json(data: Json) -> BlackBox:
    """A black box that stands alone; raises ModelError with the place and the cure."""
    model = blackbox_from_json(data)
    if MODEL in model.signals:
        raise ModelError("members: a regressor M needs the base of a hybrid")
    return model


def blackbox_from_json(data: Json) -> BlackBox:
    """A black box from parsed JSON; raises ModelError with the place and the cure."""
    kind = str(kind_of(data))
    members = data.get("members")
    if not isinstance(members, list) or not 1 <= len(members) <= MOST_MEMBERS:
        raise ModelError(f"members must be a list of 1 … {MOST_MEMBERS} networks")
    return BlackBox(
        name=data.get("name", ""),
        kind=kind,
        dt=interval_in(data),
        scales=scales_from_json(data.get("signals")),
        members=tuple(member_from_json(f"members[{k}]", one) for k, one in enumerate(members)),
        measured=tuple(names_in("measured", data.get("measured", []))),
        facts=facts_in(data),
        band=band_in(data),
        visited=visited_in(data),
    )


def blackbox_to_json(model: BlackBox) -> dict[str, Json]:
    """The model as JSON data."""
    return {
        **head_to_json(model),
        "signals": scales_to_json(model.scales),
        "measured": list(model.measured),
        "members": [member_to_json(member) for member in model.members],
        "facts": facts_to_json(model.facts),
        **band_to_json(model.band),
        **visited_to_json(model.visited),
    }


def member_to_json(member: Member) -> dict[str, Json]:
    """One network as JSON data."""
    structure, weights = member.structure, member.weights
    width, lanes, nodes = len(structure.regressors) + 1, structure.lanes, structure.nodes
    hidden = weights[: width * lanes].reshape(width, lanes)[:, :nodes]
    output = weights[width * lanes : (width + 1) * lanes][:nodes]
    return {
        "regressors": [str(one) for one in structure.regressors],
        "hidden": hidden.tolist(),
        "output": output.tolist(),
        "linear": weights[(width + 1) * lanes :].tolist(),
    }


def member_from_json(where: str, data: Json) -> Member:
    """One network from JSON data; raises ModelError."""
    given = object_in(where, data)
    names = names_in(f"{where}.regressors", given.get("regressors"))
    output = weights_in(f"{where}.output", given.get("output"), None)
    try:
        structure = Structure(regressors(names), output.size)
    except ModelError as error:
        raise ModelError(f"{where}: {error}") from error
    if [str(one) for one in structure.regressors] != names:
        raise ModelError(f"{where}.regressors must be in the order {' '.join(map(str, structure.regressors))}")
    width, lanes = len(names) + 1, structure.lanes
    rows = given.get("hidden")
    if not isinstance(rows, list) or len(rows) != width:
        raise ModelError(f"{where}.hidden must be a list of {width} rows: one a regressor, and one of biases")
    hidden, padded = np.zeros((width, lanes)), np.zeros(lanes)
    for k, row in enumerate(rows):
        hidden[k, : output.size] = weights_in(f"{where}.hidden[{k}]", row, output.size)
    padded[: output.size] = output
    linear = weights_in(f"{where}.linear", given.get("linear"), width)
    return Member(structure, np.concatenate([hidden.ravel(), padded, linear]))


def scales_to_json(scales: Scales) -> dict[str, Json]:
    """Scales as JSON data."""
    return {name: scale_to_json(scale) for name, scale in scales.items()}


def scales_from_json(data: Json) -> Scales:
    """Scales from JSON data; raises ModelError."""
    signals = object_in("signals", data)
    unknown = set(signals) - {FORCE, MODEL, *SIGNALS}
    if unknown:
        raise ModelError(f"signals.{min(unknown)} is no signal: use {FORCE}, {', '.join(SIGNALS)}")
    return {name: scale_in(f"signals.{name}", one) for name, one in signals.items()}


def scale_to_json(scale: Scale) -> dict[str, Json]:
    """One scale as JSON data."""
    return {key: getattr(scale, key) for key in _SCALE}


def scale_in(where: str, data: Json) -> Scale:
    """The scale at a place of a file; raises ModelError."""
    given = object_in(where, data)
    try:
        return Scale(*(number_in(f"{where}.{key}", given.get(key)) for key in _SCALE))
    except ModelError as error:
        text = str(error)
        raise ModelError(text if text.startswith(where) else f"{where}: {text}") from error


def weights_in(where: str, raw: Json, count: int | None) -> Floats:
    """The weights at a place of a file, as many as `count` where that is given; raises ModelError."""
    if not isinstance(raw, list) or (count is not None and len(raw) != count):
        raise ModelError(f"{where} must be a list of {'numbers' if count is None else f'{count} numbers'}")
    return np.array([weight_in(f"{where}[{k}]", value) for k, value in enumerate(raw)])
