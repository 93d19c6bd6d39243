"""Values in CAN frames: from a DBC file, or by their place in the frame."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from rigctl.errors import MapError
from rigctl.machines.roles import WRITTEN, Role
from rigctl.machines.wires import CanWire, Signal


@dataclass(frozen=True, slots=True)
class Frames:
    """The frames of a map. Any: cantools has no types."""

    messages: Mapping[int, Any]  # by identifier, offset included
    names: Mapping[Role, tuple[int, str]]  # identifier and name of the signal

    def decode(self, identifier: int, data: bytes) -> dict[Role, float]:
        """Values of one frame; empty for a frame that the map does not know."""
        message = self.messages.get(identifier)
        if message is None or len(data) < message.length:
            return {}
        values = message.decode(data[: message.length], decode_choices=False)
        return {role: float(values[name]) for role, (at, name) in self.names.items() if at == identifier}

    def encode(self, identifier: int, values: Mapping[Role, float]) -> bytes:
        """A frame with these values; signals that the map does not name are 0."""
        message = self.messages[identifier]
        found = {signal.name: 0.0 for signal in message.signals}
        found |= {name: values[role] for role, (at, name) in self.names.items() if at == identifier and role in values}
        return bytes(message.encode(found, strict=False))


def frames_of(wire: CanWire, signals: Sequence[Signal]) -> Frames:
    """Frames and signals of a map.

    Raises
    ------
    MapError
        Where the DBC file cannot be read, or does not have a message or signal that the map names.
    """
    cantools = _cantools()
    by_name = _messages_of_file(cantools, wire, signals)
    messages: dict[int, Any] = {}
    names: dict[Role, tuple[int, str]] = {}
    for one in signals:
        if one.message:
            message = by_name.get(one.message)
            if message is None:
                raise MapError(f"signal {one.role}: {wire.dbc} has no message {one.message!r}: {_some(by_name)}")
            known = [signal.name for signal in message.signals]
            if one.signal not in known:
                raise MapError(f"signal {one.role}: {one.message} has no signal {one.signal!r}: {_some(known)}")
            messages[message.frame_id + wire.id_offset] = message
            names[one.role] = (message.frame_id + wire.id_offset, one.signal)
    for identifier, message in _own_messages(cantools, signals).items():
        if identifier + wire.id_offset in messages:
            raise MapError(f"id {identifier}: the DBC file describes this frame, name its message instead")
        messages[identifier + wire.id_offset] = message
    names |= {one.role: (one.id + wire.id_offset, str(one.role)) for one in signals if one.id is not None}
    _check_directions(names)
    return Frames(messages, names)


def check_signals(wire: CanWire, signals: Sequence[Signal]) -> None:
    """Raise MapError where the signals of a map do not fit its DBC file."""
    frames_of(wire, signals)


def _cantools() -> ModuleType:
    try:
        import cantools
    except ImportError as error:
        raise MapError("a map of CAN frames needs cantools: pip install 'damper-rig[dbc]'") from error
    return cantools


def _messages_of_file(cantools: Any, wire: CanWire, signals: Sequence[Signal]) -> dict[str, Any]:
    if wire.dbc is None:
        if any(one.message for one in signals):
            raise MapError("dbc is missing: signals are named by their message, give the file that describes it")
        return {}
    try:
        database = cantools.database.load_file(wire.dbc, database_format="dbc", strict=True)
    except (OSError, ValueError, cantools.database.errors.Error) as error:
        reason = " ".join(str(error).split())[:160]
        raise MapError(f"dbc {wire.dbc}: cannot be read as a DBC file ({reason})") from error
    return {message.name: message for message in database.messages}


def _own_messages(cantools: Any, signals: Iterable[Signal]) -> dict[int, Any]:
    """Messages made of the signals that are described in the map itself."""
    from cantools.database.conversion import BaseConversion

    parts: dict[int, list[Any]] = defaultdict(list)
    for one in signals:
        if one.id is not None:
            parts[one.id].append(
                cantools.database.can.Signal(
                    name=str(one.role),
                    start=one.start_bit,
                    length=one.bits,
                    byte_order="little_endian" if one.order == "low_first" else "big_endian",
                    is_signed=one.signed,
                    conversion=BaseConversion.factory(scale=one.scale, offset=one.offset, is_float=one.real),
                )
            )
    made = {}
    for identifier, found in parts.items():
        try:
            made[identifier] = cantools.database.can.Message(
                identifier, f"frame_{identifier:X}", 8, found, is_extended_frame=identifier > 0x7FF, strict=True
            )
        except cantools.database.errors.Error as error:
            raise MapError(f"id {identifier}: {' '.join(str(error).split())}") from error
    return made


def _check_directions(names: Mapping[Role, tuple[int, str]]) -> None:
    """A frame is sent by one side: what the host writes and what it reads must not share one."""
    written = {at: role for role, (at, _) in names.items() if role in WRITTEN}
    for role, (at, _) in names.items():
        if role not in WRITTEN and at in written:
            raise MapError(f"frame {at}: the host sends {written[at]} and reads {role} in it: one side sends a frame")


def _some(names: Iterable[str]) -> str:
    found = sorted(str(name) for name in names)
    return f"it has {', '.join(found[:8])}{', …' if len(found) > 8 else ''}"
