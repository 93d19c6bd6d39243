"""Service data objects: the registers of the map over CAN, two words to a frame (CiA 301, expedited transfer).

Object 0x2000 + (address >> 8), sub-index address & 0xFF, holds the two registers that begin at the address. Object
0x1003 is the error history: sub-index 0 counts, 1 … are the faults, the newest first (code, and the fault's bit << 16).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

_FRAME: Final = struct.Struct("<BHBI")
DOWNLOAD: Final = 0x23
DOWNLOADED: Final = 0x60
UPLOAD: Final = 0x40
UPLOADED: Final = 0x43
ABORT: Final = 0x80
NOT_IN_THIS_STATE: Final = 0x08000022
NO_SUCH_OBJECT: Final = 0x06020000
ERROR_HISTORY: Final = 0x10000  # the address that means object 0x1003
ABORT_TEXT: Final = {
    NOT_IN_THIS_STATE: "not possible with this value or in this state",
    NO_SUCH_OBJECT: "no such object",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Sdo:
    """One request or answer."""

    kind: int
    address: int
    value: int = 0

    def pack(self) -> bytes:
        index = 0x1003 if self.address >= ERROR_HISTORY else 0x2000 + (self.address >> 8)
        return _FRAME.pack(self.kind, index, self.address & 0xFF, self.value)


def unpack(data: bytes) -> Sdo | None:
    """Read a frame; None for one that addresses neither the register map nor the error history."""
    if len(data) != 8:
        return None
    kind, index, sub, value = _FRAME.unpack(data)
    if index == 0x1003:
        return Sdo(kind=kind, address=ERROR_HISTORY | sub, value=value)
    if not 0x2000 <= index <= 0x20FF:
        return None
    return Sdo(kind=kind, address=(index - 0x2000) << 8 | sub, value=value)
