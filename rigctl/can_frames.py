"""The CAN frames of node 1, map version 3: identifiers and byte layouts, little-endian; as in this folder's DBC files.

Set-points and commands are checked over the session and the run that they belong to: a frame of an earlier session or
run is a damaged one. They are also checked over their whole number, of which 16 bits travel: a frame that is 65 536
numbers late is a damaged one too.
"""

from __future__ import annotations

import binascii
import struct
import zlib
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl import scaling
from rigctl.device import Fault, PressureStage
from rigctl.packing import from_counts, to_counts
from rigctl.session import nearest

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
CAPTURE_NUMBERS: Final = 1 << 12  # classic captured samples are counted modulo this
MODE_PROGRAM: Final = 0
MODE_TRAVEL: Final = 1
MODE_JOG: Final = 2
CAPTURED_BITS: Final = 24  # of the count in an acknowledgement; above it seven bits of the run's number

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
    stage: PressureStage
    session: int  # its low four bits, which are 0 only where nobody commands the rig
    run_id: int  # low four bits of the run that fifo_level and last_accepted belong to


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
    word = status.state | status.arrived << 4 | status.refused << 5 | status.stage.value << 6
    word |= (status.session & 0xF) << 8 | (status.run_id & 0xF) << 12
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
        stage=PressureStage(min(word >> 6 & 3, PressureStage.HIGH.value)),
        session=word >> 8 & 0xF,
        run_id=word >> 12,
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlFrame:
    """Control, 0x200 + N: one command. DISABLE with session 0 is a stop, which the rig obeys from anybody."""

    control: int
    mode: int = (
        MODE_PROGRAM  # MODE_TRAVEL, MODE_JOG: to the direct set-point that was sent just before, with this number
    )
    session: int
    run_id: int
    number: int

    def pack(self, direct: bytes = b"") -> bytes:
        """Make the frame's bytes; the CRC-8 covers the direct set-point that belongs to it as well."""
        head = struct.pack("<BHHH", self.control | self.mode << 4, self.session, self.run_id, self.number)
        return head + bytes([crc8(head + direct)])


def unpack_control(data: bytes, direct: bytes = b"") -> ControlFrame | None:
    """Read a command; None where the CRC over it, and over the direct set-point that belongs to it, is wrong."""
    if len(data) != 8:
        return None
    word, session, run_id, number = struct.unpack("<BHHH", data[:7])
    mode = word >> 4
    if crc8(data[:7] + (direct if mode in (MODE_TRAVEL, MODE_JOG) else b"")) != data[7]:
        return None
    return ControlFrame(control=word & 0xF, mode=mode, session=session, run_id=run_id, number=number)


def pack_host_heartbeat(session: int, number: int) -> bytes:
    """Host's heartbeat: NMT state, session, and a number that is higher every time."""
    return struct.pack("<BHH", OPERATIONAL, session, number)


def unpack_host_heartbeat(data: bytes) -> tuple[int, int] | None:
    """Return session and number; None for another frame or an NMT state that is not OPERATIONAL."""
    if len(data) != 5 or data[0] != OPERATIONAL:
        return None
    _, session, number = struct.unpack("<BHH", data)
    return session, number


def captured_word(captured: int, run_id: int, *, again: bool) -> int:
    """Acknowledgement of captured samples: their count modulo 2^24, seven bits of the run, again or not."""
    return captured % (1 << CAPTURED_BITS) | (run_id & 0x7F) << CAPTURED_BITS | (AGAIN if again else 0)


def captured_from(word: int, run_id: int, first_index: int) -> int | None:
    """Return the count that an acknowledgement means, the nearest to `first_index`; None where it is another run's."""
    if word >> CAPTURED_BITS & 0x7F != run_id & 0x7F:
        return None
    return nearest(word, first_index, 1 << CAPTURED_BITS)


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


def _owner(session: int, run_id: int) -> int:
    """Start of a CRC-32: a block belongs to one run of one session."""
    return session << 16 | run_id


def _turn(sequence: int) -> bytes:
    """The part of a number that does not travel: it ends a check."""
    return struct.pack("<H", sequence >> 16 & 0xFFFF)


def pack_stream(
    rows: NDArray[np.float64], sequence: int, run_id: int, end: bool, *, session: int
) -> list[tuple[int, bytes]]:
    """Classic: one frame for each set-point, numbered from 0, then the commit with the CRC-32 of all of them."""
    whole = to_counts(rows, _ROW, scaling.SETPOINT).tobytes()
    frames = [(STREAM, struct.pack("<H", k) + whole[6 * k : 6 * k + 6]) for k in range(rows.shape[0])]
    count = rows.shape[0] | (END if end else 0)
    head = struct.pack("<HH", sequence & 0xFFFF, count)
    commit = head + struct.pack("<I", zlib.crc32(whole + head + _turn(sequence), _owner(session, run_id)))
    return [*frames, (COMMIT, commit)]


def unpack_stream(
    frames: dict[int, bytes], commit: bytes, run_id: int, *, session: int, following: int
) -> tuple[NDArray[np.float64], int, bool] | None:
    """Return the set-points of a block, its sequence number, and whether it is the last; None where it is damaged.

    The number is the one nearest to `following` that the frame's 16 bits may mean.
    """
    sequence, count, crc = struct.unpack("<HHI", commit)
    sequence = nearest(sequence, following, 1 << 16)
    number = count & ~END
    whole = b"".join(frames.get(k, b"") for k in range(number))
    checked = whole + commit[:4] + _turn(sequence)
    if len(whole) != 6 * number or zlib.crc32(checked, _owner(session, run_id)) != crc:
        return None
    return from_counts(np.frombuffer(whole, dtype=_ROW), scaling.SETPOINT), sequence, bool(count & END)


def pack_stream_fd(
    rows: NDArray[np.float64], sequence: int, run_id: int, end: bool, *, session: int
) -> list[tuple[int, bytes]]:
    """FD: up to nine set-points in each frame of 64 bytes, numbered one after the other."""
    whole, size = to_counts(rows, _ROW, scaling.SETPOINT).tobytes(), _ROW.itemsize
    frames = []
    for k in range(0, rows.shape[0], FD_BLOCK):
        left = rows.shape[0] - k
        last = FD_END if end and left <= FD_BLOCK else 0
        number = sequence + k // FD_BLOCK
        head = struct.pack("<HB", number & 0xFFFF, min(left, FD_BLOCK) | last)
        body = whole[size * k : size * (k + FD_BLOCK)].ljust(size * FD_BLOCK, b"\0")
        data = head + bytes([crc8(head)]) + body + struct.pack("<HH", run_id, session)
        frames.append((STREAM, data + struct.pack("<H", binascii.crc_hqx(data + _turn(number), 0xFFFF))))
    return frames


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamFrame:
    """Set-points of an FD frame."""

    rows: NDArray[np.float64]  # (n, 2): displacement m, current A
    sequence: int
    run_id: int
    session: int
    end: bool


def unpack_stream_fd(data: bytes, *, following: int) -> StreamFrame | None:
    """Read set-points; None where the frame is damaged. Its number is the one nearest to `following`."""
    if len(data) != 64:
        return None
    sequence, number = struct.unpack_from("<HB", data)
    sequence = nearest(sequence, following, 1 << 16)
    if binascii.crc_hqx(data[:62] + _turn(sequence), 0xFFFF) != struct.unpack_from("<H", data, 62)[0]:
        return None
    count = number & ~FD_END
    if count > FD_BLOCK:
        return None
    run_id, session = struct.unpack_from("<HH", data, 58)
    rows = from_counts(np.frombuffer(data, dtype=_ROW, count=count, offset=4), scaling.SETPOINT)
    return StreamFrame(rows=rows, sequence=sequence, run_id=run_id, session=session, end=bool(number & FD_END))


def pack_capture(values: NDArray[np.float64], first_index: int, *, run_id: int) -> list[tuple[int, bytes]]:
    """Classic: two frames for each sample, numbered modulo 4 096, with four bits of the run's number.

    The pressure travels in the health frame.
    """
    packed = to_counts(values, _SAMPLE, scaling.CAPTURE)
    frames = []
    for k, (force, x, current, temperature, _) in enumerate(packed.tolist()):
        number = (first_index + k) % CAPTURE_NUMBERS | (run_id & 0xF) << 12
        frames.append((CAPTURE, struct.pack("<Hih", number, force, current)))
        frames.append((CAPTURE_B, struct.pack("<Hih", number, x, temperature)))
    return frames


def unpack_capture(
    a: bytes, b: bytes, pressure_pa: float, *, run_id: int, following: int
) -> tuple[int, NDArray[np.float64]] | None:
    """Return index and values of a sample, (1, 5); None where its frames belong to two samples or to another run.

    The index is the one nearest to `following` that the frames' number may mean.
    """
    number, force, current = struct.unpack("<Hih", a)
    other, x, temperature = struct.unpack("<Hih", b)
    if number != other or number >> 12 != run_id & 0xF:
        return None
    counts = np.array([[force, x, current, temperature, 0.0]])
    values: NDArray[np.float64] = counts * np.array(scaling.CAPTURE)
    values[0, 4] = pressure_pa
    return nearest(number, following, CAPTURE_NUMBERS), values


def pack_capture_fd(values: NDArray[np.float64], first_index: int, *, run_id: int) -> list[tuple[int, bytes]]:
    """FD: up to four samples in each frame of 64 bytes, with the low byte of the run's number."""
    whole, size = to_counts(values, _SAMPLE, scaling.CAPTURE).tobytes(), _SAMPLE.itemsize
    frames = []
    for k in range(0, values.shape[0], FD_CAPTURE):
        body = whole[size * k : size * (k + FD_CAPTURE)].ljust(size * FD_CAPTURE, b"\0")
        head = struct.pack("<IBB", first_index + k, min(values.shape[0] - k, FD_CAPTURE), run_id & 0xFF)
        frames.append((CAPTURE, head + struct.pack("<H", binascii.crc_hqx(head + body, 0xFFFF)) + body))
    return frames


def unpack_capture_fd(data: bytes, *, run_id: int) -> tuple[int, NDArray[np.float64]] | None:
    """Return the first index and the samples; None where the frame is damaged or belongs to another run."""
    if len(data) != 64:
        return None
    first, count, run, crc = struct.unpack_from("<IBBH", data)
    if count > FD_CAPTURE or run != run_id & 0xFF or binascii.crc_hqx(data[:6] + data[8:], 0xFFFF) != crc:
        return None
    return first, from_counts(np.frombuffer(data, dtype=_SAMPLE, count=count, offset=8), scaling.CAPTURE)
