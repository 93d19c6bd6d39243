"""Files of black boxes with a hostile value at every place: refused in one line, or a force that is bounded."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.blackbox.band import LEVELS
from identification.blackbox.hybrid import Hybrid, hybrid_to_json
from identification.blackbox.layered import LayeredNarx
from identification.blackbox.layeredfile import layered_to_json
from identification.blackbox.layers import Layers, first_layer_weights
from identification.blackbox.modelfile import blackbox_to_json
from identification.blackbox.polynomialfile import polynomial_to_json
from identification.blackbox.structure import Structure, regressors
from identification.errors import ModelFileError, SimulationError
from identification.inverse import Inverse, Wanted
from identification.inverse.modelfile import INVERSE, inverse_to_json
from identification.inverse.reach import Limits
from identification.models import load_model, motion_from
from identification.models.band import half_width_of
from identification.models.modelfile import KINDS
from identification.models.motion import Motion
from identification.multiaxis import MOTIONS, identify_axes
from identification.multiaxis.model import scales_needed
from identification.multiaxis.modelfile import multiaxis_in, multiaxis_to_json
from identification.physical.model import Model, element
from identification.physical.modelfile import model_to_json
from tests.identification.random_black_boxes import DT, SCALES, network, polynomial
from tests.identification.six_axes import by_formula
from tests.identification.six_axes import motion as six_axes

Floats = NDArray[np.float64]
Json = Any  # what a file may hold
LONGEST = 400  # characters of a refusal without the path
LARGEST = 1e13  # N: half beyond the largest scale that a file may hold
GONE, MORE, FEWER = object(), object(), object()
VALUES: tuple[object, ...] = (
    None, True, "x", "a\nb\x1b[31m", "y" * 5000, 0, -1, 0.5, 1e9, 1e308, -1e308, 1.7e308, 1e-320, 2**63, 10**400, [],
    {}, [[]], [None], [1] * 5000, ["v0", "v0"], ["v1000000000"], {"a": 1}, GONE, MORE, FEWER,
)  # fmt: skip
BAND = {
    "floor": 3.0,
    "growth": 0.3,
    "within": 0.7,
    "beyond": 1.2,
    "swing": 300.0,
    "levels": None,
    "factors": [0.5, 0.7, 0.9, 1.1, 1.3, 1.6, 2.0, 2.4, 3.0],
}

TOGETHER = {
    "limits": {"displacement": [-0.01, 0.01], "velocity": [-0.1, 0.1]},
    "points": [[0, 500], [250, 1000], [500, 500]],
}


def layered() -> LayeredNarx:
    structure, layers = Structure(regressors("F1 v0 i0"), 0), Layers((3, 2))
    weights = first_layer_weights(layers, 3, 1)
    return LayeredNarx(name="l", dt=DT, scales=SCALES, structure=structure, layers=layers, weights=weights)


def hybrid() -> Hybrid:
    base = Model(name="base", elements=(element("viscous_damping", {"c": 900.0}),))
    return Hybrid(name="h", base=base, base_file=model_to_json(base), rest=network("rest", "F1 v0 M0", 2))


def inverse() -> Inverse:
    forward = Model(name="f", elements=(element("viscous_damping", {"c": 900.0, "c_control": 400.0}),))
    return Inverse(
        name="i", network=network("current", "F1 v0 i0", 2), limits=Limits(0.0, 1.0), forward=forward,
        forward_file=model_to_json(forward),
    )  # fmt: skip


@cache
def files() -> Mapping[str, Json]:
    found: dict[str, Json] = {
        "nnoe": blackbox_to_json(network("one", "F1 F2 v0 i1 P0", 3)),
        "polynomial": polynomial_to_json(polynomial()),
        "layered": layered_to_json(layered()),
        "hybrid": hybrid_to_json(hybrid()),
        "inverse": inverse_to_json(inverse()),
        "multiaxis": multiaxis_to_json(identify_axes([by_formula(six_axes(1), "together")])),
    }
    axes = found["multiaxis"]
    axes["loads"] = {"force": axes["loads"]["force"]}
    axes["signals"] = {name: axes["signals"][name] for name in scales_needed(axes["loads"]["force"]["axes"], None)}
    axes["correlations"] = {"force": {"displacement": 0.9}}
    found["hybrid"]["rest"]["members"] = found["hybrid"]["rest"]["members"][:1]
    for kind in ("nnoe", "polynomial", "layered"):
        found[kind]["band"] = {**BAND, "levels": list(LEVELS)}
        found[kind]["together"] = deepcopy(TOGETHER)
    return found


def places(data: Json, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place of a file; of a list its first and its last."""
    if path:
        yield path
    inner = list(data) if isinstance(data, dict) else []
    if isinstance(data, list) and data:
        inner = sorted({0, len(data) - 1})
    for key in inner:
        yield from places(data[key], (*path, key))


def changed(data: Json, path: tuple[Any, ...], value: object) -> Json | None:
    """The file with a value at a place; None where there is nothing to change so."""
    whole = deepcopy(data)
    outer = whole
    for key in path[:-1]:
        outer = outer[key]
    at, key = outer[path[-1]], path[-1]
    if value is GONE:
        del outer[key]
    elif value in (MORE, FEWER):
        if not isinstance(at, list) or not at:
            return None
        outer[key] = [*at, at[-1]] if value is MORE else at[:-1]
    else:
        outer[key] = value
    return whole


def small() -> Motion:
    t = np.arange(60) * DT
    return motion_from(0.012 * np.sin(47.0 * t), 1.0 / DT, current=0.5 + 0.4 * np.sin(8.0 * t))


def forces_of_one(path: Path) -> list[Floats]:
    model = load_model(path)
    half = half_width_of(model, small())
    return [model.force(small()), *([] if half is None else [half])]


def forces_of_axes(path: Path) -> list[Floats]:
    model = multiaxis_in(path)
    if model is None:
        raise ModelFileError(f"{path}: of another kind")
    channels = by_formula(six_axes(2)[:60], "shown").channels
    return list(model.along({name: channels[name] for name in MOTIONS}).values())


def current_of(path: Path) -> list[Floats]:
    model = cast("Json", load_model(path, kinds=(*KINDS, INVERSE)))  # an inverse is no model of a force
    if not isinstance(model, Inverse):
        return [model.force(small())]
    return [model.current(Wanted(name="w", motion=small(), force=np.full(60, 300.0)))]


SIMULATED: Mapping[str, Callable[[Path], list[Floats]]] = {"multiaxis": forces_of_axes, "inverse": current_of}


def judged(path: Path, kind: str) -> bool:
    """Whether a file is taken, and then gives what is finite and bounded; else it is refused in one short line."""
    try:
        given = SIMULATED.get(kind, forces_of_one)(path)
    except (ModelFileError, SimulationError) as error:
        text = str(error)
        assert "\n" not in text
        assert len(text) - len(str(path)) < LONGEST, text
        return False
    assert all(np.all(np.abs(one) <= LARGEST) for one in given)
    return True


LONGER = ("nnoe", "layered", "hybrid", "inverse", "multiaxis")


@pytest.mark.parametrize("kind", ["polynomial", *(pytest.param(kind, marks=pytest.mark.slow) for kind in LONGER)])
def test_a_file_with_a_hostile_value_is_refused_in_one_line_or_gives_a_bounded_force(kind: str, tmp_path: Path) -> None:
    path, taken, refused = tmp_path / "hostile.json", 0, 0
    data = files()[kind]
    path.write_text(json.dumps(data))
    assert judged(path, kind)
    for place in places(data):
        if "paths" in place and not (kind == "hybrid" and "parameters" in place):
            continue  # a coefficient of a physical element may be of any size; a hybrid cuts the force of its base
        for value in VALUES:
            one = changed(data, place, value)
            if one is None:
                continue
            path.write_text(json.dumps(one))
            try:
                fine = judged(path, kind)
            except Exception as error:
                raise AssertionError(f"{kind}: {value!r:.60} at {place}") from error
            taken, refused = taken + fine, refused + (not fine)
    assert refused > taken > 0
