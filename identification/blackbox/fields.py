"""What every black box has in its model file, and the checks that each place of it needs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from identification.blackbox.band import LEVELS, Band
from identification.errors import ModelError
from identification.models.modelfile import FORMAT, FORMAT_VERSION, Json, shown, type_of
from identification.models.visited import STEPS, TOGETHER, Visited

_LONGEST_NAME = 40  # characters of a signal, a regressor, an axis or an activation

# A network of scaled signals has weights of about 1. Half or double: nothing; the sums of four layers stay finite.
_LARGEST_WEIGHT = 1e12


class Learned(Protocol):
    """A model that was learned at one sample rate, with facts of its training."""

    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def dt(self) -> float: ...
    @property
    def facts(self) -> Mapping[str, float]: ...


def head_to_json(model: Learned) -> dict[str, Json]:
    """Format, name, kind and sample rate, as JSON data."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "name": model.name,
        "kind": model.kind,
        "sample_rate": 1.0 / model.dt,
    }


def interval_in(data: Json) -> float:
    """The time between two samples, s, by the sample rate of the file; raises ModelError."""
    rate = number_in("sample_rate", data.get("sample_rate"))
    if not rate > 0.0:
        raise ModelError(f"sample_rate is {rate:g} Hz: it must be above 0")
    return 1.0 / rate


def facts_to_json(facts: Mapping[str, float]) -> dict[str, Json]:
    """Facts of the training; null for what is not known."""
    return {name: value if math.isfinite(value) else None for name, value in facts.items()}


def facts_in(data: Json) -> dict[str, float]:
    """The facts of the file that are known; raises ModelError."""
    facts = object_in("facts", data.get("facts", {}))
    return {name: number_in(f"facts.{name}", value) for name, value in facts.items() if value is not None}


def names_in(where: str, raw: Json) -> list[str]:
    """The names at a place of a file; raises ModelError."""
    if not isinstance(raw, list) or not all(isinstance(name, str) for name in raw):
        raise ModelError(f"{where} must be a list of names")
    long = next((name for name in raw if len(name) > _LONGEST_NAME), None)
    if long is not None:
        raise ModelError(f"{where} has {shown(long)}: no name has more than {_LONGEST_NAME} characters")
    return raw


def object_in(where: str, data: Json) -> Mapping[str, Json]:
    """The object at a place of a file; raises ModelError."""
    if not isinstance(data, Mapping):
        raise ModelError(f"{where} is {'missing' if data is None else type_of(data)}: it must be an object")
    return data


def number_in(where: str, raw: Json) -> float:
    """The finite number at a place of a file; raises ModelError."""
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not math.isfinite(raw):
        raise ModelError(f"{where} is {shown(raw)}: it must be a finite number")
    return float(raw)


def weight_in(where: str, raw: Json) -> float:
    """The weight at a place of a file, of scaled signals; raises ModelError."""
    value = number_in(where, raw)
    if abs(value) > _LARGEST_WEIGHT:
        raise ModelError(f"{where} is {value:g}: a weight of scaled signals lies within ±{_LARGEST_WEIGHT:g}")
    return value


def band_to_json(band: Band | None) -> dict[str, Json]:
    """A band as an entry of JSON data; no entry where there is none."""
    return (
        {}
        if band is None
        else {
            "band": {
                "floor": band.floor, "levels": list(LEVELS), "factors": list(band.factors), "growth": band.growth,
                "swing": band.swing, "within": band.within, "beyond": band.beyond,
            }
        }
    )  # fmt: skip


def band_in(data: Json) -> Band | None:
    """The band of the file; None where it holds none; raises ModelError."""
    if data.get("band") is None:
        return None
    given = object_in("band", data["band"])
    if given.get("levels") != list(LEVELS):
        raise ModelError(f"band.levels must be {list(LEVELS)}")
    factors = given.get("factors")
    if not isinstance(factors, list):
        raise ModelError("band.factors must be a list of numbers")
    numbers = tuple(number_in(f"band.factors[{k}]", one) for k, one in enumerate(factors))
    floor, *rest = (
        number_in(f"band.{name}", given.get(name, default))
        for name, default in (("floor", None), ("growth", 0.0), ("swing", 1.0), ("within", 1.0), ("beyond", 1.0))
    )
    return Band(floor, numbers, *rest)


def visited_to_json(visited: Visited | None) -> dict[str, Json]:
    """Where a training went as an entry of JSON data, points in thousandths of the range; no entry for None."""
    if visited is None:
        return {}
    points = np.rint(visited.points * STEPS).astype(np.int64).tolist()
    return {"together": {"limits": {name: list(pair) for name, pair in visited.limits.items()}, "points": points}}


def visited_in(data: Json) -> Visited | None:
    """Where the training went by the file; None where it does not state it; raises ModelError."""
    if data.get("together") is None:
        return None
    given = object_in("together", data["together"])
    ranges = object_in("together.limits", given.get("limits"))
    foreign = next((name for name in ranges if name not in TOGETHER), None)
    if foreign is not None:
        raise ModelError(f"together.limits names {shown(foreign)}: use {', '.join(TOGETHER)}")
    limits = {name: _numbers_in(f"together.limits.{name}", one, 2) for name, one in ranges.items()}
    points = given.get("points")
    if not isinstance(points, list) or not points:
        raise ModelError("together.points must be a list of points")
    rows = [_numbers_in(f"together.points[{k}]", one, len(limits)) for k, one in enumerate(points)]
    return Visited({name: (one[0], one[1]) for name, one in limits.items()}, np.array(rows) / STEPS)


def _numbers_in(where: str, raw: Json, count: int) -> list[float]:
    if not isinstance(raw, list) or len(raw) != count:
        raise ModelError(f"{where} must be a list of {count} numbers")
    return [number_in(f"{where}[{k}]", one) for k, one in enumerate(raw)]
