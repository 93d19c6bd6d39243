"""The CAN frames of node 1: identifiers and byte layouts, little-endian; as in the DBC files of this folder."""

from __future__ import annotations

import binascii
import struct
import zlib
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl import scaling
from rigctl.device import Fault
from rigctl.packing import from_counts, to_counts

NODE: Final = 1
NMT: Final = 0x000
EMERGENCY: Final = 0x080 + NODE
STATUS: Final = 0x180 + NODE
CONTROL: Final = 0x200 + NODE
HEALTH: Final = 0x280 + NODE
DIRECT: Final = 0x300 + NODE
CAPTURE: Final = 0x380 + NODE
STREAM: Final = 0x400 + NODE
CAPTURE_B: Final = 0x480 + NODE
COMMIT: Final = 0x500 + NODE
SDO_ANSWER: Final = 0x580 + NODE
SDO_REQUEST: Final = 0x600 + NODE
RIG_HEARTBEAT: Final = 0x700 + NODE
HOST_HEARTBEAT: Final = 0x77F

BOOT_UP: Final = 0x00  # states in a heartbeat (CiA 301)
STOPPED: Final = 0x04
OPERATIONAL: Final = 0x05
PRE_OPERATIONAL: Final = 0x7F
NMT_START: Final = 0x01
NMT_STOP: Final = 0x02
HEARTBEAT_S: Final = 0.05

CLASSIC_BLOCK: Final = 256  # set-points between two commits
FD_BLOCK: Final = 9  # set-points in one frame
FD_CAPTURE: Final = 4  # captured samples in one frame
END: Final = 0x8000
FD_END: Final = 0x80
AGAIN: Final = 1 << 31  # bit of an acknowledgement of captured samples: send again from there

_ROW = np.dtype([("displacement_m", "<i4"), ("current_a", "<i2")])
_SAMPLE = np.dtype(
    [
        ("force_n", "<i4"),
        ("displacement_m", "<i4"),
        ("current_a", "<i2"),
        ("temperature_degc", "<i2"),
        ("pressure_pa", "<u2"),
    ]
)


@dataclass(frozen=True, slots=True, kw_only=True)
class StatusFrame:
    """Status, 0x180 + N: sent when anything in it changes, and every 10 ms."""

    state: int  # bits D, H, M, R
    arrived: bool
    refused: bool  # the last block; set until one is accepted
    faults: int
    fifo_level: int
    last_accepted: int


def crc8(data: bytes) -> int:
    """CRC-8 of SAE J1850: polynomial 0x1D, start and final inversion 0xFF."""
    crc = 0xFF
    for byte in data:
        crc = _CRC8[crc ^ byte]
    return crc ^ 0xFF


def _crc8_of(byte: int) -> int:
    for _ in range(8):
        byte = ((byte << 1) ^ 0x1D) & 0xFF if byte & 0x80 else byte << 1
    return byte


_CRC8: Final = tuple(_crc8_of(byte) for byte in range(256))


def pack_status(status: StatusFrame) -> bytes:
    word = status.state | status.arrived << 4 | status.refused << 5
    return struct.pack("<HHHH", word, status.faults, status.fifo_level, status.last_accepted)


def unpack_status(data: bytes) -> StatusFrame:
    word, faults, level, accepted = struct.unpack("<HHHH", data)
    return StatusFrame(
        state=word & 0xF,
        arrived=bool(word & 0x10),
        refused=bool(word & 0x20),
        faults=faults,
        fifo_level=level,
        last_accepted=accepted,
    )


EMERGENCY_CODES: Final = {  # CiA 301 and 402; other faults have a manufacturer's code, 0xFF00 + bit
    Fault.HEARTBEAT: 0x8130,
    Fault.FOLLOWING_ERROR: 0x8611,
    Fault.POSITION_LIMIT: 0x8600,
    Fault.VELOCITY_LIMIT: 0x8400,
    Fault.TEMPERATURE: 0x4200,
    Fault.SENSOR: 0x5000,
    Fault.EMERGENCY_STOP: 0x9000,
}


def pack_emergency(fault: Fault, sample_index: int) -> bytes:
    """Emergency frame of the first fault; no fault: the last one is over. Error register: bit 0, generic."""
    if not fault:
        return struct.pack("<HBBI", 0, 0, 0, sample_index % 2**32)
    entry = error_entry(fault)
    return struct.pack("<HBBI", entry & 0xFFFF, 1, entry >> 16, sample_index % 2**32)


def error_entry(fault: Fault) -> int:
    """Return a fault as an entry of the error history: its code, and its bit << 16."""
    bit = int(fault).bit_length() - 1
    return EMERGENCY_CODES.get(fault, 0xFF00 + bit) | bit << 16


def pack_control(control: int, run_id: int, alive: int) -> bytes:
    head = struct.pack("<HbBHB", control, 0, 0, run_id, alive)
    return head + bytes([crc8(head)])


def unpack_control(data: bytes) -> tuple[int, int, int] | None:
    """Return control word, run id and alive counter; None where the CRC is wrong."""
    if len(data) != 8 or crc8(data[:7]) != data[7]:
        return None
    control, _, _, run_id, alive = struct.unpack("<HbBHB", data[:7])
    return control, run_id, alive


def pack_direct(displacement_m: float, current_a: float, sequence: int) -> bytes:
    position, current = round(displacement_m / scaling.DISPLACEMENT_M), round(current_a / scaling.CURRENT_A)
    return struct.pack("<ihH", position, current, sequence)


def unpack_direct(data: bytes) -> tuple[float, float, int]:
    position, current, sequence = struct.unpack("<ihH", data)
    return position * scaling.DISPLACEMENT_M, current * scaling.CURRENT_A, sequence


def pack_health(temperature_degc: float, pressure_pa: float, consumed: int) -> bytes:
    temperature = round(temperature_degc / scaling.TEMPERATURE_DEGC)
    return struct.pack("<hHI", temperature, round(pressure_pa / scaling.PRESSURE_PA), consumed)


def unpack_health(data: bytes) -> tuple[float, float, int]:
    temperature, pressure, consumed = struct.unpack("<hHI", data)
    return temperature * scaling.TEMPERATURE_DEGC, pressure * scaling.PRESSURE_PA, consumed


def pack_stream(rows: NDArray[np.float64], sequence: int, run_id: int, end: bool) -> list[tuple[int, bytes]]:
    """Classic: one frame for each set-point, numbered from 0, then the commit with the CRC-32 of all of them."""
    whole = to_counts(rows, _ROW, scaling.SETPOINT).tobytes()
    frames = [(STREAM, struct.pack("<H", k) + whole[6 * k : 6 * k + 6]) for k in range(rows.shape[0])]
    count = rows.shape[0] | (END if end else 0)
    return [*frames, (COMMIT, struct.pack("<HHI", sequence, count, zlib.crc32(whole, run_id)))]


def unpack_stream(frames: dict[int, bytes], commit: bytes, run_id: int) -> tuple[NDArray[np.float64], int, bool] | None:
    """Return the set-points of a block, its sequence number, and whether it is the last; None where it is damaged."""
    sequence, count, crc = struct.unpack("<HHI", commit)
    number = count & ~END
    whole = b"".join(frames.get(k, b"") for k in range(number))
    if len(whole) != 6 * number or zlib.crc32(whole, run_id) != crc:
        return None
    return from_counts(np.frombuffer(whole, dtype=_ROW), scaling.SETPOINT), sequence, bool(count & END)


def pack_stream_fd(rows: NDArray[np.float64], sequence: int, run_id: int, end: bool) -> list[tuple[int, bytes]]:
    """FD: up to nine set-points in each frame of 64 bytes, numbered one after the other."""
    whole, size = to_counts(rows, _ROW, scaling.SETPOINT).tobytes(), _ROW.itemsize
    frames = []
    for k in range(0, rows.shape[0], FD_BLOCK):
        left = rows.shape[0] - k
        last = FD_END if end and left <= FD_BLOCK else 0
        head = struct.pack("<HB", (sequence + k // FD_BLOCK) % 0x10000, min(left, FD_BLOCK) | last)
        body = whole[size * k : size * (k + FD_BLOCK)].ljust(size * FD_BLOCK, b"\0")
        data = head + bytes([crc8(head)]) + body + struct.pack("<H", run_id)
        frames.append((STREAM, (data + struct.pack("<H", binascii.crc_hqx(data, 0xFFFF))).ljust(64, b"\0")))
    return frames


def unpack_stream_fd(data: bytes) -> tuple[NDArray[np.float64], int, int, bool] | None:
    """Return set-points, sequence number, run id, last or not; None where the frame is damaged."""
    if len(data) != 64 or binascii.crc_hqx(data[:60], 0xFFFF) != struct.unpack_from("<H", data, 60)[0]:
        return None
    sequence, number = struct.unpack_from("<HB", data)
    count = number & ~FD_END
    if count > FD_BLOCK:
        return None
    rows = from_counts(np.frombuffer(data, dtype=_ROW, count=count, offset=4), scaling.SETPOINT)
    return rows, sequence, struct.unpack_from("<H", data, 58)[0], bool(number & FD_END)


def pack_capture(values: NDArray[np.float64], first_index: int) -> list[tuple[int, bytes]]:
    """Classic: two frames for each sample, numbered modulo 65 536; the pressure travels in the health frame."""
    packed = to_counts(values, _SAMPLE, scaling.CAPTURE)
    frames = []
    for k, (force, x, current, temperature, _) in enumerate(packed.tolist()):
        number = (first_index + k) % 0x10000
        frames.append((CAPTURE, struct.pack("<Hih", number, force, current)))
        frames.append((CAPTURE_B, struct.pack("<Hih", number, x, temperature)))
    return frames


def unpack_capture(a: bytes, b: bytes, pressure_pa: float) -> tuple[int, NDArray[np.float64]] | None:
    """Return number and values of a sample; None where its two frames do not belong together."""
    number, force, current = struct.unpack("<Hih", a)
    other, x, temperature = struct.unpack("<Hih", b)
    if number != other:
        return None
    counts = np.array([force, x, current, temperature, 0.0])
    values: NDArray[np.float64] = counts * np.array(scaling.CAPTURE)
    values[4] = pressure_pa
    return number, values


def pack_capture_fd(values: NDArray[np.float64], first_index: int) -> list[tuple[int, bytes]]:
    """FD: up to four samples in each frame of 64 bytes."""
    whole, size = to_counts(values, _SAMPLE, scaling.CAPTURE).tobytes(), _SAMPLE.itemsize
    frames = []
    for k in range(0, values.shape[0], FD_CAPTURE):
        body = whole[size * k : size * (k + FD_CAPTURE)].ljust(size * FD_CAPTURE, b"\0")
        head = struct.pack("<IBB", first_index + k, min(values.shape[0] - k, FD_CAPTURE), 0)
        frames.append((CAPTURE, head + struct.pack("<H", binascii.crc_hqx(head + body, 0xFFFF)) + body))
    return frames


def unpack_capture_fd(data: bytes) -> tuple[int, NDArray[np.float64]] | None:
    """Return the first index and the samples; None where the frame is damaged."""
    if len(data) != 64:
        return None
    first, count, _, crc = struct.unpack_from("<IBBH", data)
    if count > FD_CAPTURE or binascii.crc_hqx(data[:6] + data[8:], 0xFFFF) != crc:
        return None
    return first, from_counts(np.frombuffer(data, dtype=_SAMPLE, count=count, offset=8), scaling.CAPTURE)
