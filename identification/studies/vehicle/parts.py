"""The independent rides of a vehicle study, carried out on the executor and kept in the journal."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.models.protocol import SimulationModel
from identification.studies.journal import carried, key_of
from identification.studies.vehicle.protocol import Ground, Vehicle
from identification.studies.vehicle.ride import Control, Ride, ride

Floats = NDArray[np.float64]
Tell = Callable[[float, str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One ride: a vehicle over a ground with a damper in each of its places."""

    vehicle: Vehicle
    dampers: Mapping[str, SimulationModel]
    ground: Ground
    control: Control | None = None

    def ridden(self) -> Ride:
        """The ride; raises what `ride` raises. Its control is its own, which remembers."""
        return ride(self.vehicle, self.dampers, self.ground, control=deepcopy(self.control))

    def key(self) -> bytes:
        """What tells it from other parts."""
        models = [identity_of(self.dampers[place]) for place in self.vehicle.dampers]
        moved = self.ground
        ground = [moved.x.tobytes(), moved.v.tobytes(), moved.a.tobytes(), repr(moved.dt).encode()]
        return key_of(_pickled(self.vehicle), _pickled(self.control), *models, *ground)


def rides(parts: Sequence[Part], tell: Tell, what: str) -> list[Ride]:
    """The rides of the parts, in their order; raises what `ride` raises."""
    keys = [part.key() for part in parts] if parts else []
    found = carried(_packed_ride, parts, keys, what=what, tell=tell)
    return [unpacked(values, part) for values, part in zip(found, parts, strict=True)]


def identity_of(model: SimulationModel) -> bytes:
    """What tells a model from others: its content, of an FMU the file's too."""
    path = getattr(model, "path", None)
    file = hashlib.sha256(path.read_bytes()).digest() if isinstance(path, Path) else b""
    return _pickled(model) + file


def _packed_ride(part: Part) -> Floats:
    return packed(part.ridden())


def packed(found: Ride) -> Floats:
    """A ride as one array: a row a sample, and a last one with the counts."""
    series = [*found.outputs.values(), *np.hstack([found.x, found.v, found.a, found.current, found.force]).T]
    rows = np.column_stack(series)
    last = np.zeros(rows.shape[1])
    last[0], last[1 : 1 + found.missed.size] = found.loose, found.missed
    return np.vstack([rows, last])


def unpacked(values: Floats, part: Part) -> Ride:
    """The ride of a part from its array."""
    names, count = tuple(part.vehicle.outputs), len(part.vehicle.dampers)
    rows, last = values[:-1], values[-1]
    outputs = {name: rows[:, k].copy() for k, name in enumerate(names)}
    x, v, a, current, force = np.split(rows[:, len(names) :], 5, axis=1)
    return Ride(
        time=part.ground.time, outputs=outputs, x=x, v=v, a=a, current=current, force=force, loose=int(last[0]),
        missed=last[1 : 1 + count].copy(),
    )  # fmt: skip


def _pickled(one: Any) -> bytes:
    """Any: whatever a user's own vehicle or control is."""
    try:
        return pickle.dumps(one, protocol=5)
    except (pickle.PicklingError, AttributeError, TypeError):
        return repr(one).encode()  # functions of a notebook: never found again, as their address is in it
