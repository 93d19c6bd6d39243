"""A layered network in a model file: its layers one by one, each with a row of weights for every node."""

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
    object_in,
    visited_in,
    visited_to_json,
)
from identification.blackbox.layered import LayeredNarx
from identification.blackbox.layers import MOST_LAYERS, Layers
from identification.blackbox.modelfile import scales_from_json, scales_to_json, weights_in
from identification.blackbox.structure import Structure, regressors
from identification.errors import ModelError
from identification.models.modelfile import Json

Floats = NDArray[np.float64]


def layered_to_json(model: LayeredNarx) -> dict[str, Json]:
    """The model as JSON data."""
    parts = model.layers.parts(model.weights, len(model.structure.regressors))
    return {
        **head_to_json(model),
        "signals": scales_to_json(model.scales),
        "measured": list(model.measured),
        "regressors": [str(one) for one in model.structure.regressors],
        "activations": [model.layers.hidden, model.layers.output],
        "layers": [{"weights": matrix.tolist(), "biases": bias.tolist()} for matrix, bias in parts],
        "facts": facts_to_json(model.facts),
        **band_to_json(model.band),
        **visited_to_json(model.visited),
    }


def layered_from_json(data: Json) -> LayeredNarx:
    """A layered network from parsed JSON; raises ModelError with the place and the cure."""
    names = names_in("regressors", data.get("regressors"))
    structure = Structure(regressors(names), 0)
    if [str(one) for one in structure.regressors] != names:
        raise ModelError(f"regressors must be in the order {' '.join(map(str, structure.regressors))}")
    activations = names_in("activations", data.get("activations"))
    if len(activations) != 2:
        raise ModelError("activations must be two names: that of the hidden layers and that of the output")
    given = data.get("layers")
    if not isinstance(given, list) or not 2 <= len(given) <= MOST_LAYERS + 1:
        raise ModelError(f"layers must be a list of 2 … {MOST_LAYERS + 1} layers, the output last")
    weights, nodes, width = list[Floats](), list[int](), len(names)
    for k, one in enumerate(given):
        matrix, bias = _layer(f"layers[{k}]", one, width)
        weights += [matrix.ravel(), bias]
        width = bias.size
        nodes.append(width)
    if nodes.pop() != 1:
        raise ModelError(f"layers[{len(given) - 1}] must have one node: the force")
    return LayeredNarx(
        name=data.get("name", ""),
        dt=interval_in(data),
        scales=scales_from_json(data.get("signals")),
        structure=structure,
        layers=Layers(tuple(nodes), *activations),
        weights=np.concatenate(weights),
        measured=tuple(names_in("measured", data.get("measured", []))),
        facts=facts_in(data),
        band=band_in(data),
        visited=visited_in(data),
    )


def _layer(where: str, data: Json, width: int) -> tuple[Floats, Floats]:
    given = object_in(where, data)
    bias = weights_in(f"{where}.biases", given.get("biases"), None)
    rows = given.get("weights")
    if not isinstance(rows, list) or len(rows) != bias.size or not rows:
        raise ModelError(f"{where}.weights must be a list of {bias.size} rows: one a node")
    return np.array([weights_in(f"{where}.weights[{k}]", row, width) for k, row in enumerate(rows)]), bias
