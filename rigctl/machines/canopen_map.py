"""What an EDS file says about a CANopen drive: objects, and where they lie in the frames."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Final, TypeAlias

from rigctl.errors import MapError
from rigctl.machines.wires import CanopenWire

Key: TypeAlias = tuple[int, int]  # index, sub-index

CONTROL_WORD: Final = (0x6040, 0)
STATUS_WORD: Final = (0x6041, 0)
ERROR_CODE: Final = (0x603F, 0)
MODE: Final = (0x6060, 0)
POSITION: Final = (0x6064, 0)
TARGET: Final = (0x607A, 0)
POSITION_MIN: Final = (0x607D, 1)
POSITION_MAX: Final = (0x607D, 2)
POINT: Final = (0x60C1, 1)
BUFFER_CLEAR: Final = (0x60C4, 6)
BUFFER_POINTS: Final = (0x60C4, 1)
CONSUMER_HEARTBEAT: Final = (0x1016, 1)
NEEDED: Final = (CONTROL_WORD, STATUS_WORD, ERROR_CODE, MODE, POSITION, TARGET, POINT, BUFFER_CLEAR, CONSUMER_HEARTBEAT)
FORMATS: Final = {1: "<?", 2: "<b", 3: "<h", 4: "<i", 5: "<B", 6: "<H", 7: "<I", 8: "<f"}  # by CiA 301 data type
MOST_PDOS: Final = 8


@dataclass(frozen=True, slots=True)
class Pdo:
    """One process data frame: its identifier, and its objects with format and place."""

    identifier: int
    fields: tuple[tuple[Key, str, int], ...]
    length: int

    def decode(self, data: bytes) -> dict[Key, float]:
        """Values of a frame; empty for one that is too short."""
        if len(data) < self.length:
            return {}
        return {key: float(struct.unpack_from(form, data, at)[0]) for key, form, at in self.fields}

    def encode(self, values: Mapping[Key, int]) -> bytes:
        """A frame with these values; an object without a value is 0."""
        data = bytearray(self.length)
        for key, form, at in self.fields:
            struct.pack_into(form, data, at, values.get(key, 0))
        return bytes(data)


@dataclass(frozen=True, slots=True)
class NodeMap:
    """The objects and frames of one node."""

    node: int
    formats: Mapping[Key, str]
    received: tuple[Pdo, ...]  # by the drive: RPDO
    sent: tuple[Pdo, ...]  # by the drive: TPDO
    force: Key | None
    counter: Key
    current: Key | None
    buffer_points: int

    def receiving(self, key: Key) -> Pdo:
        """The frame by which an object is written."""
        return next(pdo for pdo in self.received if any(field[0] == key for field in pdo.fields))


def node_map(wire: CanopenWire) -> NodeMap:
    """Read the EDS file of a map.

    Raises
    ------
    MapError
        Where the file cannot be read, lacks an object, or does not map what is needed into frames.
    """
    objects = _import(_canopen(), wire)
    formats = _formats(objects)
    for key in NEEDED:
        if key not in formats:
            raise MapError(
                f"eds {wire.eds}: object {_text(key)} is missing: a drive after CiA 402 that interpolates has it"
            )
    received, sent = (_pdos(objects, formats, first, wire) for first in (0x1400, 0x1800))
    counter, force = _named(objects, wire, "counter_object"), _named(objects, wire, "force_object")
    if counter is None:
        raise MapError("counter_object is missing: name the object that counts played points, in the frame of 6064")
    for key, pdos in ((CONTROL_WORD, received), (POINT, received), (STATUS_WORD, sent), (ERROR_CODE, sent)):
        if not any(field[0] == key for pdo in pdos for field in pdo.fields):
            raise MapError(f"eds {wire.eds}: object {_text(key)} is in no PDO: map it there")
    both = {POSITION, counter} | ({force} if force else set())
    if not any(both <= {field[0] for field in pdo.fields} for pdo in sent):
        raise MapError(
            f"eds {wire.eds}: {', '.join(map(_text, sorted(both)))} must lie in one TPDO, to be of one moment"
        )
    return NodeMap(
        node=wire.node,
        formats=formats,
        received=received,
        sent=sent,
        force=force,
        counter=counter,
        current=_named(objects, wire, "current_object"),
        buffer_points=int(_default(objects, BUFFER_POINTS) or 1),
    )


def _canopen() -> ModuleType:
    try:
        import canopen
    except ImportError as error:
        raise MapError("a CANopen map needs python-canopen: pip install 'damper-rig[canopen]'") from error
    return canopen


def _import(canopen: ModuleType, wire: CanopenWire) -> Any:
    """The object dictionary. Any: a type of an optional package."""
    try:
        return canopen.import_od(str(wire.eds), wire.node)
    except Exception as error:  # configparser's, canopen's and Python's own: all mean a damaged file
        reason = " ".join(str(error).split())[:160]
        raise MapError(f"eds {wire.eds}: cannot be read as an EDS file ({reason})") from error


def _formats(objects: Any) -> dict[Key, str]:
    """How each object of a plain type is written."""
    found: dict[Key, str] = {}
    for index in objects:
        one = objects[index]
        parts = [one[sub] for sub in one] if hasattr(one, "subindices") else [one]
        for part in parts:
            if part.data_type in FORMATS:
                found[part.index, part.subindex] = FORMATS[part.data_type]
    return found


def _pdos(objects: Any, formats: Mapping[Key, str], first: int, wire: CanopenWire) -> tuple[Pdo, ...]:
    found = []
    for number in range(MOST_PDOS):
        if first + number not in objects or first + number + 0x200 not in objects:
            continue
        identifier = int(_default(objects, (first + number, 1)) or 0)
        if identifier & 0x80000000:
            continue  # switched off
        mapping, fields, at = objects[first + number + 0x200], [], 0
        for sub in range(1, int(_default(objects, (first + number + 0x200, 0)) or 0) + 1):
            entry = int(mapping[sub].default)
            key, bits = (entry >> 16, entry >> 8 & 0xFF), entry & 0xFF
            if key not in formats or bits != 8 * struct.calcsize(formats[key]):
                raise MapError(
                    f"eds {wire.eds}: PDO {number + 1} maps {_text(key)} with {bits} bits, which is not its type"
                )
            fields.append((key, formats[key], at))
            at += bits // 8
        found.append(Pdo(identifier & 0x7FF, tuple(fields), at))
    return tuple(found)


def _default(objects: Any, key: Key) -> Any:
    index, sub = key
    if index not in objects:
        return None
    one = objects[index]
    part = one[sub] if hasattr(one, "subindices") else one
    return part.default


def _named(objects: Any, wire: CanopenWire, option: str) -> Key | None:
    name = getattr(wire, option)
    if not name:
        return None
    if name not in objects.names:
        raise MapError(f"{option} is {name!r}: {wire.eds} has no object of this name")
    return objects.names[name].index, 0


def _text(key: Key) -> str:
    return f"{key[0]:04X}:{key[1]:02X}"
