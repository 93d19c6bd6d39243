"""One value of a foreign register map: where it is, how it is written in words, and what it means."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, ClassVar, Final, Literal, TypeAlias

from excitation.configuration import STRICT
from rigctl.errors import MapError
from rigctl.machines.roles import ARRAYS, WRITTEN, Role

Order: TypeAlias = Literal["high_first", "low_first"]
RegisterType: TypeAlias = Literal["bit", "u16", "i16", "u32", "i32", "real", "lreal"]

_FORMAT: Final = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "real": ">f", "lreal": ">d"}
COILS, DISCRETE, HOLDING, INPUT = 1, 2, 3, 4
ADDRESSES: Final = 0x10000


@dataclass(frozen=True, slots=True, kw_only=True)
class Register:
    """A value at an address. SI value = count · scale + offset.

    `function` is the Modbus function code that reads it: 1 coils, 2 discrete inputs, 3 holding, 4 input registers.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    role: Role
    address: int
    function: Literal[1, 2, 3, 4] = 3
    type: RegisterType = "u16"
    bit: int | None = None  # of a word that holds several
    scale: float = 1.0
    offset: float = 0.0
    count: int = 1  # of values, one after the other
    unit: int | None = None  # where it differs from the map's
    word_order: Order | None = None
    byte_order: Order | None = None

    def __post_init__(self) -> None:
        where = f"register {self.role} at {self.address}"
        if not self.address >= 0 or self.end > ADDRESSES:
            raise MapError(f"{where}: it must lie in 0 … {ADDRESSES - 1} with all its words")
        if self.role in WRITTEN and self.function in (DISCRETE, INPUT):
            raise MapError(f"{where}: function {self.function} can only be read, the host writes this: use 3 or 1")
        if not (isfinite(self.scale) and self.scale != 0 and isfinite(self.offset)):
            raise MapError(f"{where}: scale is {self.scale}, offset {self.offset}: finite, and scale not 0")
        if not 1 <= self.count <= 120:
            raise MapError(f"{where}: count is {self.count}: it must lie in 1 … 120")
        if self.count > 1 and self.role not in ARRAYS:
            raise MapError(f"{where}: count is {self.count}: only {', '.join(sorted(ARRAYS))} are arrays")
        _check_bit(self, where)
        if self.unit is not None and not 0 <= self.unit <= 247:
            raise MapError(f"{where}: unit is {self.unit}: it must lie in 0 … 247")

    @property
    def is_coil(self) -> bool:
        """Whether it is one bit with an address of its own."""
        return self.function in (COILS, DISCRETE)

    @property
    def words(self) -> int:
        """Registers of one value; 1 for a bit."""
        return 1 if self.type == "bit" else struct.calcsize(_FORMAT[self.type]) // 2

    @property
    def end(self) -> int:
        """Address behind its last word."""
        return self.address + self.words * self.count


def _check_bit(register: Register, where: str) -> None:
    if register.type != "bit":
        if register.is_coil or register.bit is not None:
            raise MapError(f"{where}: type is {register.type}: coils, and registers with a bit, are of type bit")
    elif register.is_coil and register.bit is not None:
        raise MapError(f"{where}: bit is {register.bit}: a coil is one bit, leave it out")
    elif not register.is_coil and (register.bit is None or not 0 <= register.bit <= 15):
        raise MapError(f"{where}: bit is {register.bit}: say which of 0 … 15")


@dataclass(frozen=True, slots=True)
class Orders:
    """How a map writes a value of several words."""

    word: Order
    byte: Order


def encode(register: Register, value: float, orders: Orders) -> list[int]:
    """Turn an SI value into words, high byte first inside this program.

    >>> encode(Register(role=Role.SETPOINT, address=0, type="real"), 1.0, Orders("low_first", "high_first"))
    [0, 16256]
    """
    count = (value - register.offset) / register.scale
    exact = register.type in ("real", "lreal")
    try:
        raw = struct.pack(_FORMAT[register.type], count if exact else round(count))
    except (struct.error, OverflowError) as error:
        raise MapError(
            f"register {register.role} at {register.address}: {value:g} does not fit {register.type}"
        ) from error
    return _ordered([int.from_bytes(raw[k : k + 2]) for k in range(0, len(raw), 2)], orders)


def decode(register: Register, words: Sequence[int], orders: Orders) -> float:
    """Turn words into an SI value.

    >>> place = Register(role=Role.POSITION, address=0, type="i16", scale=1e-4)
    >>> decode(place, [65535], Orders("high_first", "high_first"))
    -0.0001
    """
    if register.type == "bit":
        return float(words[0] >> (register.bit or 0) & 1)
    raw = b"".join(word.to_bytes(2) for word in _ordered(words, orders))
    count: float = struct.unpack(_FORMAT[register.type], raw)[0]
    return count * register.scale + register.offset


def _ordered(words: Sequence[int], orders: Orders) -> list[int]:
    """Words in the other order, bytes in the other order; its own inverse."""
    found = [(word & 0xFF) << 8 | word >> 8 for word in words] if orders.byte == "low_first" else list(words)
    return found[::-1] if orders.word == "low_first" else found
