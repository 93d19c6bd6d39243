"""A Modbus TCP server of a controller: an image of words that its program reads and writes once a scan."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterable
from typing import Any, Protocol, cast

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import DataType, SimData, SimDevice

from sim_rig.errors import SimRigError

TICK_S = 0.001


class Image:
    """Input registers and discrete inputs (read), holding registers and coils (read and written).

    Any other address is refused.
    """

    def __init__(
        self,
        inputs: Iterable[range],
        holdings: Iterable[range],
        *,
        coils: range = range(0),
        discretes: range = range(0),
    ) -> None:
        self.input = {address: 0 for part in inputs for address in part}
        self.holding = {address: 0 for part in holdings for address in part}
        self.coil, self.discrete = dict.fromkeys(coils, 0), dict.fromkeys(discretes, 0)

    def words(self, function: int) -> dict[int, int]:
        """What a function code reads or writes."""
        if function in (1, 5, 15):
            return self.coil
        return {2: self.discrete, 4: self.input}.get(function, self.holding)


class RegisterController(Protocol):
    """A controller behind an image of registers."""

    unit: int
    image: Image

    def tick(self) -> None:
        """Run the scans that are due."""
        ...

    @property
    def answers(self) -> bool:
        """Whether the server answers at present."""
        ...


def device(controller: RegisterController) -> SimDevice:
    """Put a controller's image behind pymodbus's server."""
    image = controller.image

    async def access(
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        words = image.words(function)
        if values:
            wanted = range(address, address + len(values))
            if any(one not in words for one in wanted):
                return ExcCodes.ILLEGAL_ADDRESS
            words.update(zip(wanted, (int(value) for value in values), strict=True))
        elif function in BITS:
            for k in range(address // 16, address // 16 + count):
                registers[k - start] = sum(words.get(16 * k + bit, 0) << bit for bit in range(16))
        elif any(one not in words for one in range(address, address + count)):
            return ExcCodes.ILLEGAL_ADDRESS
        else:
            registers[address - start : address - start + count] = [
                words[one] for one in range(address, address + count)
            ]
        return None

    bits = [_words_of(one) for one in (image.coil, image.discrete)]
    data = (bits[0], bits[1], _ranges(image.holding), _ranges(image.input))
    return SimDevice(id=controller.unit, simdata=data, use_bit_addressing=True, action=access)


BITS = (1, 2, 5, 15)  # functions of coils and discrete inputs


def _words_of(bits: dict[int, int]) -> list[SimData]:
    """Registers that hold so many bits; at least one, as pymodbus wants it."""
    return [SimData(0, count=max(bits, default=0) // 16 + 1, values=False, datatype=DataType.BITS)]


def _ranges(words: dict[int, int]) -> list[SimData]:
    """Ranges of addresses; the values are served by the action."""
    found = []
    for start in sorted(address for address in words if address - 1 not in words):
        count = next(n for n in range(1, len(words) + 1) if start + n not in words)
        found.append(SimData(start, count=count, values=0, datatype=DataType.REGISTERS))
    return found


class _Connection(ServerRequestHandler):
    """The one connection that the controller has; a second one is closed at once."""

    def __init__(self, server: _Server) -> None:
        super().__init__(server, server.trace_packet, server.trace_pdu, server.trace_connect)  # type: ignore[no-untyped-call]
        self._one_of = server

    def callback_connected(self) -> None:
        super().callback_connected()
        if self._one_of.taken is not None:
            asyncio.get_running_loop().call_soon(self.close)
        else:
            self._one_of.taken = self

    def callback_disconnected(self, exc: Exception | None) -> None:
        super().callback_disconnected(exc)
        if self._one_of.taken is self:
            self._one_of.taken = None

    def callback_data(self, data: bytes, addr: tuple[Any, ...] | None = None) -> int:  # Any: pymodbus's address
        self._late.append(data)
        self._serve()
        return len(data)

    def _serve(self) -> None:
        if not self._one_of.controller.answers:
            asyncio.get_running_loop().call_later(TICK_S, self._serve)
            return
        while self._late:
            super().callback_data(self._late.pop(0))

    @property
    def _late(self) -> list[bytes]:
        """Requests that wait for an answer."""
        return self.__dict__.setdefault("waiting", [])  # type: ignore[no-any-return]


class _Server(ModbusTcpServer):
    def __init__(self, controller: RegisterController, host: str, port: int) -> None:
        super().__init__(device(controller), address=(host, port))
        self.controller = controller
        self.taken: _Connection | None = None

    def callback_new_connection(self) -> ServerRequestHandler:
        return _Connection(self)


async def serve_image(
    controller: RegisterController, host: str, port: int, stop: asyncio.Event, on_ready: Callable[[str], None]
) -> None:
    """Serve until `stop` is set; port 0 chooses a free one, `on_ready` gets the real address."""
    logging.getLogger("pymodbus").addHandler(logging.NullHandler())
    server = _Server(controller, host, port)
    try:
        await server.serve_forever(background=True)
    except (RuntimeError, OSError) as error:
        raise SimRigError(f"modbus://{host}:{port}: cannot listen there ({error})") from error
    try:
        real = cast(asyncio.Server, server.transport).sockets[0].getsockname()[1]  # declared as a more general type
        on_ready(f"modbus://{host}:{real}")
        while not stop.is_set():
            controller.tick()
            await asyncio.sleep(TICK_S)
    finally:
        await server.shutdown()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types
