"""The simulated rig on Modbus TCP: registers in, registers out, one clock."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import cast

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import DataType, SimData, SimDevice

from rigctl import modbus_map as table
from rigctl.errors import LimitError
from sim_rig.errors import RequestRefused, SimRigError
from sim_rig.registers import RegisterDevice
from sim_rig.rig import SimulatedRig

TICK_S = 0.005


class _Access:
    """What pymodbus calls for every read and write."""

    def __init__(self, rig: SimulatedRig) -> None:
        self._rig, self._registers = rig, RegisterDevice(rig)

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
                    asyncio.get_running_loop().call_soon(self._rig.tick)  # play on while the answer is under way
            else:
                for block, words in self._registers.read(address, count):
                    registers[block.address - start : block.address - start + len(words)] = words
        except (RequestRefused, LimitError, OverflowError):
            return ExcCodes.ILLEGAL_VALUE
        return None


def registers() -> list[SimData]:
    """Lay out the registers of the map; whatever lies between them is refused as an illegal address."""
    ranges = [(block.address, block.count, True) for block in table.INPUT_BLOCKS] + [
        (block.address, block.count, False) for block in (table.CONTROL, table.CONFIGURATION)
    ]
    ranges += [(table.WRITE_HEADER.address, table.WRITE_COUNT, False)]
    ranges += [(table.READ_HEADER.address, table.READ_COUNT, True)]
    return [
        SimData(address, count=count, values=0, datatype=DataType.REGISTERS, readonly=readonly)
        for address, count, readonly in ranges
    ]


class _Connection(ServerRequestHandler):
    """Answers in the loop that received the request: pymodbus would wake itself through a socket first."""

    def handle_later(self) -> None:
        self._answering = asyncio.get_running_loop().create_task(self.handle_request())  # type: ignore[no-untyped-call]  # pymodbus leaves it without types


class _Server(ModbusTcpServer):
    def callback_new_connection(self) -> ServerRequestHandler:
        return _Connection(self, self.trace_packet, self.trace_pdu, self.trace_connect)  # type: ignore[no-untyped-call]


async def serve_modbus(
    rig: SimulatedRig, host: str, port: int, stop: asyncio.Event, on_ready: Callable[[str], None]
) -> None:
    """Serve a rig until `stop` is set; port 0 takes a free one, `on_ready` gets the real URL.

    Raises
    ------
    SimRigError
        When the address cannot be listened on.
    """
    logging.getLogger("pymodbus").addHandler(logging.NullHandler())
    device = SimDevice(id=table.UNIT, simdata=registers(), action=_Access(rig).access)
    server = _Server(device, address=(host, port))
    try:
        await server.serve_forever(background=True)
    except (RuntimeError, OSError) as error:
        raise SimRigError(f"modbus://{host}:{port}: cannot listen there ({error})") from error
    try:
        real = cast(asyncio.Server, server.transport).sockets[0].getsockname()[1]  # pymodbus declares less
        on_ready(f"modbus://{host}:{real}")
        while not stop.is_set():
            rig.tick()
            await asyncio.sleep(TICK_S)
    finally:
        await server.shutdown()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types
