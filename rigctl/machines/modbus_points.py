"""Registers of a foreign map over Modbus TCP."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import isfinite

from pymodbus import ModbusException
from pymodbus.client import ModbusTcpClient
from pymodbus.pdu import ModbusPDU

from rigctl.clock import Clock, SystemClock
from rigctl.errors import MapError, RequestDenied, TransportError, TransportTimeout
from rigctl.machines.registers import COILS, DISCRETE, HOLDING, Register, decode, encode
from rigctl.machines.roles import Role
from rigctl.machines.wires import ModbusWire
from rigctl.modbus_wire import ILLEGAL


class ModbusPoints:
    """One connection to one server; a failed call closes it, so that a late answer is not taken for the next one."""

    def __init__(
        self,
        wire: ModbusWire,
        registers: Iterable[Register],
        *,
        clock: Clock | None = None,
        client: ModbusTcpClient | None = None,
    ) -> None:
        logging.getLogger("pymodbus").addHandler(logging.NullHandler())  # its errors arrive as exceptions
        self.url = f"modbus://{wire.host}:{wire.port}"
        self._wire, self._places = wire, {one.role: one for one in registers}
        self._clock = clock or SystemClock()
        self._client = client or ModbusTcpClient(wire.host, port=wire.port, retries=0, timeout=1.0)
        self._words: dict[tuple[int, int], int] = {}  # command words that hold several bits, as last written

    @property
    def roles(self) -> frozenset[Role]:
        return frozenset(self._places)

    @property
    def pending(self) -> int:
        """None: a server speaks only when it is asked."""
        return 0

    def read(self, roles: Sequence[Role], ends: float) -> dict[Role, float]:
        found: dict[Role, float] = {}
        for group in self._groups([self._places[role] for role in roles]):
            first, end = group[0].address, max(one.end for one in group)
            words = self._fetch(group[0], first, end - first, ends)
            for one in group:
                found[one.role] = self._value(one, words[one.address - first : one.address - first + one.words])
        return found

    def read_next(self, roles: Sequence[Role], ends: float) -> dict[Role, float]:
        return self.read(roles, ends)

    def read_array(self, role: Role, count: int, ends: float) -> list[float]:
        place, values = self._places[role], list[float]()
        most = self._wire.most_words // place.words
        while len(values) < count:
            n = min(count - len(values), most)
            words = self._fetch(place, place.address + len(values) * place.words, n * place.words, ends)
            values += [self._value(place, words[k * place.words : (k + 1) * place.words]) for k in range(n)]
        return values

    def write(self, values: Mapping[Role, float], ends: float) -> None:
        for start, words, place in self._runs(values):
            self._put(place, start, words, ends)
            if place.type == "bit" and not place.is_coil:
                self._words[place.unit or self._wire.unit, start] = words[0]

    def write_array(self, role: Role, values: Sequence[float], ends: float) -> None:
        place = self._places[role]
        most = self._wire.most_words // place.words
        for k in range(0, len(values), most):
            part = [word for value in values[k : k + most] for word in encode(place, value, self._wire.orders(place))]
            self._put(place, place.address + k * place.words, part, ends)

    def close(self) -> None:
        self._client.close()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types

    def _groups(self, places: Iterable[Register]) -> Iterable[list[Register]]:
        """Values that one request reads: same function and unit, without a gap beyond the allowed one."""
        group: list[Register] = []
        for one in sorted(places, key=lambda p: (p.function, p.unit or self._wire.unit, p.address)):
            if group and not self._joins(group, one):
                yield group
                group = []
            group.append(one)
        if group:
            yield group

    def _joins(self, group: Sequence[Register], one: Register) -> bool:
        first, end = group[0], max(p.end for p in group)
        same = (first.function, first.unit) == (one.function, one.unit)
        return same and one.address <= end + self._wire.gap_words and one.end - first.address <= self._wire.most_words

    def _runs(self, values: Mapping[Role, float]) -> list[tuple[int, list[int], Register]]:
        """Words to write, in the order of the values; neighbours of one order go into one request."""
        runs: list[tuple[int, list[int], Register]] = []
        bits: dict[tuple[int, int], int] = {}
        for role, value in values.items():
            place = self._places[role]
            key = (place.unit or self._wire.unit, place.address)
            if place.type == "bit" and not place.is_coil:
                before = bits.get(key, self._words.get(key, 0))
                mask = 1 << (place.bit or 0)
                bits[key] = before | mask if value else before & ~mask
                runs = [run for run in runs if (run[2].unit or self._wire.unit, run[0]) != key]
                runs.append((place.address, [bits[key]], place))
                continue
            words = [int(bool(value))] if place.is_coil else encode(place, value, self._wire.orders(place))
            last = runs[-1] if runs else None
            if last is not None and self._follows(last, place):
                last[1].extend(words)
            else:
                runs.append((place.address, words, place))
        return runs

    @staticmethod
    def _follows(run: tuple[int, list[int], Register], place: Register) -> bool:
        start, words, first = run
        same = (first.function, first.unit) == (place.function, place.unit)
        return same and "bit" not in (first.type, place.type) and start + len(words) == place.address

    def _value(self, place: Register, words: Sequence[int]) -> float:
        value = decode(place, words, self._wire.orders(place))
        if not isfinite(value):
            raise TransportError(f"{self.url}: the controller reports {value} as its {place.role}")
        return value

    def _fetch(self, place: Register, address: int, count: int, ends: float) -> list[int]:
        unit = self._wire.unit if place.unit is None else place.unit
        methods = {COILS: "read_coils", DISCRETE: "read_discrete_inputs", HOLDING: "read_holding_registers"}
        method = methods.get(place.function, "read_input_registers")
        answer = self._call(ends, lambda c: getattr(c, method)(address, count=count, device_id=unit))
        return [int(bit) for bit in answer.bits[:count]] if place.is_coil else list(answer.registers)

    def _put(self, place: Register, address: int, words: list[int], ends: float) -> None:
        unit = self._wire.unit if place.unit is None else place.unit
        if place.is_coil:
            self._call(ends, lambda c: c.write_coil(address, bool(words[0]), device_id=unit))
        elif self._wire.write_single and len(words) == 1:
            self._call(ends, lambda c: c.write_register(address, words[0], device_id=unit))
        else:
            self._call(ends, lambda c: c.write_registers(address, words, device_id=unit))

    def _call(self, ends: float, request: Callable[[ModbusTcpClient], ModbusPDU]) -> ModbusPDU:
        """Make one transaction: the only place where errors of pymodbus become errors of this package."""
        remaining = ends - self._clock.now()
        if remaining <= 0:
            raise TransportTimeout(f"{self.url}: no time left before the deadline")
        self._client.comm_params.timeout_connect = remaining
        try:
            answer = request(self._client)
        except (ModbusException, OSError, ValueError) as error:
            if isinstance(error, MapError):
                raise
            self.close()
            late = self._clock.now() >= ends
            reason = " ".join(str(error).split())
            raise (TransportTimeout if late else TransportError)(f"{self.url}: {reason}") from error
        if answer.isError():
            code = int(getattr(answer, "exception_code", 0))
            raise RequestDenied(f"{self.url}: the controller refused: {ILLEGAL.get(code, f'exception {code}')}")
        return answer
