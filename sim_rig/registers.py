"""The simulated rig as registers, for Modbus and for the service data objects of CAN."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial

from rigctl import modbus_further
from rigctl import modbus_map as table
from rigctl.device import Control
from sim_rig.errors import RequestRefused
from sim_rig.rig import SimulatedRig


class RegisterDevice:
    """Translates reads and writes of registers to calls of the rig, the same for every wire."""

    def __init__(self, rig: SimulatedRig) -> None:
        self._rig = rig
        self._acknowledged = self._refused_command = 0
        self._refused = False
        self._handlers = {
            (block.address, block.count): handler
            for block, handler in (
                (table.CONTROL, self._command),
                (table.LEASE, self._lease),
                (table.CLAIM, self._claim),
                (table.RELEASE, self._release),
                (table.CONFIGURATION, self._configure),
            )
        }

    def write(self, address: int, words: list[int]) -> None:
        """Execute a write; RequestRefused, LimitError or OverflowError where that is not possible."""
        handler = self._handlers.get((address, len(words)))
        if handler is not None:
            handler(words)
        elif address == table.WRITE_HEADER.address:
            self._stream(words)
        else:
            raise RequestRefused(f"a write of {len(words)} words at 0x{address:04X} is no command of this rig")

    def _command(self, words: list[int]) -> None:
        values = {name: float(value) for name, value in table.CONTROL.decode(words).items()}
        control, session, command = (int(values[name]) for name in ("control", "session", "command"))
        if Control.RESET in Control(control) and int(values["reset_key"]) != table.RESET_KEY:
            raise RequestRefused("a reset needs its key")
        if int(values["mode"]) == table.MODE_JOG:
            self.jog(values["direct_displacement_m"], session, command)
        elif int(values["mode"]) == table.MODE_DIRECT:
            self.direct(values["direct_displacement_m"], values["direct_current_a"], session, command)
        else:
            self.command(Control(control), int(values["run_id"]), session, command)

    def command(self, control: Control, run_id: int, session: int, command: int) -> None:
        """Execute a command and acknowledge its number, or report the refusal."""
        with self._numbered(session, command):
            self._rig.command(control, run_id, session, command)

    def direct(self, displacement_m: float, current_a: float, session: int, command: int) -> None:
        """Travel and acknowledge the number, or report the refusal."""
        with self._numbered(session, command):
            self._rig.direct(displacement_m, current_a, session, command)

    def jog(self, displacement_m: float, session: int, command: int) -> None:
        """Jog and acknowledge the number, or report the refusal."""
        with self._numbered(session, command):
            self._rig.jog(displacement_m, session, command)

    @contextmanager
    def _numbered(self, session: int, command: int) -> Iterator[None]:
        """Acknowledge a command of the master where it was executed; report it as refused where it was not."""
        if not self._rig.master.owns(session):
            yield  # nobody waits for an acknowledgement of this number
            return
        try:
            yield
        except RequestRefused:
            if command == self._rig.master.last_command:
                self._refused_command = command
            raise
        if command != self._refused_command:
            self._acknowledged = command

    def _lease(self, words: list[int]) -> None:
        self._rig.poll(*words)

    def _claim(self, words: list[int]) -> None:
        self._rig.claim(words[0] << 16 | words[1])
        self._acknowledged = self._refused_command = 0

    def _release(self, words: list[int]) -> None:
        self._rig.release(*words)

    def _configure(self, words: list[int]) -> None:
        values = table.CONFIGURATION.decode(words)
        configuration = table.configuration_from(values)
        self._rig.configure(configuration, int(values["session"]), int(values["command"]))

    def _stream(self, words: list[int]) -> None:
        window = table.decode_write(words, following=self._rig.controller.fifo.following)
        self._refused = window is None
        if window is None:
            self._rig.crc_errors += 1
            return
        self._rig.beat(window.session, window.heartbeat)
        reply = self._rig.exchange(window.block, window.run_id, window.captured, window.session, table.CAPTURE_SAMPLES)
        self._refused = reply.refused

    def read(self, address: int, count: int) -> list[tuple[table.Block, list[int]]]:
        """Return every block of registers that a read touches, as it is now."""
        end = address + count
        blocks: tuple[tuple[table.Block, Callable[[], list[int]]], ...] = (
            (table.IDENTITY, self._identity),
            (table.STATUS, self._status),
            (table.COUNTERS, self._counters),
            (table.ACTUALS, self._actuals),
            (table.MACHINE_LIMITS, self._machine_limits),
            (table.CONFIGURATION, self._configuration),
            (table.READ_HEADER, self._read_window),
            *((header, partial(self._further_window, k)) for k, header in enumerate(modbus_further.HEADERS)),
        )
        return [
            (block, encode())
            for block, encode in blocks
            if block.address < end and address < block.address + block.count
        ]

    def _identity(self) -> list[int]:
        identity = self._rig.identity()
        own = {register.name for register in table.IDENTITY.registers} - {"magic"}
        return table.IDENTITY.encode({"magic": table.MAGIC, **{name: getattr(identity, name) for name in own}})

    def _machine_limits(self) -> list[int]:
        identity = self._rig.identity()
        low = identity.low_pressure
        speed, force = (0.0, 0.0) if low is None else (low.velocity_m_s, low.force_n)
        return table.MACHINE_LIMITS.encode({**asdict(identity.limits), "low_velocity_m_s": speed, "low_force_n": force})

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
                "command_refused": self._refused_command,
                "detector": status.detector,
                "standing": int(self._rig.controller.standing),
                "session": status.session,
                "nonce": self._rig.master.nonce,
                "foreign": self._rig.master.foreign % 0x10000,
                "pressure_stage": status.stage.value,
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
                "water_marks": controller.water_marks,
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
            "session": self._rig.master.session,
        }
        return table.encode_read(head, reply.capture, self._refused, reply.heartbeat)

    def _further_window(self, window: int) -> list[int]:
        controller = self._rig.controller
        asked = table.CAPTURE_SAMPLES if controller.configuration.further_axes else 0
        return modbus_further.encode_further(window, controller.fetch(asked))
