"""The first bytes of an HDF5 file, read without the HDF5 library.

Superblock (HDF5 File Format Specification, version 3.0, section II.A): versions 0 and 1 name the block of a multi-file
driver, versions 2 and 3 an extension.
"""

from __future__ import annotations

from typing import Final

from excitation.errors import ExcitationFileError

__all__ = ["SUPERBLOCK_BYTES", "check_superblock"]

SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
SUPERBLOCK_BYTES: Final = 96  # of the longest version
_NOWHERE: Final = b"\xff" * 8
_OLD_FIRST_ADDRESS: Final = {0: 24, 1: 28}
_NEW_FIRST_ADDRESS: Final = 12


def check_superblock(start: bytes) -> None:
    """Raise ExcitationFileError for what is no HDF5 file, has a user block, or is a part of a file of several."""
    if not start.startswith(SIGNATURE):
        raise ExcitationFileError(
            "damaged or not an HDF5 file, or one with a user block: it must begin with the HDF5 signature"
        )
    if len(start) < SUPERBLOCK_BYTES:
        raise ExcitationFileError(f"damaged or not an HDF5 file ({len(start)} bytes): it is cut off")
    version = start[8]
    if version > 3:
        raise ExcitationFileError(f"damaged or not an HDF5 file (superblock version {version}): it must be 0 … 3")
    sizes = start[13:15] if version < 2 else start[9:11]
    if sizes != b"\x08\x08":
        raise ExcitationFileError(
            f"superblock: addresses and lengths have {sizes[0]} and {sizes[1]} bytes: they must have 8"
        )
    first = _OLD_FIRST_ADDRESS.get(version, _NEW_FIRST_ADDRESS)
    base = int.from_bytes(start[first : first + 8], "little")
    if base:
        raise ExcitationFileError(f"superblock: a user block of {base} bytes: the file must begin with HDF5's own data")
    if version < 2 and start[first + 24 : first + 32] != _NOWHERE:
        raise ExcitationFileError("superblock: a file of several (driver information): a run must be one file")
