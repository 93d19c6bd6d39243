"""The simulated rig on Modbus TCP: registers in, registers out, one clock."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import asdict
from typing import cast

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import DataType, SimData, SimDevice

from rigctl import modbus_map as table
from rigctl.device import Control
from rigctl.errors import LimitError
from sim_rig.errors import RequestRefused, SimRigError
from sim_rig.rig import SimulatedRig

TICK_S = 0.005


class RegisterDevice:
    """Between registers and the rig: what a write means, and what a read shows."""

    def __init__(self, rig: SimulatedRig) -> None:
        self._rig = rig
        self._acknowledged = 0
        self._refused = False

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
                self._write(address, list(values))
            else:
                self._show(start, address, count, registers)
        except (RequestRefused, LimitError, OverflowError):
            return ExcCodes.ILLEGAL_VALUE
        return None

    def _write(self, address: int, words: list[int]) -> None:
        if address == table.CONTROL.address and len(words) == table.CONTROL.count:
            self._command(words)
        elif address == table.CONFIGURATION.address and len(words) == table.CONFIGURATION.count:
            self._rig.configure(table.configuration_from(table.CONFIGURATION.decode(words)))
        elif address == table.WRITE_HEADER.address:
            self._stream(words)
        elif address == table.HEARTBEAT_ADDRESS and len(words) == 1:
            self._rig.poll(words[0])
        else:
            raise RequestRefused(f"a write of {len(words)} words at 0x{address:04X} means nothing")

    def _command(self, words: list[int]) -> None:
        values = {name: float(value) for name, value in table.CONTROL.decode(words).items()}
        control, heartbeat = Control(int(values["control"])), int(values["heartbeat"])
        if Control.RESET in control and int(values["reset_key"]) != table.RESET_KEY:
            raise RequestRefused("a reset needs its key")
        if int(values["mode"]) == table.MODE_DIRECT:
            self._rig.direct(values["direct_displacement_m"], values["direct_current_a"], heartbeat)
        else:
            self._rig.command(control, int(values["run_id"]), heartbeat)
        self._acknowledged = int(values["command"])

    def _stream(self, words: list[int]) -> None:
        window = table.decode_write(words)
        self._refused = window is None
        if window is None:
            self._rig.crc_errors += 1
            return
        reply = self._rig.exchange(
            window.block, window.run_id, window.captured, window.heartbeat, table.CAPTURE_SAMPLES
        )
        self._refused = reply.refused
        asyncio.get_running_loop().call_soon(self._rig.tick)  # play on while the answer is under way

    def _show(self, start: int, address: int, count: int, registers: list[int]) -> None:
        for block, words in self._blocks(address, count):
            registers[block.address - start : block.address - start + len(words)] = words

    def _blocks(self, address: int, count: int) -> list[tuple[table.Block, list[int]]]:
        end = address + count
        return [
            (block, encode())
            for block, encode in (
                (table.IDENTITY, self._identity),
                (table.STATUS, self._status),
                (table.COUNTERS, self._counters),
                (table.ACTUALS, self._actuals),
                (table.MACHINE_LIMITS, self._machine_limits),
                (table.CONFIGURATION, self._configuration),
                (table.READ_HEADER, self._read_window),
            )
            if block.address < end and address < block.address + block.count
        ]

    def _identity(self) -> list[int]:
        identity = self._rig.identity()
        own = {register.name for register in table.IDENTITY.registers} - {"magic"}
        return table.IDENTITY.encode({"magic": table.MAGIC, **{name: getattr(identity, name) for name in own}})

    def _machine_limits(self) -> list[int]:
        return table.MACHINE_LIMITS.encode(asdict(self._rig.identity().limits))

    def _configuration(self) -> list[int]:
        return table.CONFIGURATION.encode(table.configuration_values(self._rig.controller.configuration))

    def _status(self) -> list[int]:
        status = self._rig.status()
        return table.STATUS.encode(
            {
                "state": status.state.value,
                "faults": int(status.faults),
                "first_fault": int(status.first_fault),
                "run_id": status.run_id,
                "arrived": status.arrived,
                "heartbeat": status.heartbeat,
                "command_acknowledged": self._acknowledged,
            }
        )

    def _counters(self) -> list[int]:
        status, controller = self._rig.status(), self._rig.controller
        return table.COUNTERS.encode(
            {
                "fifo_level": status.fifo_level,
                "fifo_free": controller.fifo.free,
                "underruns": status.underruns % 0x10000,
                "overruns": controller.overruns % 0x10000,
                "last_accepted": status.last_accepted,
                "consumed": status.consumed,
                "sample_index": status.sample_index % 2**32,
                "capture_backlog": status.capture_backlog,
                "crc_errors": status.crc_errors % 0x10000,
                "duplicates": status.duplicates % 0x10000,
                "gaps": status.gaps % 0x10000,
            }
        )

    def _actuals(self) -> list[int]:
        status = self._rig.status()
        return table.ACTUALS.encode(
            {register.name: getattr(status, register.name) for register in table.ACTUALS.registers}
        )

    def _read_window(self) -> list[int]:
        reply = self._rig.reply(self._refused, table.CAPTURE_SAMPLES)
        head: dict[str, table.Value] = {
            "state": reply.state.value,
            "faults": int(reply.faults),
            "last_accepted": reply.last_accepted,
            "fifo_free": reply.fifo_free,
            "consumed": reply.consumed,
        }
        return table.encode_read(head, reply.capture, self._refused)


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
    device = SimDevice(id=table.UNIT, simdata=registers(), action=RegisterDevice(rig).access)
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
