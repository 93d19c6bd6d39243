"""Values of a foreign map in CAN frames: the controller sends its states by itself, commands are sent in a cycle."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Final

import can

from rigctl.clock import Clock
from rigctl.errors import TransportError, TransportTimeout
from rigctl.machines.can_signals import frames_of
from rigctl.machines.roles import Role
from rigctl.machines.wires import CanWire, Signal

SLICE_S: Final = 0.005  # most time of one wait for a frame
MOST_SETS: Final = 100_000
STANDARD: Final = 0x7FF  # largest identifier of 11 bits


class CanPoints:
    """One bus to one controller, opened at the first call.

    The frame with the tick closes a set of values: a controller sends it after the frames of the same moment.
    """

    def __init__(
        self, url: str, wire: CanWire, signals: Sequence[Signal], open_bus: Callable[[], can.BusABC], clock: Clock
    ) -> None:
        self.url, self._wire, self._open, self._clock = url, wire, open_bus, clock
        self._frames = frames_of(wire, signals)
        self._tick_frame = self._frames.names[Role.TICK][0]
        self._bus: can.BusABC | None = None
        self._latest: dict[Role, float] = {}
        self._arrived = float("-inf")
        self._sets: deque[dict[Role, float]] = deque(maxlen=MOST_SETS)
        self._written: dict[Role, float] = {}
        self._sent_at: dict[int, float] = {}

    @property
    def roles(self) -> frozenset[Role]:
        return frozenset(self._frames.names)

    @property
    def pending(self) -> int:
        """Sets of values that have arrived and were not read by `read_next`."""
        self._receive(0.0)
        return len(self._sets)

    def read(self, roles: Sequence[Role], ends: float) -> dict[Role, float]:
        self._repeat_commands()
        self._receive(0.0)
        while self._clock.now() - self._arrived > self._wire.stale_s or any(role not in self._latest for role in roles):
            if self._clock.now() >= ends:
                missing = [role for role in roles if role not in self._latest]
                raise TransportTimeout(f"{self.url}: no frames with {', '.join(missing or roles)} arrive")
            self._receive(SLICE_S)
        values = {role: self._latest.get(role, self._written.get(role, 0.0)) for role in roles}
        return self._finite(values)

    def read_next(self, roles: Sequence[Role], ends: float) -> dict[Role, float]:
        self._repeat_commands()
        self._receive(0.0)
        while not self._sets:
            if self._clock.now() >= ends:
                raise TransportTimeout(f"{self.url}: the controller sends no more frames")
            self._receive(SLICE_S)
        values = self._sets.popleft()
        missing = [role for role in roles if role not in values]
        if missing:
            raise TransportError(f"{self.url}: no frame with {', '.join(missing)} has arrived")
        return self._finite({role: values[role] for role in roles})

    def write(self, values: Mapping[Role, float], ends: float) -> None:
        for identifier in dict.fromkeys(self._frames.names[role][0] for role in values):
            self._written |= {role: value for role, value in values.items() if self._at(role) == identifier}
            self._send(identifier)

    def read_array(self, role: Role, count: int, ends: float) -> list[float]:
        raise TransportError(f"{self.url}: frames hold no arrays")  # rig_map refuses such a way on this wire

    def write_array(self, role: Role, values: Sequence[float], ends: float) -> None:
        raise TransportError(f"{self.url}: frames hold no arrays")

    def _at(self, role: Role) -> int:
        return self._frames.names[role][0]

    def _repeat_commands(self) -> None:
        now = self._clock.now()
        for identifier, sent in list(self._sent_at.items()):
            if now - sent >= self._wire.command_cycle_s:
                self._send(identifier)

    def _send(self, identifier: int) -> None:
        self._sent_at[identifier] = self._clock.now()
        try:
            data = self._frames.encode(identifier, self._written)
            message = can.Message(
                arbitration_id=identifier, data=data, is_extended_id=identifier > STANDARD, is_fd=self._wire.bus.fd
            )
            self._connected().send(message)
        except (can.CanError, OSError, ValueError, OverflowError) as error:
            self._fail(error)

    def _receive(self, wait_s: float) -> None:
        """Process what has arrived, waiting at most so long for the first frame."""
        try:
            message = self._connected().recv(wait_s)
            while message is not None:
                if not (message.is_error_frame or message.is_remote_frame):
                    self._take(message.arbitration_id, bytes(message.data))
                message = self._connected().recv(0.0)
        except (can.CanError, OSError, ValueError) as error:
            self._fail(error)

    def _take(self, identifier: int, data: bytes) -> None:
        values = self._frames.decode(identifier, data)
        self._latest |= values
        if values and identifier == self._tick_frame:
            self._sets.append(dict(self._latest))
            self._arrived = self._clock.now()

    def _finite(self, values: dict[Role, float]) -> dict[Role, float]:
        for role, value in values.items():
            if not isfinite(value):
                raise TransportError(f"{self.url}: the controller reports {value} as its {role}")
        return values

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
        self._arrived = float("-inf")
        self._sets.clear()
