"""Channels of further axes on CAN: 24 bits each, beside the frames of the captured samples; little-endian.

Classic: five frames of a sample, two channels in each, numbered as its other frames. FD: one frame of two samples. They
are sent only where the configuration asks for them.
"""

from __future__ import annotations

import binascii
import struct
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl import scaling
from rigctl.can_frames import CAPTURE_NUMBERS, NODE
from rigctl.session import nearest

FURTHER: Final = tuple(0x680 + 0x10 * k + NODE for k in range(5))
"""Identifiers; FD uses the first. CiA 301 leaves 0x680 … 0x6DF free."""
FD_SAMPLES: Final = 2  # in one frame
_WIDTH: Final = 3  # bytes of a channel: ±0.8 m, ±8 rad, ±800 kN, ±80 kN·m
_MOST: Final = 1 << (8 * _WIDTH - 1)
_SAMPLE: Final = _WIDTH * len(scaling.FURTHER)
_LSB: Final = np.array(scaling.FURTHER)
_FD_NUMBERS: Final = 1 << 15
_TWO: Final = 0x8000  # of the number in an FD frame: it holds two samples


def pack_further(values: NDArray[np.float64], first_index: int, *, run_id: int) -> list[tuple[int, bytes]]:
    """Classic: the frames of samples, (n, 10), with the number that `pack_capture` gives each."""
    frames = []
    for k, row in enumerate(_packed(values)):
        number = struct.pack("<H", (first_index + k) % CAPTURE_NUMBERS | (run_id & 0xF) << 12)
        frames += [(identifier, number + row[6 * part : 6 * part + 6]) for part, identifier in enumerate(FURTHER)]
    return frames


def unpack_further(
    parts: Mapping[int, bytes], *, run_id: int, following: int
) -> tuple[int, NDArray[np.float64]] | None:
    """Index and channels, (1, 10), of the frames of a sample by identifier; None where they are not all of one."""
    of_sample = [parts.get(identifier, b"") for identifier in FURTHER]
    if any(len(data) != 8 or data[:2] != of_sample[0][:2] for data in of_sample):
        return None
    number = int.from_bytes(of_sample[0][:2], "little")
    if number >> 12 != run_id & 0xF:
        return None
    whole = b"".join(data[2:] for data in of_sample)
    return nearest(number & CAPTURE_NUMBERS - 1, following, CAPTURE_NUMBERS), _unpacked(whole)


def pack_further_fd(values: NDArray[np.float64], first_index: int, *, run_id: int) -> list[tuple[int, bytes]]:
    """FD: two samples in each frame of 64 bytes; the check covers the whole index and the run's number."""
    rows, frames = _packed(values), []
    for k in range(0, len(rows), FD_SAMPLES):
        two, first = rows[k : k + FD_SAMPLES], first_index + k
        body = b"".join(two).ljust(FD_SAMPLES * _SAMPLE, b"\0")
        number = first % _FD_NUMBERS | (_TWO if len(two) == FD_SAMPLES else 0)
        frames.append((FURTHER[0], struct.pack("<HH", number, _check(number, first, run_id, body)) + body))
    return frames


def unpack_further_fd(data: bytes, *, run_id: int, following: int) -> tuple[int, NDArray[np.float64]] | None:
    """First index and channels, (n, 10); None where the frame is damaged or belongs to another run."""
    if len(data) != 4 + FD_SAMPLES * _SAMPLE:
        return None
    number, check = struct.unpack_from("<HH", data)
    first, body = nearest(number & _FD_NUMBERS - 1, following, _FD_NUMBERS), data[4:]
    if check != _check(number, first, run_id, body):
        return None
    return first, _unpacked(body if number & _TWO else body[:_SAMPLE])


def _check(number: int, first: int, run_id: int, body: bytes) -> int:
    return binascii.crc_hqx(struct.pack("<HIH", number, first % 2**32, run_id) + body, 0xFFFF)


def _packed(values: NDArray[np.float64]) -> list[bytes]:
    """Each sample as bytes; OverflowError where a channel does not fit."""
    counts = np.rint(values / _LSB)
    if counts.size and not (counts.min() >= -_MOST and counts.max() < _MOST):
        raise OverflowError(f"a channel of a further axis does not fit {8 * _WIDTH} bits")
    octets = counts.astype("<i4").view(np.uint8).reshape(values.shape[0], len(scaling.FURTHER), 4)
    return [row.tobytes() for row in octets[:, :, :_WIDTH]]


def _unpacked(whole: bytes) -> NDArray[np.float64]:
    counts = [int.from_bytes(whole[k : k + _WIDTH], "little", signed=True) for k in range(0, len(whole), _WIDTH)]
    values: NDArray[np.float64] = np.array(counts).reshape(-1, len(scaling.FURTHER)) * _LSB
    return values
