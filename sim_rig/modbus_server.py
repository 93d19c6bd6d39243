"""The simulated rig on Modbus TCP."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import DataType, SimData, SimDevice

from rigctl import modbus_further
from rigctl import modbus_map as table
from rigctl.errors import LimitError
from rigctl.transport import Capability
from sim_rig.errors import RequestRefused, SimRigError
from sim_rig.faulty_wire import FaultyWire, flip
from sim_rig.registers import RegisterDevice
from sim_rig.rig import SimulatedRig

TICK_S = 0.005
BLOCK_EXCHANGE = 0x17  # FC23


class _Access:
    """Called by pymodbus for every read and write."""

    def __init__(self, rig: SimulatedRig, soon: Callable[[Callable[[], None]], object]) -> None:
        self._rig, self._registers, self._soon = rig, RegisterDevice(rig), soon

    async def access(
        self,
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        """Serve one read or write; pymodbus calls this twice for FC23, the write first."""
        try:
            if values:
                self._registers.write(address, list(values))
                if address == table.WRITE_HEADER.address:
                    self._soon(self._rig.tick)  # advance the rig while the answer is sent
            else:
                for block, words in self._registers.read(address, count):
                    registers[block.address - start : block.address - start + len(words)] = words
        except (RequestRefused, LimitError, OverflowError):
            return ExcCodes.ILLEGAL_VALUE
        return None


def registers(capabilities: Capability = Capability.NONE) -> list[SimData]:
    """The registers of the map; any other address is refused as illegal."""
    ranges = [(block.address, block.count, True) for block in table.INPUT_BLOCKS] + [
        (block.address, block.count, False) for block in (*table.COMMAND_BLOCKS, table.CONFIGURATION)
    ]
    ranges += [(table.WRITE_HEADER.address, table.WRITE_COUNT, False)]
    ranges += [(table.READ_HEADER.address, table.READ_COUNT, True)]
    if Capability.FURTHER_AXES in capabilities:
        ranges += [(header.address, modbus_further.COUNT, True) for header in modbus_further.HEADERS]
    return [
        SimData(address, count=count, values=0, datatype=DataType.REGISTERS, readonly=readonly)
        for address, count, readonly in ranges
    ]


def device(rig: SimulatedRig, soon: Callable[[Callable[[], None]], object]) -> SimDevice:
    """Put a rig behind the registers of the map; `soon` calls back once an answer is sent."""
    return SimDevice(id=table.UNIT, simdata=registers(rig.identity().capabilities), action=_Access(rig, soon).access)


def damage(frame: bytes, random: np.random.Generator) -> bytes | None:
    """Flip a bit in a window of FC23; other frames have no checksum but TCP's, which discards them: None."""
    if len(frame) < 8 or frame[7] != BLOCK_EXCHANGE:
        return None
    window = 17 if int.from_bytes(frame[8:10]) == table.READ_HEADER.address else 9
    return flip(frame, window, random)


class _Connection(ServerRequestHandler):
    """Answers in the same pass of the event loop, which pymodbus would postpone by a wake-up through a socket."""

    def handle_later(self) -> None:
        self._answering = asyncio.get_running_loop().create_task(self.handle_request())  # type: ignore[no-untyped-call]  # pymodbus leaves it without types


class _FaultyConnection(_Connection):
    """A connection over a wire with faults."""

    def __init__(self, server: _Server, rig: SimulatedRig, seed: int) -> None:
        super().__init__(server, server.trace_packet, server.trace_pdu, server.trace_connect)  # type: ignore[no-untyped-call]
        now = asyncio.get_running_loop().time
        self._requests, self._answers = (FaultyWire(rig.faults, now, damage, seed=2 * seed + k) for k in range(2))
        self._send_now = self.low_level_send
        self.low_level_send = self._send_in_time

    def callback_data(self, data: bytes, addr: tuple[Any, ...] | None = None) -> int:  # Any: pymodbus's address
        self._requests.put(data)
        self._arrive()
        return len(data)

    def _arrive(self) -> None:
        for data in self._requests.take():
            super().callback_data(data)
        self._again(self._requests, self._arrive)

    def _send_in_time(self, data: bytes, addr: tuple[Any, ...] | None = None) -> None:
        self._answers.put(data)
        self._leave()

    def _leave(self) -> None:
        for data in self._answers.take():
            self._send_now(data)
        self._again(self._answers, self._leave)

    def _again(self, wire: FaultyWire[bytes], what: Callable[[], None]) -> None:
        if wire.due_s is not None:
            asyncio.get_running_loop().call_later(wire.due_s + 1e-3, what)


class _Server(ModbusTcpServer):
    def __init__(self, rig: SimulatedRig, host: str, port: int) -> None:
        super().__init__(device(rig, asyncio.get_running_loop().call_soon), address=(host, port))
        self._rig, self._connections = rig, 0

    def callback_new_connection(self) -> ServerRequestHandler:
        self._connections += 1
        if self._rig.faults:
            return _FaultyConnection(self, self._rig, self._connections)
        return _Connection(self, self.trace_packet, self.trace_pdu, self.trace_connect)  # type: ignore[no-untyped-call]


async def serve_modbus(
    rig: SimulatedRig, host: str, port: int, stop: asyncio.Event, on_ready: Callable[[str], None]
) -> None:
    """Serve a rig until `stop` is set; port 0 chooses a free one, `on_ready` gets the real URL.

    Raises
    ------
    SimRigError
        When the address cannot be listened on.
    """
    logging.getLogger("pymodbus").addHandler(logging.NullHandler())
    server = _Server(rig, host, port)
    try:
        await server.serve_forever(background=True)
    except (RuntimeError, OSError) as error:
        raise SimRigError(f"modbus://{host}:{port}: cannot listen there ({error})") from error
    try:
        real = (
            cast(asyncio.Server, server.transport).sockets[0].getsockname()[1]
        )  # pymodbus declares a more general type
        on_ready(f"modbus://{host}:{real}")
        while not stop.is_set():
            rig.tick()
            await asyncio.sleep(TICK_S)
    finally:
        await server.shutdown()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types
