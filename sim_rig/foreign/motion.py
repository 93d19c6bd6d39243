"""A motion controller with a trajectory buffer: cycle 1 ms, big-endian integers, commands in coils.

Its manual (unit 1):

    0x     0 power, 1 start, 2 stop, 3 move, 4 reset: act on their rising edge, stop as long as it is set
    1x     0 powered, 1 running, 2 standstill, 3 error
    3x   100 error number: 1 emergency stop, 3 buffer empty in motion, 4 outside the travel, 5 too fast, 9 host silent
         102 cycle counter, 32 bits             104 position 0.1 µm, 32 bits      106 force 0.1 N, 32 bits
         108 current 0.1 mA, 109 temperature 0.1 °C, 110 pressure 0.1 bar
         120 free points, 121 number of the block taken last
         130 first point of the trace window, 32 bits; 132 points in it
         200 trace of positions, 50 × 32 bits; 300 of forces, 50 × 32 bits; 400 of currents, 50 × 16 bits
    4x    10 host counter: unchanged for 400 ms while powered: error 9
          12 target 0.1 µm, 32 bits             14 current 0.1 mA
          16 lower and 18 upper travel 0.1 µm, 20 speed 0.1 mm/s, 32 bits each
          24 first point of the trace that is still wanted, 32 bits
          30 points in the block, 31 its number: a new one hands the block over
          40 positions, 50 × 32 bits; 140 currents, 50 × 16 bits

The buffer holds 2 000 points. A stop decelerates and empties it. When it runs empty at rest the motion has ended.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from sim_rig.faults import FaultKind, Faults
from sim_rig.foreign.image import Image
from sim_rig.foreign.ordered import acts
from sim_rig.foreign.servo import STEP_HZ, Plant, ServoAxis, Switch

POINTS: Final = 2000
WINDOW: Final = 50
SILENT_CYCLES: Final = 400
SLOW_M_S: Final = 0.01  # below this an empty buffer is the end of a motion
POWER, START, STOP, MOVE, RESET = range(5)
EMERGENCY_STOP, EMPTY, OUTSIDE, TOO_FAST, SILENT = 1, 3, 4, 5, 9
COUNT_M: Final = 1e-7
TRAVEL, SPEED = 700_000, 15_000  # largest that the machine allows, in counts


class MotionController:
    """The firmware, one cycle each millisecond."""

    unit = 1

    def __init__(self, plant: Plant, *, now: Callable[[], float], faults: Faults | None = None) -> None:
        self.axis = ServoAxis(plant)
        inputs = [range(100, 111), range(120, 122), range(130, 133), range(200, 300), range(300, 400), range(400, 450)]
        holdings = [range(10, 26), range(30, 32), range(40, 140), range(140, 190)]
        self.image = Image(inputs, holdings, coils=range(5), discretes=range(4))
        self.faults = faults or Faults()
        self._now, self._origin, self.cycles = now, now(), 0
        self.powered = self.running = False
        self.error = 0
        self._switches = [Switch() for _ in range(5)]
        self._life, self._life_cycle = 0, 0
        self._buffer: deque[tuple[int, int]] = deque()
        self._block = 0
        self._trace: deque[tuple[int, int, int]] = deque()
        self._trace_first = self._shown_first = 0
        self._write(16, -TRAVEL)
        self._write(18, TRAVEL)
        self._write(20, SPEED)
        self._publish()

    @property
    def answers(self) -> bool:
        return not acts(self.faults, FaultKind.STALLED)

    def tick(self) -> None:
        """Run the cycles that are due."""
        due = int((self._now() - self._origin) * STEP_HZ)
        while self.cycles < due:
            self.cycle()

    def cycle(self) -> None:
        self.cycles += 1
        edges = [one.rises(bool(self.image.coil[k])) for k, one in enumerate(self._switches)]
        self._supervise()
        self._obey(edges)
        self._take_block()
        self._move()
        self._drop_fetched()
        self._publish()

    def _supervise(self) -> None:
        life = self.image.holding[10]
        if life != self._life or not self.powered:
            self._life, self._life_cycle = life, self.cycles
        if self.cycles - self._life_cycle > SILENT_CYCLES:
            self._trip(SILENT)
        if acts(self.faults, FaultKind.EMERGENCY_STOP):
            self._trip(EMERGENCY_STOP)

    def _trip(self, number: int) -> None:
        self.error = self.error or number
        self._end_motion()

    def _end_motion(self) -> None:
        self.running = False
        self._buffer.clear()
        self.axis.brake()

    def _obey(self, edges: list[bool]) -> None:
        coil = self.image.coil
        if edges[RESET] and self.axis.at_rest and not acts(self.faults, FaultKind.EMERGENCY_STOP):
            self.error = 0
        if edges[POWER] and not self.error:
            self.powered = True
        if coil[STOP]:
            self._end_motion()
        if (not coil[POWER] or self.error) and self.axis.at_rest:
            self.powered = False
        free = self.powered and not self.error and self.axis.at_rest and not coil[STOP]
        if free and edges[START] and self._buffer:
            self.running = True
            self._trace.clear()
            self._trace_first, self._shown_first = 0, -1
            self._write(24, 0)
            self.axis.begin_run()
        elif free and edges[MOVE] and self._read(16) <= self._read(12) <= self._read(18):
            self.axis.travel(self._read(12) * COUNT_M)
            self.axis.current_a = self.image.holding[14] * 1e-4

    def _take_block(self) -> None:
        """Take the block in the window when its number is new and it fits."""
        count, number = self.image.holding[30], self.image.holding[31]
        if number == self._block or self.image.coil[STOP] or not 0 < count <= WINDOW:
            return
        if count > POINTS - len(self._buffer):
            return
        points = [(self._read(40 + 2 * k), self.image.holding[140 + k]) for k in range(count)]
        self._buffer.extend(points)
        self._block = number

    def _move(self) -> None:
        if not self.powered or self.error:
            self.axis.current_a = 0.0
        if not self.running:
            self.axis.idle(1)
            return
        if not self._buffer:
            if self.axis.speed_m_s > SLOW_M_S:
                self._trip(EMPTY)
            self._end_motion()
            self.axis.idle(1)
            return
        counts, current = self._buffer.popleft()
        target = counts * COUNT_M
        if not self._read(16) <= counts <= self._read(18):
            self._trip(OUTSIDE)
        elif abs(target - self.axis.command_m) > self._read(20) * 1e-4 / STEP_HZ + COUNT_M:
            self._trip(TOO_FAST)
        else:
            self.axis.current_a = current * 1e-4
            self.axis.follow_to(target, 1)
            force, position, drawn = self.axis.measured[:3]
            self._trace.append((round(position / COUNT_M), round(force * 10), round(drawn * 1e4)))
            return
        self.axis.idle(1)

    def _drop_fetched(self) -> None:
        wanted = self._read(24)
        while self._trace and self._trace_first < wanted:
            self._trace.popleft()
            self._trace_first += 1

    def _read(self, address: int) -> int:
        high, low = self.image.holding[address], self.image.holding[address + 1]
        return int.from_bytes((high << 16 | low).to_bytes(4), signed=True)

    def _write(self, address: int, value: int) -> None:
        self.image.holding[address], self.image.holding[address + 1] = _words(value)

    def _publish(self) -> None:
        image, axis = self.image, self.axis
        image.discrete[0], image.discrete[1] = int(self.powered), int(self.running)
        image.discrete[2], image.discrete[3] = int(axis.at_rest and not self.running), int(bool(self.error))
        force, position, current, temperature, pressure = axis.measured
        words = image.input
        words[100] = self.error
        for address, value in ((102, self.cycles), (104, round(position / COUNT_M)), (106, round(force * 10))):
            words[address], words[address + 1] = _words(value)
        words[108], words[109] = round(current * 1e4) & 0xFFFF, round(temperature * 10) & 0xFFFF
        words[110] = round(pressure * 1e-4)
        words[120], words[121] = POINTS - len(self._buffer), self._block
        words[130], words[131] = _words(self._trace_first)
        shown = min(len(self._trace), WINDOW)
        kept = words[132] if self._shown_first == self._trace_first else 0  # the window is only added to
        words[132], self._shown_first = shown, self._trace_first
        for k in range(kept, shown):
            position_counts, force_counts, current_counts = self._trace[k]
            words[200 + 2 * k], words[201 + 2 * k] = _words(position_counts)
            words[300 + 2 * k], words[301 + 2 * k] = _words(force_counts)
            words[400 + k] = current_counts & 0xFFFF


def _words(value: int) -> tuple[int, int]:
    return value >> 16 & 0xFFFF, value & 0xFFFF
