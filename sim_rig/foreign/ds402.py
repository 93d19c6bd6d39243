"""A CANopen drive after CiA 402 with interpolated position mode and a buffer of 32 points.

Its manual (the objects are those of its EDS file, examples/rigs/ds402.eds): positions in µm/10, forces in N.

    RPDO1 0x200 + node   6040 control word u16, 6060 mode i8          acts when it arrives
    RPDO2 0x300 + node   60C1:01 point i32, 2040 coil current 0.1 mA i16; each frame is one point
    TPDO1 0x180 + node   6041 status word u16, 6061 mode i8, 603F error u16, 60C4:02 free points u8: every 10 ms
    TPDO2 0x280 + node   6064 position i32, 2041 points played u16, 2042 force i16: every 10 ms
    607A target, 60C4:06 buffer clear, 1016:01 consumer heartbeat and 607D software limits by SDO

Status word: bit 12 interpolation active, bit 14 standstill. Halt (bit 8) decelerates and leaves the interpolation;
it begins on the rising edge of bit 4. Errors: 0x5441 emergency stop, 0x8130 heartbeat of the host lost,
0x8611 point too far from the last one, 0x8612 point outside the software limits, 0xFF01 buffer empty in motion.
An error decelerates and switches off. A fault reset (rising edge of bit 7) leads to "switch on disabled".
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from typing import Final

from sim_rig.faults import FaultKind, Faults
from sim_rig.foreign.ordered import acts
from sim_rig.foreign.servo import SPEED_M_S, STEP_HZ, Plant, ServoAxis, Switch

PERIOD_STEPS: Final = 10
POINTS: Final = 32
COUNT_M: Final = 1e-7
SLOW_M_S: Final = 0.01
EMERGENCY_STOP, HEARTBEAT, TOO_FAR, OUTSIDE, EMPTY = 0x5441, 0x8130, 0x8611, 0x8612, 0xFF01
# States of CiA 402, as their bits in the status word.
NOT_READY, DISABLED, READY, SWITCHED_ON, ENABLED, FAULT = 0x00, 0x40, 0x21, 0x23, 0x27, 0x08
PROFILE_POSITION, INTERPOLATED = 1, 7
FORMATS: Final = {  # objects that SDO reads and writes
    (0x1000, 0): "<I",
    (0x1016, 1): "<I",
    (0x1018, 1): "<I",
    (0x603F, 0): "<H",
    (0x6040, 0): "<H",
    (0x6041, 0): "<H",
    (0x6060, 0): "<b",
    (0x6061, 0): "<b",
    (0x6064, 0): "<i",
    (0x607A, 0): "<i",
    (0x607D, 1): "<i",
    (0x607D, 2): "<i",
    (0x60C4, 1): "<I",
    (0x60C4, 6): "<B",
    (0x2040, 0): "<h",
}
WRITABLE: Final = {(0x1016, 1), (0x6040, 0), (0x6060, 0), (0x607A, 0), (0x607D, 1), (0x607D, 2), (0x60C4, 6)} | {
    (0x2040, 0)
}


class Drive:
    """The drive's firmware; frames in by `take`, frames out by `give`."""

    def __init__(self, plant: Plant, *, now: Callable[[], float], faults: Faults | None = None, node: int = 5) -> None:
        self.axis, self.node = ServoAxis(plant), node
        self.faults = faults or Faults()
        self._now, self._origin, self.steps = now, now(), 0
        self.state, self.error = DISABLED, 0
        self.operational = self.interpolating = False
        self._buffer: deque[tuple[int, int]] = deque()
        self._points = 0
        self._objects = dict.fromkeys(FORMATS, 0)
        self._objects |= {(0x1000, 0): 0x00020192, (0x1018, 1): 0x3FF, (0x60C4, 1): POINTS}
        self._objects |= {(0x607D, 1): -700_000, (0x607D, 2): 700_000}
        self._reset, self._begin, self._new_target = Switch(), Switch(), Switch()
        self._heard_step = 0
        self._out: list[tuple[int, bytes]] = [(0x700 + node, b"\0")]

    @property
    def answers(self) -> bool:
        return not acts(self.faults, FaultKind.STALLED)

    def tick(self) -> None:
        """Run the steps that are due."""
        due = int((self._now() - self._origin) * STEP_HZ)
        while self.steps < due:
            self.step()

    def give(self) -> list[tuple[int, bytes]]:
        """Frames to send since the last call."""
        if not self.answers:
            return []
        out, self._out = self._out, []
        return out

    def take(self, identifier: int, data: bytes) -> None:
        """Process one frame."""
        if identifier == 0x000 and len(data) == 2 and data[1] in (0, self.node):
            self.operational = data[0] == 0x01
        elif identifier == 0x200 + self.node and self.operational and len(data) >= 3:
            self._objects[0x6060, 0] = struct.unpack_from("<b", data, 2)[0]
            self._control(struct.unpack_from("<H", data)[0])
        elif identifier == 0x300 + self.node and self.operational and len(data) >= 6:
            if len(self._buffer) < POINTS and self.state == ENABLED:
                self._buffer.append(struct.unpack_from("<ih", data))
        elif identifier == 0x600 + self.node and len(data) == 8:
            self._out.append((0x580 + self.node, self._sdo(data)))
        elif 0x701 <= identifier <= 0x77F and identifier - 0x700 == self._objects[0x1016, 1] >> 16 & 0x7F:
            self._heard_step = self.steps

    def _sdo(self, data: bytes) -> bytes:
        command, index, sub = struct.unpack_from("<BHB", data)
        key = (index, sub)
        if key not in FORMATS:
            return struct.pack("<BHBI", 0x80, index, sub, 0x06020000)
        form = FORMATS[key]
        size = struct.calcsize(form)
        if command == 0x40:
            value = self._read(key)
            return struct.pack("<BHB", 0x43 | (4 - size) << 2, index, sub) + struct.pack(form, value).ljust(4, b"\0")
        if command & 0xE0 != 0x20 or key not in WRITABLE:
            return struct.pack("<BHBI", 0x80, index, sub, 0x06010002)
        self._objects[key] = struct.unpack(form, data[4 : 4 + size])[0]
        if key == (0x6040, 0):
            self._control(self._objects[key])
        elif key == (0x60C4, 6) and self._objects[key] == 0 and not self.interpolating:
            self._buffer.clear()
            self._points = 0
        elif key == (0x1016, 1):
            self._heard_step = self.steps
        return struct.pack("<BHBI", 0x60, index, sub, 0)

    def _read(self, key: tuple[int, int]) -> int:
        own = {
            (0x603F, 0): self.error,
            (0x6041, 0): self.status_word,
            (0x6061, 0): self._objects[0x6060, 0],
            (0x6064, 0): round(float(self.axis.measured[1]) / COUNT_M),
        }
        return own.get(key, self._objects[key])

    @property
    def status_word(self) -> int:
        rest = self.axis.at_rest and not self.interpolating
        return self.state | 0x10 | rest << 10 | self.interpolating << 12 | rest << 14

    def _control(self, word: int) -> None:
        """The state machine of CiA 402."""
        reset = self._reset.rises(bool(word & 0x80))
        begin, target = (one.rises(bool(word & 0x10)) for one in (self._begin, self._new_target))
        standing = acts(self.faults, FaultKind.EMERGENCY_STOP)
        if self.state == FAULT:
            if reset and self.axis.at_rest and not standing:
                self.state, self.error = DISABLED, 0
            return
        if self.state == ENABLED and (word & 0x100 or word & 0x0F != 0x0F):
            self._end()
        if not self.axis.at_rest and word & 0x0F != 0x0F:
            return  # it switches off only at rest
        steps = {(DISABLED, 0x06): READY, (READY, 0x07): SWITCHED_ON, (SWITCHED_ON, 0x0F): ENABLED}
        steps |= {(ENABLED, 0x07): SWITCHED_ON, (ENABLED, 0x06): READY, (SWITCHED_ON, 0x06): READY}
        before = self.state
        self.state = DISABLED if not word & 0x02 else steps.get((self.state, word & 0x0F), self.state)
        if self.state == ENABLED and before != ENABLED:
            self._heard_step = self.steps
        if self.state != ENABLED or word & 0x100 or not self.axis.at_rest or self.interpolating:
            return
        if self._objects[0x6060, 0] == INTERPOLATED and begin and self._buffer:
            self.interpolating = True
            self.axis.begin_run()
        elif self._objects[0x6060, 0] == PROFILE_POSITION and target:
            low, high = self._objects[0x607D, 1], self._objects[0x607D, 2]
            if low <= self._objects[0x607A, 0] <= high:
                self.axis.current_a = self._objects[0x2040, 0] * 1e-4
                self.axis.travel(self._objects[0x607A, 0] * COUNT_M)

    def _end(self) -> None:
        self.interpolating = False
        self._buffer.clear()
        self.axis.brake()

    def _trip(self, error: int) -> None:
        if self.state != FAULT:
            self.state, self.error = FAULT, self.error or error
            self._out.append((0x80 + self.node, struct.pack("<HB5x", error, 1)))
        self._end()

    def step(self) -> None:
        """One millisecond."""
        self.steps += 1
        time_ms = self._objects[0x1016, 1] & 0xFFFF
        if self.state == ENABLED and time_ms and self.steps - self._heard_step > time_ms:
            self._trip(HEARTBEAT)
        if acts(self.faults, FaultKind.EMERGENCY_STOP) and self.state == ENABLED:
            self._trip(EMERGENCY_STOP)
        if self.steps % PERIOD_STEPS == 0:
            self._period()
        if self.state != ENABLED:
            self.axis.current_a = 0.0

    def _period(self) -> None:
        """One interpolation period: ten steps of the loop, then the frames that report them."""
        if self.interpolating and not self._buffer:
            if self.axis.speed_m_s > SLOW_M_S:
                self._trip(EMPTY)
            self._end()
        if self.interpolating:
            self._play(*self._buffer.popleft())
        else:
            self.axis.idle(PERIOD_STEPS)
        if self.operational:
            self._report()

    def _play(self, counts: int, current: int) -> None:
        target = counts * COUNT_M
        if not self._objects[0x607D, 1] <= counts <= self._objects[0x607D, 2]:
            self._trip(OUTSIDE)
        elif abs(target - self.axis.command_m) > SPEED_M_S * PERIOD_STEPS / STEP_HZ:
            self._trip(TOO_FAR)
        else:
            self.axis.current_a = current * 1e-4
            self.axis.follow_to(target, PERIOD_STEPS)
            self._points = self._points + 1 & 0xFFFF
            return
        self.axis.idle(PERIOD_STEPS)

    def _report(self) -> None:
        force, position = self.axis.measured[:2]
        mode, free = self._objects[0x6060, 0], POINTS - len(self._buffer)
        self._out.append((0x180 + self.node, struct.pack("<HbHB", self.status_word, mode, self.error, free)))
        measured = struct.pack("<iHh", round(float(position) / COUNT_M), self._points, round(float(force)))
        self._out.append((0x280 + self.node, measured))
        if self.steps % 100 == 0:
            self._out.append((0x700 + self.node, b"\5"))
