"""A CANopen drive after CiA 402 as a machine: its state machine, positioning, and interpolated position mode."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.signal import Excitation
from rigctl.clock import Clock
from rigctl.device import PressureStage
from rigctl.errors import TransportTimeout
from rigctl.limits import Limits
from rigctl.machines import canopen_map as objects
from rigctl.machines.canopen_node import CanopenNode
from rigctl.machines.machine import NO_ROWS, Pumped, Reading, RunLost
from rigctl.machines.rig_map import RigMap
from rigctl.machines.roles import MEASURED, Role
from rigctl.waveform import Waveform

# Control words.
SHUT_DOWN: Final = 0x06
SWITCH_ON: Final = 0x07
ENABLE: Final = 0x0F
BEGIN: Final = 0x1F  # with bit 4: a new target, or interpolation
HALT: Final = 0x10F
RESET: Final = 0x80
# Status word: state bits, and those of its modes.
STATE_MASK: Final = 0x6F
ENABLED: Final = 0x27
SWITCHED_ON: Final = 0x23
READY: Final = 0x21
FAULT: Final = 0x08
PROFILE_POSITION: Final = 1
INTERPOLATED: Final = 7
INTERPOLATING: Final = 1 << 12
SPARE_POINTS: Final = 2  # of the drive's buffer that stay free: frames may be on their way


class Ds402Machine:
    """One drive. Points are sent on credit: sent − played never exceeds the drive's buffer."""

    takes_whole = False

    def __init__(self, rig: RigMap, node: CanopenNode, clock: Clock) -> None:
        assert rig.canopen is not None
        self._rig, self._wire, self._node, self._clock = rig, rig.canopen, node, clock
        self.url = node.url
        self._mode = PROFILE_POSITION
        self._beat_at = float("-inf")
        self._sent = self._told = self._played = self._raw = 0

    @property
    def drives_current(self) -> bool:
        return self._node.map.current is not None

    @property
    def unmeasured(self) -> tuple[str, ...]:
        wire = self._wire
        named = {Role.FORCE: wire.force_object, Role.CURRENT: wire.current_object, Role.POSITION: "always"}
        return tuple(str(role) for role in MEASURED if not named.get(role))

    def played_waveform(self, excitation: Excitation, waveform: Waveform) -> Waveform:
        return waveform

    def configure(self, limits: Limits, stage: PressureStage, ends: float) -> None:
        """Give the drive its software limits and the time after which it misses its host."""
        node, scale = self._node, self._wire.counts_per_metre
        node.values(ends)
        for key, value in (
            (objects.POSITION_MIN, limits.position_min_m),
            (objects.POSITION_MAX, limits.position_max_m),
        ):
            if key in node.map.formats:
                node.write_object(key, round(value * scale), ends)
        node.write_object(
            objects.CONSUMER_HEARTBEAT, self._wire.host_node << 16 | round(self._rig.watchdog.time_s * 1e3), ends
        )

    def read(self, ends: float) -> Reading:
        values = self._node.values(ends)
        word = int(values[objects.STATUS_WORD])
        standing = bool(word >> self._wire.standstill_bit & 1)
        fault = int(values[objects.ERROR_CODE]) or -1
        row = self._row(values)
        return Reading(
            tick=self._node.frames % (1 << self._rig.clock.counter_bits),
            enabled=word & STATE_MASK == ENABLED,
            running=bool(word & INTERPOLATING),
            at_rest=standing,
            fault_code=fault if word & FAULT else 0,
            values=row,
        )

    def _row(self, values: Mapping[objects.Key, float]) -> NDArray[np.float64]:
        force = values.get(self._node.map.force, 0.0) * self._wire.force_scale if self._node.map.force else 0.0
        return np.array([force, values[objects.POSITION] / self._wire.counts_per_metre, 0.0, 0.0, 0.0])

    def beat(self, ends: float) -> None:
        if self._clock.now() - self._beat_at >= self._wire.heartbeat_s:
            self._beat_at = self._clock.now()
            self._node.send(0x700 + self._wire.host_node, b"\x05")

    def enable(self, ends: float) -> None:
        """Walk through the states, each confirmed by the drive."""
        self._mode = PROFILE_POSITION
        for word, state in ((SHUT_DOWN, READY), (SWITCH_ON, SWITCHED_ON), (ENABLE, ENABLED)):
            self._control(word)
            self._await_word(STATE_MASK, state, ends)

    def disable(self, ends: float) -> None:
        self._control(SHUT_DOWN)
        self._control(0)

    def stop(self, ends: float) -> None:
        self._control(HALT)

    def reset(self, ends: float) -> None:
        """Give a rising edge of the reset bit; the drive ends switched off."""
        self._control(0)
        self._control(RESET)
        self._control(0)

    def travel(self, displacement_m: float, current_a: float, ends: float) -> None:
        node, self._mode = self._node, PROFILE_POSITION
        if node.map.current is not None:
            node.write_object(node.map.current, round(current_a / self._wire.current_scale), ends)
        node.write_object(objects.TARGET, round(displacement_m * self._wire.counts_per_metre), ends)
        self._control(ENABLE)
        self._control(BEGIN)
        self._settle(ends)

    def start(self, queue: NDArray[np.float64], total: int, ends: float) -> None:
        """Clear the buffer, fill it, and set the bit that begins."""
        self._mode = INTERPOLATED
        self._control(ENABLE)
        self._node.write_object(objects.BUFFER_CLEAR, 0, ends)
        self._settle(ends)
        self._node.samples.clear()
        self._sent = self._told = self._played = self._raw = 0
        self._send_points(queue)
        self._control(BEGIN)

    def pump(self, queue: NDArray[np.float64], total: int, ends: float) -> Pumped:
        first = self._played
        rows = self._collect()
        if not len(rows):
            self._node.await_frame(min(ends, self._clock.now() + 2 * self._wire.period_s))
            rows = self._collect()
        self._send_points(queue[self._sent - self._told :])
        taken, self._told = self._sent - self._told, self._sent
        return Pumped(taken=taken, first=first, rows=rows)

    def _collect(self) -> NDArray[np.float64]:
        """Rows of the frames whose counter has advanced; each advance by one is one point played."""
        rows, counter = [], self._node.map.counter
        bits = 8 * struct.calcsize(self._node.map.formats[counter])
        while self._node.samples:
            values = self._node.samples.popleft()
            step = (int(values[counter]) - self._raw) % (1 << bits)
            if step == 0:
                continue
            if step > 1:
                raise RunLost(f"{self.url}: {step - 1} frames of measured values were lost")
            self._raw = int(values[counter])
            self._played += 1
            rows.append(self._row(values))
        return np.array(rows) if rows else NO_ROWS

    def _send_points(self, queue: NDArray[np.float64]) -> None:
        free = self._node.map.buffer_points - SPARE_POINTS - (self._sent - self._played)
        pdo = self._node.map.receiving(objects.POINT)
        for displacement, current in queue[: max(free, 0)]:
            values = {objects.POINT: round(displacement * self._wire.counts_per_metre)}
            if self._node.map.current is not None:
                values[self._node.map.current] = round(current / self._wire.current_scale)
            self._node.write(pdo, values)
            self._sent += 1

    def _control(self, word: int) -> None:
        pdo = self._node.map.receiving(objects.CONTROL_WORD)
        self._node.write(pdo, {objects.CONTROL_WORD: word, objects.MODE: self._mode})

    def _settle(self, ends: float) -> None:
        """Wait until the drive's frames certainly tell of what was sent."""
        for _ in range(2):
            self._node.await_frame(ends)

    def _await_word(self, mask: int, wanted: int, ends: float) -> None:
        while int(self._node.values(ends)[objects.STATUS_WORD]) & mask != wanted:
            if self._clock.now() >= ends:
                raise TransportTimeout(f"{self.url}: the drive did not reach status 0x{wanted:02X}")
            self._node.await_frame(ends)

    def close(self) -> None:
        self._node.close()
