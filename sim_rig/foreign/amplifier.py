"""A measuring amplifier of another make beside a controller, with a clock of its own that runs fast or slow.

Its manual (unit 3, big-endian):

    4x    0 record: a rising edge clears the store and begins at sample 0
          2 first sample that is still wanted, 32 bits
    3x    0 first sample of the window, 32 bits; 2 samples in it
        100 force, 40 × REAL kN; 200 coil current, 40 × REAL mA; 300 temperature, 40 × REAL °C

Its store holds 20 000 samples; the oldest are dropped.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.device import PressureStage
from sim_rig.foreign.image import Image
from sim_rig.foreign.servo import STEP_HZ, Plant, Switch

WINDOW: Final = 40
STORE: Final = 20_000
HISTORY: Final = 4_000  # readings of the plant that the amplifier may look back


class TappedPlant:
    """A plant on whose sensors a second cable hangs."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self.readings: deque[NDArray[np.float64]] = deque(maxlen=HISTORY)
        self.steps = 0  # of the loop, since power on

    def set_rate(self, rate_hz: float) -> None:
        self._plant.set_rate(rate_hz)

    def set_stage(self, stage: PressureStage) -> None:
        self._plant.set_stage(stage)

    def begin_run(self) -> None:
        self._plant.begin_run()

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        rows = self._plant.play(setpoints)
        self.readings.extend(rows)
        self.steps += len(rows)
        return rows

    def at(self, time_s: float) -> NDArray[np.float64] | None:
        """Readings at a time since power on, interpolated; None where it is not reached or too long ago."""
        step = time_s * STEP_HZ
        oldest = self.steps - len(self.readings)
        k = int(step) - oldest
        if k < 0 or k + 1 >= len(self.readings):
            return None
        before, after = self.readings[k], self.readings[k + 1]
        row: NDArray[np.float64] = before + (step - int(step)) * (after - before)
        return row


class Amplifier:
    """Samples the plant's sensors at its own rate; `drift` is what its clock gains in a second of true time."""

    unit = 3

    def __init__(self, plant: TappedPlant, *, now: Callable[[], float], rate_hz: float = 500.0, drift: float = 40e-6):
        self._plant, self._now, self._origin = plant, now, now()
        self._period_s = 1.0 / (rate_hz * (1.0 + drift))
        self.image = Image([range(3), range(100, 180), range(200, 280), range(300, 380)], [range(4)])
        self._record = Switch()
        self._store: deque[NDArray[np.float64]] = deque()
        self._first = self._taken = self._shown_first = 0
        self.began_s: float | None = None  # true time of sample 0, for a test to compare with
        self.answers = True

    def tick(self) -> None:
        """Take the samples that are due."""
        if self._record.rises(bool(self.image.holding[0])):
            self._store.clear()
            self._first, self._taken, self._shown_first = 0, 0, -1
            self.began_s = self._now() - self._origin
        while self.began_s is not None:
            row = self._plant.at(self.began_s + self._taken * self._period_s)
            if row is None:
                break
            self._store.append(row[[0, 2, 3]] * np.array([1e-3, 1e3, 1.0]))
            self._taken += 1
        wanted = self.image.holding[2] << 16 | self.image.holding[3]
        while self._store and (self._first < wanted or len(self._store) > STORE):
            self._store.popleft()
            self._first += 1
        self._publish()

    def _publish(self) -> None:
        words, shown = self.image.input, min(len(self._store), WINDOW)
        kept = words[2] if self._shown_first == self._first else 0  # the window is only added to
        words[0], words[1], words[2] = self._first >> 16, self._first & 0xFFFF, shown
        self._shown_first = self._first
        for k in range(kept, shown):
            for start, value in zip((100, 200, 300), self._store[k], strict=True):
                words[start + 2 * k], words[start + 2 * k + 1] = struct.unpack(">HH", struct.pack(">f", value))
