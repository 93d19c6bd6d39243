"""A plain PLC: 10 ms scan, no FIFO, no checksum, REAL in two registers with the low word first, millimetres and kN.

Its manual:

    4x  4096  control word: 0 enable, 1 follow, 2 stop, 3 go to target, 4 reset, 5 generator,
              6 low pressure, taken when the drive is enabled: 10 mm/s, 3.6 kN, and set-points are not followed
        4097  life counter of the host: unchanged for 500 ms while enabled: fault 21
        4098  REAL set-point mm         4100  REAL target mm        4102  REAL coil current A
        4110  shape: 1 sine, 2 triangle; 4111 cycles; 4112 ramp cycles; 4114 REAL amplitude mm; 4116 REAL frequency Hz
    3x  2000  status word: 0 enabled, 1 moving by set-point, 2 standstill, 3 fault
        2001  fault code: 1 emergency stop, 12 set-point outside the stroke, 13 set-point jumps, 21 host silent
        2002  scan counter              2003  scans of the generator
        2004  REAL position mm  2006  REAL force kN  2008  REAL current A  2010  REAL temperature °C  2012  REAL bar

A command acts on its rising edge. After a fault the drive decelerates and switches off; a reset switches nothing on.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable

from rigctl.device import PressureStage
from sim_rig.faults import FaultKind, Faults
from sim_rig.foreign.image import Image
from sim_rig.foreign.ordered import acts
from sim_rig.foreign.servo import SPEED_M_S, STROKE_M, Plant, ServoAxis, Switch

SCAN_S = 0.01
STEPS = 10  # of the loop in one scan
SILENT_S = 0.5
ENABLE, FOLLOW, STOP, GO_TO, RESET, GENERATOR, LOW = range(7)
EMERGENCY_STOP, OUTSIDE, JUMP, SILENT = 1, 12, 13, 21


class Plc:
    """The program of the PLC: inputs are read at the beginning of a scan, outputs written at its end."""

    unit = 7

    def __init__(self, plant: Plant, *, now: Callable[[], float], faults: Faults | None = None) -> None:
        self.axis = ServoAxis(plant)
        self.image = Image([range(2000, 2014)], [range(4096, 4118)])
        self.faults = faults or Faults()
        self._now, self._origin, self.scans = now, now(), 0
        self.enabled = self.following = self.low = False
        self.fault = 0
        self._switches = [Switch() for _ in range(6)]
        self._life, self._life_scan = 0, 0
        self._generated: int | None = None
        self._publish()

    @property
    def answers(self) -> bool:
        return not acts(self.faults, FaultKind.STALLED)

    def tick(self) -> None:
        """Run the scans that are due; a PLC that has lost its power does none."""
        due = int((self._now() - self._origin) / SCAN_S)
        while self.scans < due:
            self.scan()

    def scan(self) -> None:
        """One cycle of the program."""
        self.scans += 1
        edges = [one.rises(bool(self.image.holding[4096] >> k & 1)) for k, one in enumerate(self._switches)]
        self._supervise()
        self._obey(edges)
        self._move()
        self._publish()

    def _supervise(self) -> None:
        life = self.image.holding[4097]
        if life != self._life or not self.enabled:
            self._life, self._life_scan = life, self.scans
        if (self.scans - self._life_scan) * SCAN_S > SILENT_S:
            self._trip(SILENT)
        if acts(self.faults, FaultKind.EMERGENCY_STOP):
            self._trip(EMERGENCY_STOP)

    def _trip(self, code: int) -> None:
        self.fault = self.fault or code
        self.following, self._generated = False, None
        self.axis.brake()

    def _obey(self, edges: list[bool]) -> None:
        word = self.image.holding[4096]
        if edges[RESET] and self.axis.at_rest and not acts(self.faults, FaultKind.EMERGENCY_STOP):
            self.fault = 0
        if edges[ENABLE] and not self.fault:
            self.enabled, self.low = True, bool(word >> LOW & 1)
            self.axis.supply(PressureStage.LOW if self.low else PressureStage.HIGH)
        if word >> STOP & 1 and (self.following or not self.axis.at_rest):
            self.following, self._generated = False, None
            self.axis.brake()
        if (not word >> ENABLE & 1 or self.fault) and self.axis.at_rest:
            self.enabled = False
        free = self.enabled and not self.fault and self.axis.at_rest and not word >> STOP & 1
        if free and edges[FOLLOW] and not self.low:
            self.following = True
            self.axis.begin_run()
        elif free and edges[GENERATOR] and not self.low:
            self.following, self._generated = True, 0
            self.axis.begin_run()
        elif free and edges[GO_TO] and abs(self._real(4100)) <= STROKE_M * 1e3:
            self.axis.travel(self._real(4100) * 1e-3)

    def _move(self) -> None:
        self.axis.current_a = self._real(4102) if self.enabled and not self.fault else 0.0
        if not self.following:
            self.axis.idle(STEPS)
            return
        target = self._generator() if self._generated is not None else self._real(4098) * 1e-3
        if target is None:
            self.following = False
            self.axis.brake()
        elif not abs(target) <= STROKE_M:
            self._trip(OUTSIDE)
        elif abs(target - self.axis.command_m) > SPEED_M_S * SCAN_S:
            self._trip(JUMP)
        else:
            self.axis.follow_to(target, STEPS)
            return
        self.axis.idle(STEPS)

    def _generator(self) -> float | None:
        """Set-point of the generator for this scan; None behind its last cycle."""
        holding = self.image.holding
        amplitude, frequency = self._real(4114) * 1e-3, self._real(4116)
        per_cycle = 1.0 / (frequency * SCAN_S)
        ramp = round(holding[4112] * per_cycle)
        total = round(holding[4111] * per_cycle) + 2 * ramp
        k = self._generated or 0
        if k >= total:
            self._generated = None
            return None
        self._generated = k + 1
        growth = min(1.0, k / ramp, (total - k) / ramp) if ramp else 1.0
        turn = k / per_cycle
        if holding[4110] == 1:
            return amplitude * growth * math.sin(2 * math.pi * turn)
        return amplitude * growth * (1 - 4 * abs((turn + 0.25) % 1.0 - 0.5))

    def _real(self, address: int) -> float:
        low, high = self.image.holding[address], self.image.holding[address + 1]
        return float(struct.unpack("<f", struct.pack("<HH", low, high))[0])

    def _publish(self) -> None:
        axis, words = self.axis, self.image.input
        bits = (self.enabled, self.following, axis.at_rest and not self.following, bool(self.fault))
        words[2000] = sum(bit << k for k, bit in enumerate(bits))
        words[2001], words[2002] = self.fault, self.scans & 0xFFFF
        words[2003] = words[2003] if self._generated is None else self._generated & 0xFFFF
        force, position, current, temperature, pressure = axis.measured
        shown = (position * 1e3, force * 1e-3, current, temperature, pressure * 1e-5)
        for k, value in enumerate(shown):
            words[2004 + 2 * k], words[2005 + 2 * k] = struct.unpack("<HH", struct.pack("<f", value))
