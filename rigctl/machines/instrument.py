"""A measuring instrument with a clock of its own, recorded beside a test."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from threading import Event, Thread
from typing import Any, ClassVar, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import STRICT, read_config, to_spec
from excitation.errors import DesignError
from excitation.rpc3 import Channel, TimeHistory
from rigctl.clock import Clock, SystemClock
from rigctl.errors import AlignmentError, MapError, TransportError
from rigctl.machines.modbus_points import ModbusPoints
from rigctl.machines.registers import Register
from rigctl.machines.roles import CHANNELS, Role
from rigctl.machines.wires import ModbusWire

FETCH_S: Final = 0.2  # of one attempt
EVERY_S: Final = 0.05  # between two attempts
AGAIN_S: Final = 0.5  # after one that failed
ATTEMPTS: Final = 3
EDGE_S: Final = 0.02  # for the instrument to see the edge that begins a record
AT_ONCE: Final = 10  # fetches of one step
SLOWEST: Final = 0.99  # of its nominal rate, that an instrument's clock may have
NEEDED: Final = (Role.START, Role.TRACE_FIRST, Role.TRACE_COUNT, Role.TRACE_FETCHED)


@dataclass(frozen=True, slots=True, kw_only=True)
class InstrumentChannel:
    """What a channel of the instrument measures, after the scale of its register."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    role: Role
    name: str
    unit: str

    def __post_init__(self) -> None:
        if self.role not in CHANNELS:
            raise MapError(f"channel {self.name!r}: role is {self.role}: it must be channel_1 … channel_8")
        if not self.name.strip():
            raise MapError(f"channel {self.role}: name is empty: --take refers to it")


@dataclass(frozen=True, slots=True, kw_only=True)
class InstrumentMap:
    """Registers of an instrument that keeps its samples in a window until they have been fetched."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str
    modbus: ModbusWire
    rate_hz: float  # of its clock, nominal
    register: tuple[Register, ...]
    channel: tuple[InstrumentChannel, ...]

    def __post_init__(self) -> None:
        if not (isfinite(self.rate_hz) and 1 <= self.rate_hz <= 200_000):
            raise MapError(f"rate is {self.rate_hz} Hz: it must lie in 1 … 200 000")
        places = Counter([one.role for one in self.register])
        wanted = [*NEEDED, *(one.role for one in self.channel)]
        missing = [role for role in wanted if not places[role]]
        if missing or not self.channel:
            raise MapError(f"role {missing[0] if missing else 'channel_1'} is missing: an instrument needs it")
        twice = [role for role, count in places.items() if count > 1]
        if twice:
            raise MapError(f"role {twice[0]} is given {places[twice[0]]} times: once is right")


def read_instrument_map(path: str | os.PathLike[str]) -> InstrumentMap:
    """Read and check the map of an instrument; MapError in one line where it is wrong."""
    place = Path(path)
    try:
        return to_spec(InstrumentMap, read_config(place), str(place))
    except DesignError as error:
        raise MapError(str(error)) from None


class Instrument(Protocol):
    """A second transport: it only measures. Every call ends by its deadline and raises only TransportError."""

    @property
    def rate_hz(self) -> float: ...

    @property
    def channels(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of each channel."""
        ...

    def begin(self, deadline_s: float) -> None:
        """Begin a record; its samples are numbered from 0."""
        ...

    def fetch(self, deadline_s: float) -> NDArray[np.float64]:
        """Return the next samples, (n, channels), none when there are no more at present."""
        ...

    def close(self) -> None: ...


class RegisterInstrument:
    """An instrument by its map of registers."""

    def __init__(self, found: InstrumentMap, points: ModbusPoints, clock: Clock) -> None:
        self._map, self._points, self._clock = found, points, clock
        counts = {one.role: one.count for one in found.register}
        self._window = min(counts[one.role] for one in found.channel)
        self._next = 0

    @property
    def rate_hz(self) -> float:
        return self._map.rate_hz

    @property
    def channels(self) -> tuple[tuple[str, str], ...]:
        return tuple((one.name, one.unit) for one in self._map.channel)

    def begin(self, deadline_s: float) -> None:
        ends = self._clock.now() + deadline_s
        self._points.write({Role.START: 0.0}, ends)
        self._clock.sleep(EDGE_S)
        self._points.write({Role.TRACE_FETCHED: 0.0, Role.START: 1.0}, ends)
        self._clock.sleep(EDGE_S)
        while self._points.read([Role.TRACE_FIRST], ends)[Role.TRACE_FIRST]:
            self._clock.sleep(EDGE_S)
        self._next = 0

    def fetch(self, deadline_s: float) -> NDArray[np.float64]:
        ends = self._clock.now() + deadline_s
        state = self._points.read([Role.TRACE_FIRST, Role.TRACE_COUNT], ends)
        first, count = int(state[Role.TRACE_FIRST]), min(int(state[Role.TRACE_COUNT]), self._window)
        if first > self._next:
            raise TransportError(f"{self._points.url}: samples {self._next} … {first - 1} are lost: its store ran over")
        if first < self._next:
            self._points.write({Role.TRACE_FETCHED: float(self._next)}, ends)  # the answer or the word was lost
        if first < self._next or not count:
            return np.empty(
                (0, len(self._map.channel))
            )  # a window that has not been moved yet might be while it is read
        rows = np.array([self._points.read_array(one.role, count, ends) for one in self._map.channel]).T
        self._next = first + count
        self._points.write({Role.TRACE_FETCHED: float(self._next)}, ends)
        return rows

    def close(self) -> None:
        self._points.close()


def connect_instrument(path: str, *, clock: Clock | None = None) -> RegisterInstrument:
    """Return the instrument of a map; nothing is sent yet."""
    found, used = read_instrument_map(path), clock or SystemClock()
    return RegisterInstrument(found, ModbusPoints(found.modbus, found.register, clock=used), used)


class LiveRecord:
    """Records an instrument while a test is played.

    A failure of the instrument does not disturb the test; it is raised when the record is asked for.
    """

    def __init__(self, instrument: Instrument, clock: Clock | None = None) -> None:
        self._instrument, self._clock = instrument, clock or SystemClock()
        self._rows: list[NDArray[np.float64]] = []
        self._failures = 0  # one after the other
        self._failed: TransportError | None = None
        self._began = self._due = self._clock.now()
        try:
            instrument.begin(FETCH_S)
        except TransportError as error:
            self._failed = error

    @contextmanager
    def in_background(self) -> Iterator[None]:
        """Fetch in a thread: a test whose set-points this computer paces must not wait for another wire."""
        ended = Event()

        def fetch() -> None:
            while not ended.wait(EVERY_S):
                self.step()

        thread = Thread(target=fetch, name="second acquisition")
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def step(self) -> None:
        """Fetch what is there, when it is time."""
        if self._clock.now() >= self._due:
            for _ in range(AT_ONCE):
                if not self._fetch():
                    return

    def _fetch(self) -> bool:
        """Fetch once; whether there may be more. A failed attempt is repeated later, some times."""
        if self._failed is not None:
            return False
        try:
            rows = self._instrument.fetch(FETCH_S)
        except TransportError as error:
            self._failures += 1
            self._failed = error if self._failures == ATTEMPTS else None
            self._due = self._clock.now() + AGAIN_S
            return False
        self._failures, self._due = 0, self._clock.now() + EVERY_S
        if len(rows):
            self._rows.append(rows)
        return len(rows) > 0

    @property
    def _samples(self) -> int:
        return sum(len(rows) for rows in self._rows)

    def finish(self) -> TimeHistory:
        """Fetch what was measured until now and return the record; AlignmentError where the instrument failed."""
        due = SLOWEST * (self._clock.now() - self._began) * self._instrument.rate_hz
        while self._failed is None and self._samples < due:
            if not self._fetch():
                self._clock.sleep(EVERY_S)
        if self._failed is not None:
            raise AlignmentError(f"the other acquisition failed: {self._failed}") from self._failed
        rows = np.concatenate(self._rows) if self._rows else np.empty((0, len(self._instrument.channels)))
        if not len(rows):
            raise AlignmentError("the other acquisition has recorded nothing")
        columns = zip(self._instrument.channels, rows.T, strict=True)
        channels = tuple(Channel(name=name, unit=unit, values=column.copy()) for (name, unit), column in columns)
        return TimeHistory(sample_rate_hz=self._instrument.rate_hz, channels=channels, drive=False)
