"""The three ways in which registers or signals drive a controller: streamed, buffered, by a function generator."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rigctl.clock import Clock
from rigctl.errors import TransportError, TransportTimeout
from rigctl.machines.machine import Pumped, RunLost
from rigctl.machines.points import Points
from rigctl.machines.rig_map import MachineClock
from rigctl.machines.roles import MEASURED, TRACE, Role

POLLS_A_TICK = 4  # of a controller whose ticks are counted by asking
WAIT_TICKS = 3  # that one pass waits for a new sample
FILL_SHARE = 0.5  # of the time for a start that goes into filling the buffer


class Driving(Protocol):
    """One way of driving. `start` begins a run, with the controller's stop still set; `pump` moves set-points out
    and samples in.
    """

    takes_whole: bool

    def start(self, queue: NDArray[np.float64], total: int, ends: float) -> None: ...

    def pump(self, queue: NDArray[np.float64], total: int, ends: float) -> Pumped: ...


def row_of(values: dict[Role, float]) -> NDArray[np.float64]:
    """A captured sample; channels that the controller does not measure are 0."""
    return np.array([values.get(role, 0.0) for role in MEASURED])


def measured_roles(points: Points) -> list[Role]:
    """Roles of the channels that the map has."""
    return [role for role in MEASURED if role in points.roles]


class Streamed:
    """One set-point for each tick, written by the host, which is late at times.

    The set-point that is written after tick n was seen belongs to tick n + 1. The motion keeps its time base: after
    missed ticks the points between are left out. The measured samples carry the controller's own count.
    """

    takes_whole = False

    def __init__(self, points: Points, machine_clock: MachineClock, clock: Clock) -> None:
        self._points, self._ticks, self._clock = points, machine_clock, clock
        self._roles = [Role.TICK, Role.RUNNING, *measured_roles(points)]
        self._origin: int | None = None
        self._reached = 0  # ticks since the origin
        self._given = 0  # set-points that are done with: written, or left out because the host was late
        self._told = 0  # of these, told to the caller

    def start(self, queue: NDArray[np.float64], total: int, ends: float) -> None:
        self._origin, self._reached, self._given, self._told = None, 0, 1, 0
        self._write(queue[0], {Role.STOP: 0.0, Role.START: 1.0}, ends)

    def pump(self, queue: NDArray[np.float64], total: int, ends: float) -> Pumped:
        values = self._await_tick(ends)
        if values is None:
            return Pumped()
        first, rows = self._count(values), [row_of(values)]
        while self._points.pending:  # of several that have arrived, the next set-point belongs to the last
            values = self._points.read_next(self._roles, ends)
            if not values[Role.RUNNING] or self._step(values) == 0:
                continue
            reached = self._reached
            missing = self._count(values) - reached - 1
            rows += [*fill_gap(rows[-1], missing, row_of(values)), row_of(values)]
        self._give(queue[self._given - self._told :], total, ends)
        taken, self._told = self._given - self._told, self._given
        return Pumped(taken=taken, first=first, rows=np.array(rows))

    def _step(self, values: dict[Role, float]) -> int:
        """Ticks since the last one that was counted."""
        if self._origin is None:
            self._origin = int(values[Role.TICK])
        return (int(values[Role.TICK]) - self._origin - self._reached) % (1 << self._ticks.counter_bits)

    def _count(self, values: dict[Role, float]) -> int:
        """Number of the sample; RunLost where too many ticks were missed before it."""
        step = self._step(values)
        self._check_gap(step)
        self._reached += step
        return self._reached

    def _give(self, queue: NDArray[np.float64], total: int, ends: float) -> None:
        """Write the set-point for the next tick."""
        due = min(self._reached + 2, self._given + len(queue)) - self._given
        if due > 0:
            self._write(queue[due - 1], {}, ends)
            self._given += due
        elif not total and self._reached + 1 >= self._given:
            raise RunLost(f"{self._points.url}: no set-point is ready for the controller's next tick")

    def _await_tick(self, ends: float) -> dict[Role, float] | None:
        """Read until the tick has changed; None where it does not within a few ticks."""
        tick_s = 1.0 / self._ticks.rate_hz
        until = min(self._clock.now() + WAIT_TICKS * tick_s, ends)
        while True:
            values = self._points.read_next(self._roles, ends)
            seen = None if self._origin is None else (self._origin + self._reached) % (1 << self._ticks.counter_bits)
            if values[Role.RUNNING] and int(values[Role.TICK]) != seen:
                return values
            if self._clock.now() >= until:
                return None
            self._clock.sleep(tick_s / POLLS_A_TICK)

    def _check_gap(self, step: int) -> None:
        if step > self._ticks.longest_gap + 1:
            raise RunLost(
                f"{self._points.url}: {step - 1} ticks of the controller were missed, "
                f"{self._ticks.longest_gap} are allowed: this computer or the wire is too slow"
            )

    def _write(self, setpoint: NDArray[np.float64], more: dict[Role, float], ends: float) -> None:
        values = {Role.SETPOINT: float(setpoint[0])}
        if Role.CURRENT_SETPOINT in self._points.roles:
            values[Role.CURRENT_SETPOINT] = float(setpoint[1])
        self._points.write(values | more, ends)


class TraceReader:
    """Fetches samples that the controller keeps until it is told that they have arrived.

    The window is read only when it begins at the next sample: then it can only grow until this host says more. One that
    begins earlier has not been moved yet, and might be while it is being read.
    """

    def __init__(self, points: Points, window: int) -> None:
        self._points, self._window, self._next = points, window, 0
        self._stored = {role: at for role, at in TRACE.items() if at in points.roles}

    def begin(self) -> None:
        self._next = 0

    def fetch(self, values: dict[Role, float], ends: float) -> Pumped:
        """Samples from the next one on; `values` says which the window holds."""
        first, count = int(values[Role.TRACE_FIRST]), min(int(values[Role.TRACE_COUNT]), self._window)
        if first > self._next:
            raise RunLost(f"{self._points.url}: samples {self._next} … {first - 1} are lost: its store ran over")
        if first < self._next:
            self._points.write({Role.TRACE_FETCHED: float(self._next)}, ends)  # the answer or the word was lost
        if first < self._next or not count:
            return Pumped(first=self._next)
        rows = np.tile(row_of(values), (count, 1))
        for role, at in self._stored.items():
            rows[:, MEASURED.index(role)] = self._points.read_array(at, count, ends)
        self._next = first + count
        self._points.write({Role.TRACE_FETCHED: float(self._next)}, ends)
        return Pumped(first=first, rows=rows)


class Buffered:
    """Blocks into a window that the controller empties into its own buffer; it plays them on its own clock."""

    takes_whole = False

    def __init__(self, points: Points, window: int, trace: TraceReader, clock: Clock) -> None:
        self._points, self._window, self._trace, self._clock = points, window, trace, clock
        self._number = self._given = self._told = 0
        self._state = [
            *(Role.BUFFER_FREE, Role.BUFFER_TAKEN, Role.TRACE_FIRST, Role.TRACE_COUNT),
            *measured_roles(points),
        ]

    def start(self, queue: NDArray[np.float64], total: int, ends: float) -> None:
        self._trace.begin()
        self._given = self._told = 0
        taken = self._points.read([Role.BUFFER_TAKEN], ends)[Role.BUFFER_TAKEN]
        self._number = int(taken)
        self._points.write({Role.TRACE_FETCHED: 0.0, Role.BUFFER_NUMBER: taken}, ends)  # a block left there is void
        self._points.write({Role.STOP: 0.0}, ends)
        until = self._clock.now() + FILL_SHARE * (ends - self._clock.now())
        while self._clock.now() < until and self._send(queue, self._points.read(self._state, ends), ends):
            pass
        self._points.write({Role.START: 1.0}, ends)
        while not self._points.read([Role.RUNNING], ends)[Role.RUNNING]:  # before that, the store is of an earlier run
            self._clock.sleep(0.001)

    def pump(self, queue: NDArray[np.float64], total: int, ends: float) -> Pumped:
        values = self._points.read(self._state, ends)
        self._send(queue, values, ends)
        taken, self._told = self._given - self._told, self._given
        return self._trace.fetch(values, ends)._replace(taken=taken)

    def _send(self, queue: NDArray[np.float64], values: dict[Role, float], ends: float) -> bool:
        """Hand over the next block, unless the last one still lies in the window or the buffer is full."""
        queue = queue[self._given - self._told :]
        n = min(len(queue), self._window, int(values[Role.BUFFER_FREE]))
        if n == 0 or int(values[Role.BUFFER_TAKEN]) != self._number:
            return False
        self._points.write_array(Role.BUFFER_WINDOW, list(queue[:n, 0]), ends)
        if Role.BUFFER_CURRENT in self._points.roles:
            self._points.write_array(Role.BUFFER_CURRENT, list(queue[:n, 1]), ends)
        number = self._number % 0xFFFF + 1
        self._points.write({Role.BUFFER_COUNT: float(n), Role.BUFFER_NUMBER: float(number)}, ends)
        self._number = number
        self._await_taken(ends)
        self._given += n
        return True

    def _await_taken(self, ends: float) -> None:
        """Wait until the window may be written again: a block in it must not be changed."""
        while int(self._points.read([Role.BUFFER_TAKEN], ends)[Role.BUFFER_TAKEN]) != self._number:
            if self._clock.now() >= ends:
                raise TransportTimeout(f"{self._points.url}: block {self._number} was not taken before the deadline")
            self._clock.sleep(0.001)


class Generated:
    """The controller makes the motion itself; the host gives its numbers, starts it and collects samples."""

    takes_whole = True

    def __init__(self, points: Points, machine_clock: MachineClock, clock: Clock) -> None:
        self._points, self._ticks, self._clock = points, machine_clock, clock
        self._roles = [Role.TICK, Role.RUNNING, Role.PLAYED, *measured_roles(points)]
        self._numbers: dict[Role, float] = {}
        self._seen = self._untold = 0

    def choose(self, numbers: dict[Role, float]) -> None:
        """Numbers for the generator, written at the start."""
        self._numbers = numbers

    def start(self, queue: NDArray[np.float64], total: int, ends: float) -> None:
        self._seen, self._untold = 0, len(queue)
        numbers = dict(self._numbers)
        if Role.CURRENT_SETPOINT in self._points.roles:
            numbers[Role.CURRENT_SETPOINT] = float(queue[0, 1])
        self._points.write(numbers, ends)
        kept = self._points.read(list(numbers), ends)
        _check_kept(self._points.url, numbers, kept)
        self._points.write({Role.STOP: 0.0, Role.START: 1.0}, ends)

    def pump(self, queue: NDArray[np.float64], total: int, ends: float) -> Pumped:
        tick_s = 1.0 / self._ticks.rate_hz
        until = min(self._clock.now() + WAIT_TICKS * tick_s, ends)
        while True:
            values = self._points.read_next(self._roles, ends)
            played = int(values[Role.PLAYED])
            if played > self._seen:
                break
            if self._clock.now() >= until:
                return Pumped()
            self._clock.sleep(tick_s / POLLS_A_TICK)
        missed = played - self._seen - 1
        if missed > self._ticks.longest_gap:
            raise RunLost(f"{self._points.url}: {missed} samples were missed, {self._ticks.longest_gap} are allowed")
        self._seen = played
        taken, self._untold = self._untold, 0
        return Pumped(taken=taken, first=played - 1, rows=row_of(values)[None])


def _check_kept(url: str, wanted: dict[Role, float], kept: dict[Role, float]) -> None:
    for role, value in wanted.items():
        if abs(kept[role] - value) > 1e-5 * abs(value) + 1e-9:
            raise TransportError(f"{url}: the controller keeps {kept[role]:g} as its {role}, {value:g} was written")


def fill_gap(before: NDArray[np.float64], missing: int, after: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows between two samples, interpolated linearly, (missing, 5)."""
    share = (np.arange(1, missing + 1) / (missing + 1))[:, None]
    filled: NDArray[np.float64] = before + share * (after - before)
    return filled
