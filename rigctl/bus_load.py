"""The load of a CAN bus with worst-case bit stuffing; a sample rate that overloads it is refused."""

from __future__ import annotations

from math import ceil
from typing import Final

from rigctl.can_frames import CLASSIC_BLOCK, FD_BLOCK, FD_CAPTURE
from rigctl.can_further import FD_SAMPLES, FURTHER
from rigctl.errors import LimitError

LARGEST: Final = 0.7  # of the bus: the usual rule
STATUS_HZ: Final = 100.0 + 10.0 + 50.0 + 2 * 20.0  # status, health, requests, two heartbeats


def classic_frame_bits(data_bytes: int) -> int:
    """Bits of a classic frame with an 11-bit identifier and the interframe space, worst case.

    47 + 8·n + floor((34 + 8·n − 1)/4): Davis, Burns, Bril & Lukkien, Real-Time Systems 35, 2007.
    """
    return 47 + 8 * data_bytes + (34 + 8 * data_bytes - 1) // 4


def fd_frame_s(data_bytes: int, bitrate: float, data_bitrate: float) -> float:
    """Seconds of an FD frame with bit-rate switching, worst case (ISO 11898-1:2015 field lengths).

    Arbitration: SOF, identifier, RRS, IDE, FDF, res, BRS (17 bits and up to 3 stuffed), then CRC delimiter, ACK,
    EOF and interframe space (13). Data phase: ESI, DLC, data with stuffing, stuff count, CRC with fixed stuffing.
    """
    crc = 17 if data_bytes <= 16 else 21
    payload = 5 + 8 * data_bytes
    fast = payload + payload // 4 + 4 + crc + ceil((4 + crc) / 4)
    return (17 + 3 + 13) / bitrate + fast / data_bitrate


def bus_load(
    sample_rate_hz: float, *, fd: bool, bitrate: float, data_bitrate: float, further_axes: bool = False
) -> float:
    """Share of the bus that streaming and capture at a sample rate need, 0 … 1 and beyond."""
    if fd:
        blocks = sample_rate_hz * (1 / FD_BLOCK + 1 / FD_CAPTURE + further_axes / FD_SAMPLES)
        return blocks * fd_frame_s(64, bitrate, data_bitrate) + STATUS_HZ * fd_frame_s(8, bitrate, data_bitrate)
    frames = sample_rate_hz * (1 + 2 + 1 / CLASSIC_BLOCK + further_axes * len(FURTHER)) + STATUS_HZ
    return frames * classic_frame_bits(8) / bitrate


def check_bus(
    sample_rate_hz: float, *, fd: bool, bitrate: float, data_bitrate: float, further_axes: bool = False
) -> None:
    """Refuse a sample rate that the bus cannot carry: LimitError with one line."""
    load = bus_load(sample_rate_hz, fd=fd, bitrate=bitrate, data_bitrate=data_bitrate, further_axes=further_axes)
    if load > LARGEST:
        cure = "a lower sample rate" if fd else "a lower sample rate or CAN FD"
        raise LimitError(
            f"sample_rate {sample_rate_hz:g} Hz loads the bus to {100 * load:.0f} %, "
            f"at most {100 * LARGEST:.0f} % can be carried: use {cure}"
        )
