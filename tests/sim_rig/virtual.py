"""Every wire to a simulated rig in this process and in virtual time: real frames, no sockets, no waiting."""

from __future__ import annotations

from collections.abc import Coroutine
from typing import Any

import can
from pymodbus.client import ModbusTcpClient
from pymodbus.framer import FramerSocket
from pymodbus.pdu import DecodePDU
from pymodbus.simulator.simcore import SimCore

from rigctl.can_wire import CanTransport
from rigctl.modbus_wire import ModbusTransport
from rigctl.transport import Transport
from sim_rig.can_server import CanDevice
from sim_rig.direct import DirectTransport
from sim_rig.faulty import FaultyTransport
from sim_rig.faulty_wire import FaultyWire
from sim_rig.modbus_server import damage, device
from sim_rig.rig import SimulatedRig

WIRES = ("direct", "modbus", "can", "can_fd")
STEP_S = 0.001


class Killed(BaseException):
    """The process of the host has been killed."""


class Killable:
    """The transport of a host that can be killed: once ``killed`` is set, no call reaches the rig."""

    def __init__(self, inner: Transport) -> None:
        self._inner, self.killed = inner, False

    def __getattr__(self, name: str) -> Any:
        """The attribute of the transport. Any: a method or a property."""
        if self.killed:
            raise Killed
        return getattr(self._inner, name)


class LivingClock:
    """A clock that advances the rig while its host waits."""

    def __init__(self, rig: SimulatedRig, clock: Any) -> None:
        self._rig, self._clock = rig, clock

    def now(self) -> float:
        return float(self._clock.now())

    def sleep(self, seconds: float) -> None:
        self._clock.sleep(seconds)
        self._rig.tick()


class NullModem(ModbusTcpClient):
    """pymodbus's own client, wired to the server's registers without a socket; frames are those of the wire."""

    def __init__(self, rig: SimulatedRig, clock: Any) -> None:
        super().__init__("nowhere", retries=0, timeout=1.0)
        self._rig, self._clock, self._connected = rig, clock, False
        self._context, self._decoder = SimCore(device(rig, lambda later: later())), DecodePDU(True)
        self._seed = 3
        self._requests, self._answers = self._wire(2), self._wire(3)

    def _wire(self, seed: int) -> FaultyWire[bytes]:
        return FaultyWire(self._rig.faults, self._clock.now, damage, seed=seed)

    @property
    def connected(self) -> bool:
        return self._connected

    def connect(self) -> bool:
        self._connected = True
        return True

    def close(self) -> None:
        """Disconnect: answers in transit are lost, requests still arrive."""
        self._connected = False
        self._seed += 1
        self._answers = self._wire(self._seed)

    def send(self, request: bytes, addr: Any = None) -> int:
        self._requests.put(request)
        return len(request)

    def recv(self, size: int | None) -> bytes:
        ends = self._clock.now() + (self.comm_params.timeout_connect or 0.0)
        while self._clock.now() < ends:
            self._clock.sleep(STEP_S)
            self._rig.tick()
            for request in self._requests.take():
                answer = self.serve(request)
                if answer:
                    self._answers.put(answer)
            arrived = b"".join(self._answers.take())
            if arrived:
                return arrived
        return b""

    def serve(self, request: bytes) -> bytes:
        framer = FramerSocket(self._decoder)
        _, pdu = framer.handleFrame(request, 0, 0)
        if pdu is None:
            return b""
        response = ended(pdu.datastore_update(self._context, pdu.dev_id))
        response.transaction_id, response.dev_id = pdu.transaction_id, pdu.dev_id
        return bytes(framer.buildFrame(response))


def ended(coroutine: Coroutine[Any, Any, Any]) -> Any:
    """Result of a coroutine that never waits."""
    try:
        coroutine.send(None)
    except StopIteration as done:
        return done.value
    raise AssertionError("it waits for something")


class VirtualBus(can.BusABC):
    """A bus in this process to a simulated device."""

    def __init__(self, rig: SimulatedRig, clock: Any, *, fd: bool) -> None:
        self._rig, self._clock, self._fd = rig, clock, fd
        self._device = CanDevice(rig, clock.now, fd=fd)
        self._inbox: list[tuple[int, bytes]] = []
        self.channel_info = "virtual"
        super().__init__("virtual")
        self._is_shutdown = True  # there is nothing to shut down

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._device.take(msg.arbitration_id, bytes(msg.data))

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        ends = self._clock.now() + (timeout or 0.0)
        while not self._inbox and self._clock.now() < ends:
            self._clock.sleep(STEP_S)
            self._rig.tick()
            self._inbox.extend(self._device.give())
        if not self._inbox:
            return None, True
        number, data = self._inbox.pop(0)
        return can.Message(arbitration_id=number, data=data, is_extended_id=False, is_fd=self._fd), True

    def shutdown(self) -> None:
        """Keep the bus: it may be opened again."""


def wire_to(name: str, rig: SimulatedRig, clock: Any) -> Transport:
    """A transport to a rig: one of WIRES, with the rig's faults on it."""
    if name == "direct":
        direct = DirectTransport(rig, clock)
        return FaultyTransport(direct, rig.faults, LivingClock(rig, clock)) if rig.faults else direct
    if name == "modbus":
        return ModbusTransport("virtual", 502, clock=clock, client=NullModem(rig, clock))
    bus = VirtualBus(rig, clock, fd=name == "can_fd")
    return CanTransport("can://virtual/1", lambda: bus, fd=name == "can_fd", clock=clock)
