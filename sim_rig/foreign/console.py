"""A test console that works with files and flags, as consoles of servo-hydraulic rigs do.

Its manual. In its folder, looked at every 20 ms:

    command.txt   "NUMBER VERB [VALUES]"; a number above the last one acts: ON, OFF, GOTO MM AMPERES, CLEAR
    drive.drv     RPC III: a channel "Axis" in mm, and optionally "Coil" in A
    start.flag    "NUMBER": a new number plays the drive file, from rest at its first value, at its own rate
    stop.flag     decelerates; as long as it is there nothing starts
    host.alive    its content must change at least once a second while the hydraulics are on, else fault 7

It writes, always whole: every 50 ms status.txt ("key value" lines), and after each motion, also a stopped one,
response.rsp (RPC III, 32-bit floats: "Axis" mm, "Load" kN, "Coil" A, "Oil" degC, "Supply" bar) and then done.flag
("NUMBER POINTS").

Faults: 1 emergency stop, 5 drive file refused, 7 host silent. After a fault it decelerates and switches off; CLEAR
switches nothing on.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.errors import ExcitationFileError
from excitation.rpc3 import read_rpc3
from sim_rig.faults import FaultKind, Faults
from sim_rig.foreign.ordered import acts
from sim_rig.foreign.servo import SPEED_M_S, STEP_HZ, STROKE_M, Plant, ServoAxis

POLL_STEPS: Final = 20
STATUS_STEPS: Final = 50
SILENT_STEPS: Final = 1000
EMERGENCY_STOP, REFUSED, SILENT = 1, 5, 7


class Console:
    """The console's program; it and its host share nothing but a folder."""

    def __init__(self, folder: Path, plant: Plant, *, now: Callable[[], float], faults: Faults | None = None) -> None:
        self.axis, self.folder = ServoAxis(plant), folder
        self.faults = faults or Faults()
        self._now, self._origin, self.steps = now, now(), 0
        self.on = self.playing = False
        self.fault = 0
        self._command = self._start = self._played = 0
        self._alive, self._alive_step = "", 0
        self._drive: NDArray[np.float64] = np.empty((0, 2))
        self._every = 1  # steps of the loop to one point of the drive file
        self._measured: list[NDArray[np.float64]] = []
        folder.mkdir(parents=True, exist_ok=True)
        self._report()

    @property
    def answers(self) -> bool:
        return not acts(self.faults, FaultKind.STALLED)

    def tick(self) -> None:
        """Run the steps that are due."""
        due = int((self._now() - self._origin) * STEP_HZ)
        while self.steps < due:
            self.step()

    def step(self) -> None:
        self.steps += 1
        if self.steps % POLL_STEPS == 0 and self.answers:
            self._look()
        if acts(self.faults, FaultKind.EMERGENCY_STOP):
            self._trip(EMERGENCY_STOP)
        if self.on and self.steps - self._alive_step > SILENT_STEPS:
            self._trip(SILENT)
        self._move()
        if self.fault and self.axis.at_rest:
            self.on = False
        if self.steps % STATUS_STEPS == 0 and self.answers:
            self._report()

    def _look(self) -> None:
        """Look at the folder."""
        alive = self._text("host.alive")
        if alive != self._alive or not self.on:
            self._alive, self._alive_step = alive, self.steps
        stopped = (self.folder / "stop.flag").exists()
        if stopped:
            self._end()
        words = self._text("command.txt").split()
        if len(words) >= 2 and words[0].isdecimal() and int(words[0]) > self._command:
            self._command = int(words[0])
            self._obey(words[1], words[2:], stopped)
        number = self._text("start.flag")
        if number.isdecimal() and int(number) != self._start:
            self._start = int(number)
            if self.on and not self.fault and self.axis.at_rest and not stopped:
                self._load()

    def _obey(self, verb: str, values: list[str], stopped: bool) -> None:
        if verb == "ON" and not self.fault and self.axis.at_rest:
            self.on = True
            self._alive_step = self.steps
        elif verb == "OFF" and self.axis.at_rest and not self.playing:
            self.on = False
        elif verb == "CLEAR" and self.axis.at_rest and not acts(self.faults, FaultKind.EMERGENCY_STOP):
            self.fault = 0
        elif verb == "GOTO" and self.on and not self.fault and not stopped and abs(float(values[0])) <= STROKE_M * 1e3:
            self.axis.travel(float(values[0]) * 1e-3)
            self.axis.current_a = float(values[1])

    def _load(self) -> None:
        """Read the drive file and check all of it before the first point is played."""
        try:
            history = read_rpc3(self.folder / "drive.drv")
            channels = {one.name: one.values for one in history.channels}
            points = channels["Axis"] * 1e-3
        except (OSError, ExcitationFileError, KeyError):
            self._trip(REFUSED)
            return
        every = STEP_HZ / history.sample_rate_hz
        coil = channels.get("Coil", np.zeros(points.size))
        speed = np.abs(np.diff(points, prepend=self.axis.command_m)) * history.sample_rate_hz
        if every != round(every) or np.abs(points).max() > STROKE_M or speed.max() > SPEED_M_S:
            self._trip(REFUSED)
            return
        self._drive, self._every = np.column_stack([points, coil]), round(every)
        self._measured, self._played, self.playing = [], 0, True
        self.axis.begin_run()

    def _trip(self, number: int) -> None:
        self.fault = self.fault or number
        self._end()

    def _end(self) -> None:
        if self.playing or not self.axis.at_rest:
            self.playing = False
            self.axis.brake()

    def _move(self) -> None:
        if not self.on:
            self.axis.current_a = 0.0
        if not self.playing:
            self.axis.idle(1)
            if self._measured and self.axis.at_rest:
                self._hand_over()
            return
        at, within = divmod(self._played, self._every)
        if at == len(self._drive):
            self.playing = False
            self.axis.brake()
            self.axis.idle(1)
            return
        before = self.axis.command_m
        target, self.axis.current_a = self._drive[at]
        self.axis.follow(np.array([before, before + (target - before) / (self._every - within)])[1:])
        self._played += 1
        if within == self._every - 1:
            self._measured.append(self.axis.measured)

    def _hand_over(self) -> None:
        """Write the response file, then the flag that says so."""
        rows = np.array(self._measured)
        self._measured = []
        scaled = rows[:, [1, 0, 2, 3, 4]] * np.array([1e3, 1e-3, 1.0, 1.0, 1e-5])
        names = (("Axis", "mm"), ("Load", "kN"), ("Coil", "A"), ("Oil", "degC"), ("Supply", "bar"))
        self._put("response.rsp", response(scaled, names, STEP_HZ / self._every))
        self._put("done.flag", f"{self._start} {len(rows)}".encode())

    def _report(self) -> None:
        force, position, current, temperature, pressure = self.axis.measured
        values = {
            "clock": f"{self.steps / STEP_HZ:.3f}",
            "on": int(self.on),
            "playing": int(self.playing),
            "rest": int(self.axis.at_rest and not self.playing and not self._measured),
            "fault": self.fault,
            "command": self._command,
            "start": self._start,
            "played": self._played // self._every,
            "axis_mm": f"{position * 1e3:.4f}",
            "load_kn": f"{force * 1e-3:.4f}",
            "coil_a": f"{current:.4f}",
            "oil_degc": f"{temperature:.1f}",
            "supply_bar": f"{pressure * 1e-5:.1f}",
        }
        self._put("status.txt", "".join(f"{key} {value}\n" for key, value in values.items()).encode())

    def _text(self, name: str) -> str:
        try:
            return (self.folder / name).read_text(encoding="ascii").strip()
        except (OSError, UnicodeDecodeError):
            return ""

    def _put(self, name: str, content: bytes) -> None:
        temporary = self.folder / f".{name}.new"
        temporary.write_bytes(content)
        temporary.replace(self.folder / name)


def response(rows: NDArray[np.float64], names: tuple[tuple[str, str], ...], rate_hz: float) -> bytes:
    """An RPC III file as this console writes it: big-endian floats, frames of 256 points, the last one padded."""
    frames = -(-len(rows) // 256)
    padded = np.concatenate([rows, np.tile(rows[-1], (frames * 256 - len(rows), 1))])
    records = [
        ("FORMAT", "BINARY_IEEE_BIG_END"),
        ("NUM_HEADER_BLOCKS", "8"),
        ("NUM_PARAMS", str(11 + 2 * len(names))),
        ("FILE_TYPE", "TIME_HISTORY"),
        ("TIME_TYPE", "RESPONSE"),
        ("DELTA_T", repr(1.0 / rate_hz)),
        ("CHANNELS", str(len(names))),
        ("PTS_PER_FRAME", "256"),
        ("PTS_PER_GROUP", "256"),
        ("FRAMES", str(frames)),
        ("DATA_TYPE", "FLOATING_POINT"),
    ]
    for k, (name, unit) in enumerate(names, start=1):
        records += [(f"DESC.CHAN_{k}", name), (f"UNITS.CHAN_{k}", unit)]
    header = b"".join(struct.pack("32s96s", key.encode(), value.encode()) for key, value in records)
    data = padded.reshape(frames, 256, len(names)).transpose(0, 2, 1)
    return header.ljust(8 * 512, b"\0") + data.astype(">f4").tobytes()
