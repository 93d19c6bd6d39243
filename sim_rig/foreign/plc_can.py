"""The same PLC with a CAN card instead of its Modbus server; its frames are those of examples/rigs/plc_can.dbc.

0x101  bits 0 enable, 1 follow, 2 stop, 3 go to target, 4 reset; life counter u16; coil current i16 0.1 mA
0x102  set-point i32 0.1 µm, target i32 0.1 µm
0x182  position i32 0.1 µm, force i32 0.1 N                               after each scan
0x181  bits 0 enabled, 1 moving, 2 standstill, 3 fault; fault code u8; scan counter u16; current i16 0.1 mA;
       temperature i16 0.1 °C                                             after it, the last of the scan
"""

from __future__ import annotations

import struct

from sim_rig.foreign.plc import Plc


class PlcOnCan:
    """Frames in and out of the PLC's image."""

    def __init__(self, plc: Plc) -> None:
        self.plc = plc
        self._scans = plc.scans

    @property
    def answers(self) -> bool:
        return self.plc.answers

    def tick(self) -> None:
        self.plc.tick()

    def take(self, identifier: int, data: bytes) -> None:
        """Process one frame."""
        words = self.plc.image.holding
        if identifier == 0x101 and len(data) >= 6:
            word, life, current = struct.unpack_from("<HHh", data)
            words[4096], words[4097] = word, life
            words[4102], words[4103] = _real(current * 1e-4)
        elif identifier == 0x102 and len(data) == 8:
            setpoint, target = struct.unpack("<ii", data)
            words[4098], words[4099] = _real(setpoint * 1e-4)
            words[4100], words[4101] = _real(target * 1e-4)

    def give(self) -> list[tuple[int, bytes]]:
        """Frames of the scans since the last call; a scan that was not asked about is not sent again."""
        if not self.answers or self.plc.scans == self._scans:
            return []
        self._scans = self.plc.scans
        force, position, current, temperature = self.plc.axis.measured[:4]
        words = self.plc.image.input
        measured = struct.pack("<ii", round(position * 1e7), round(force * 10))
        state = struct.pack(
            "<BBHhh", words[2000], words[2001], words[2002], round(current * 1e4), round(temperature * 10)
        )
        return [(0x182, measured), (0x181, state)]


def _real(value: float) -> tuple[int, int]:
    low, high = struct.unpack("<HH", struct.pack("<f", value))
    return low, high
