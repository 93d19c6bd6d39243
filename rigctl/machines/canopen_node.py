"""Frames to and from one CANopen node: process data, service data, heartbeats, each call with its deadline."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Mapping
from typing import Final

import can

from rigctl.clock import Clock
from rigctl.errors import RequestDenied, TransportError, TransportTimeout
from rigctl.machines.canopen_map import Key, NodeMap, Pdo

SLICE_S: Final = 0.005  # most time of one wait for a frame
SDO_S: Final = 0.06  # before an unanswered request is sent again
STALE_S: Final = 0.25  # process data older than this are no answer
MOST_SAMPLES: Final = 100_000
ABORTS: Final = {
    0x06010002: "read only",
    0x06020000: "no such object",
    0x06090030: "value out of range",
    0x08000022: "not in this state",
}


class CanopenNode:
    """One node on one bus. The bus is opened at the first call."""

    def __init__(self, url: str, node: NodeMap, open_bus: Callable[[], can.BusABC], clock: Clock) -> None:
        self.url, self.map, self._open, self._clock = url, node, open_bus, clock
        self._bus: can.BusABC | None = None
        self._sent: dict[int, Pdo] = {pdo.identifier: pdo for pdo in node.sent}
        self._values: dict[Key, float] = {}
        self._arrived: dict[int, float] = {}  # time of the last frame of each kind
        self._answers: list[bytes] = []
        self.frames = 0  # of measured values, since the bus was opened
        self.samples: deque[dict[Key, float]] = deque(maxlen=MOST_SAMPLES)  # each frame with the counter, in order

    def values(self, ends: float) -> Mapping[Key, float]:
        """The latest process data; TransportTimeout where the drive has sent none lately."""
        self._receive(0.0)
        while not self._fresh():
            if self._clock.now() >= ends:
                raise TransportTimeout(f"{self.url}: node {self.map.node} sends no process data")
            if not self._arrived:
                self.send(0x000, bytes([0x01, self.map.node]))  # start the node
            self._receive(SLICE_S)
        return self._values

    def await_frame(self, ends: float) -> None:
        """Wait for the next frame of measured values."""
        seen = self.frames
        while self.frames == seen and self._clock.now() < ends:
            self._receive(SLICE_S)

    def _fresh(self) -> bool:
        now = self._clock.now()
        return all(now - self._arrived.get(pdo.identifier, float("-inf")) <= STALE_S for pdo in self.map.sent)

    def write(self, pdo: Pdo, values: Mapping[Key, int]) -> None:
        """Send one frame of process data."""
        self.send(pdo.identifier, pdo.encode(values))

    def read_object(self, key: Key, ends: float) -> int | float:
        """Read an object by SDO."""
        answer = self._ask(struct.pack("<BHB4x", 0x40, *key), key, ends)
        value: int | float = struct.unpack_from(self.map.formats[key], answer, 4)[0]
        return value

    def write_object(self, key: Key, value: int, ends: float) -> None:
        """Write an object by SDO, in one frame."""
        form = self.map.formats[key]
        size = struct.calcsize(form)
        head = struct.pack("<BHB", 0x23 | (4 - size) << 2, *key)
        self._ask(head + struct.pack(form, value).ljust(4, b"\0"), key, ends)

    def _ask(self, request: bytes, key: Key, ends: float) -> bytes:
        name = f"object {key[0]:04X}:{key[1]:02X}"
        self._receive(0.0)
        while self._clock.now() < ends:
            self._answers.clear()
            self.send(0x600 + self.map.node, request)
            again = min(self._clock.now() + SDO_S, ends)
            while not self._answers and self._clock.now() < again:
                self._receive(SLICE_S)
            for answer in (one for one in self._answers if one[1:4] == request[1:4]):
                if answer[0] == 0x80:
                    code = struct.unpack_from("<I", answer, 4)[0]
                    raise RequestDenied(f"{self.url}: {name} was refused: {ABORTS.get(code, f'code 0x{code:08X}')}")
                return answer
        raise TransportTimeout(f"{self.url}: no answer about {name}")

    def send(self, identifier: int, data: bytes) -> None:
        try:
            self._connected().send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
        except (can.CanError, OSError, ValueError) as error:
            self._fail(error)

    def _receive(self, wait_s: float) -> None:
        """Process what has arrived, waiting at most so long for the first frame."""
        try:
            message = self._connected().recv(wait_s)
            while message is not None:
                if not (message.is_extended_id or message.is_error_frame or message.is_remote_frame):
                    self._take(message.arbitration_id, bytes(message.data))
                message = self._connected().recv(0.0)
        except (can.CanError, OSError, ValueError) as error:
            self._fail(error)

    def _take(self, identifier: int, data: bytes) -> None:
        pdo = self._sent.get(identifier)
        if pdo is not None:
            values = pdo.decode(data)
            self._values.update(values)
            self._arrived[identifier] = self._clock.now()
            if self.map.counter in values:
                self.frames += 1
                self.samples.append(values)
        elif identifier == 0x580 + self.map.node and len(data) == 8:
            self._answers.append(data)

    def _connected(self) -> can.BusABC:
        if self._bus is None:
            self._bus = self._open()
        return self._bus

    def _fail(self, error: Exception) -> None:
        self.close()
        raise TransportError(f"{self.url}: {' '.join(str(error).split())}") from error

    def close(self) -> None:
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = None
        self._arrived.clear()
