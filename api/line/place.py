"""Where the worker of a rig listens: a small file for this user alone, in the data folder of the service."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from api.errors import ProcessError, one_line

__all__ = ["Place", "places", "remove_place", "write_place"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """The loopback port of a worker, the secret that opens it, and which rig it drives."""

    rig_id: str
    address: str  # of the rig
    port: int
    secret: str
    host: str  # name of the computer of the worker
    pid: int


def write_place(folder: Path, place: Place) -> None:
    """Write the file, whole or not at all; raises ProcessError."""
    path = folder / f"{place.rig_id}.json"
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        fresh = path.with_suffix(f".{place.pid}.new")
        with os.fdopen(os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w") as file:
            json.dump(asdict(place), file)
        fresh.replace(path)
    except OSError as error:
        raise ProcessError(f"{path}: cannot be written: {one_line(error)}") from error


def remove_place(folder: Path, rig_id: str, pid: int) -> None:
    """Remove the file of a worker that has ended, unless another worker has written it meanwhile."""
    with suppress(OSError):
        if any(place.pid == pid for place in places(folder) if place.rig_id == rig_id):
            (folder / f"{rig_id}.json").unlink(missing_ok=True)


def places(folder: Path) -> Iterator[Place]:
    """Every worker that has written where it listens; one that died may still be among them."""
    try:
        names = [entry.path for entry in os.scandir(folder) if entry.name.endswith(".json")]
    except OSError:  # no worker has ever run here
        return
    for name in sorted(names):
        with suppress(OSError, ValueError, TypeError):  # removed or replaced at this moment
            yield Place(**json.loads(Path(name).read_text()))
