"""A console that is driven by files and flags: a drive file is handed over, a response file comes back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.errors import ExcitationFileError
from excitation.rpc3 import Channel, TimeHistory, read_rpc3, write_rpc3
from excitation.signal import Excitation
from rigctl.clock import Clock
from rigctl.device import PressureStage
from rigctl.errors import TransportError, TransportTimeout
from rigctl.limits import Limits
from rigctl.machines.machine import Pumped, Reading, RunLost
from rigctl.machines.response_file import read_response_csv, rows_of, write_drive_csv
from rigctl.machines.rig_map import RigMap
from rigctl.machines.roles import MEASURED
from rigctl.waveform import Waveform

LOOK_S: Final = 0.01
BEAT_S: Final = 0.1  # between two signs of life


class FileConsole:
    """Commands with numbers in one file, states in another; drive and response whole, with a flag for each."""

    takes_whole = True

    def __init__(self, rig: RigMap, clock: Clock) -> None:
        assert rig.files is not None
        self._rig, self._wire, self._clock = rig, rig.files, clock
        self.url = f"files://{rig.files.folder}"
        self._beats, self._beat_at = 0, float("-inf")
        self._start, self._length, self._told, self._done = 0, 0, 0, False

    @property
    def drives_current(self) -> bool:
        return bool(self._wire.drive_current)

    @property
    def unmeasured(self) -> tuple[str, ...]:
        known, named = self._status(), self._wire.channels()
        keys = zip(MEASURED, self._wire.measured(), strict=True)
        return tuple(str(role) for role, (key, _) in keys if key not in known and not named[role])

    def played_waveform(self, excitation: Excitation, waveform: Waveform) -> Waveform:
        return waveform

    def configure(self, limits: Limits, stage: PressureStage, ends: float) -> None:
        """Nothing: the console keeps its own limits, and refuses a drive file that leaves them."""

    def read(self, ends: float) -> Reading:
        status = self._status()
        rate = self._rig.clock.rate_hz
        measured = (status.get(key, 0.0) * scale for key, scale in self._wire.measured())
        return Reading(
            tick=round(status["clock"] * rate) % (1 << self._rig.clock.counter_bits),
            enabled=bool(status["on"]),
            running=bool(status["playing"]),
            at_rest=bool(status["rest"]),
            fault_code=int(status["fault"]),
            values=np.array(list(measured)),
        )

    def beat(self, ends: float) -> None:
        if self._clock.now() - self._beat_at >= BEAT_S:
            self._beats, self._beat_at = self._beats + 1, self._clock.now()
            self._put(self._wire.host_alive, str(self._beats).encode())

    def enable(self, ends: float) -> None:
        self._path(self._wire.stop).unlink(missing_ok=True)
        self._order("ON", ends)

    def disable(self, ends: float) -> None:
        self._order("OFF", ends)

    def stop(self, ends: float) -> None:
        self._put(self._wire.stop, b"stop")

    def reset(self, ends: float) -> None:
        self._order("CLEAR", ends)

    def travel(self, displacement_m: float, current_a: float, ends: float) -> None:
        self._path(self._wire.stop).unlink(missing_ok=True)
        self._order(f"GOTO {displacement_m * 1e3:.6f} {current_a:.4f}", ends)

    def start(self, queue: NDArray[np.float64], total: int, ends: float) -> None:
        """Write the drive file whole, then the flag, and wait until the console has seen it."""
        self._path(self._wire.stop).unlink(missing_ok=True)
        for name in (self._wire.done, self._wire.response):
            self._path(name).unlink(missing_ok=True)
        self._length, self._told, self._done = len(queue), 0, False
        self._write_drive(queue)
        self._start = int(self._status()["start"]) + 1
        self._put(self._wire.start, str(self._start).encode())
        self._await("start", self._start, ends)

    def pump(self, queue: NDArray[np.float64], total: int, ends: float) -> Pumped:
        """Nothing but the count of played points, until the response file is there."""
        if self._done:
            return Pumped(first=self._length)
        flag = self._text(self._wire.done).split()
        if flag and flag[0] == str(self._start):
            self._done = True
            rows = self._read_response()
            if len(flag) > 1 and flag[1].isdecimal():
                rows = rows[: int(flag[1])]
            rows = rows[: self._length]
            taken, self._told = len(rows) - self._told, len(rows)
            return Pumped(taken=taken, first=0, rows=rows)
        played = min(int(self._status()["played"]), self._length)
        taken, self._told = max(played - self._told, 0), max(played, self._told)
        return Pumped(taken=taken)

    def close(self) -> None:
        """Nothing is open."""

    def _write_drive(self, queue: NDArray[np.float64]) -> None:
        wire, rate = self._wire, self._rig.clock.rate_hz
        channels = [Channel(name=wire.drive_position, unit="mm", values=queue[:, 0] * 1e3)]
        if wire.drive_current:
            channels.append(Channel(name=wire.drive_current, unit="A", values=queue[:, 1]))
        temporary = self._path(f".{wire.drive}.new")
        try:
            if wire.format == "rpc3":
                write_rpc3(temporary, TimeHistory(sample_rate_hz=rate, channels=tuple(channels)))
            else:
                write_drive_csv(temporary, channels, rate)
            temporary.replace(self._path(wire.drive))
        except OSError as error:
            raise TransportError(f"{self.url}: the drive file cannot be written ({error})") from error

    def _read_response(self) -> NDArray[np.float64]:
        path = self._path(self._wire.response)
        try:
            history = read_rpc3(path) if self._wire.format == "rpc3" else read_response_csv(path)
            return rows_of(history, self._wire.channels(), self._rig.clock.rate_hz)
        except (OSError, ExcitationFileError) as error:
            raise RunLost(f"{self.url}: the response file cannot be used ({error})") from error

    def _order(self, text: str, ends: float) -> None:
        number = int(self._status()["command"]) + 1
        self._put(self._wire.command, f"{number} {text}".encode())
        self._await("command", number, ends)

    def _await(self, key: str, number: int, ends: float) -> None:
        while int(self._status()[key]) < number:
            if self._clock.now() >= ends:
                raise TransportTimeout(f"{self.url}: the console has not taken {key} {number}: is it in remote mode?")
            self._clock.sleep(LOOK_S)

    def _status(self) -> Mapping[str, float]:
        text = self._text(self._wire.status)
        if not text:
            raise TransportError(f"{self.url}: no {self._wire.status}: the console does not run, or not in this folder")
        try:
            status = {key: float(value) for key, value in (line.split() for line in text.splitlines())}
        except ValueError as error:
            raise TransportError(f"{self.url}: {self._wire.status} is not 'key value' lines ({error})") from error
        missing = [
            key
            for key in ("clock", "on", "playing", "rest", "fault", "command", "start", "played")
            if key not in status
        ]
        if missing:
            raise TransportError(f"{self.url}: {self._wire.status} has no {', '.join(missing)}")
        return status

    def _path(self, name: str) -> Path:
        return self._wire.folder / name

    def _text(self, name: str) -> str:
        try:
            return self._path(name).read_text(encoding="ascii").strip()
        except (OSError, UnicodeDecodeError):
            return ""

    def _put(self, name: str, content: bytes) -> None:
        temporary = self._path(f".{name}.new")
        try:
            temporary.write_bytes(content)
            temporary.replace(self._path(name))
        except OSError as error:
            raise TransportError(f"{self.url}: {name} cannot be written ({error})") from error
