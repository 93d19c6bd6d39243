"""The simulated rig as registers, for Modbus and for the service data objects of CAN."""

from __future__ import annotations

from dataclasses import asdict

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

    def write(self, address: int, words: list[int]) -> None:
        """Execute a write; RequestRefused, LimitError or OverflowError where that is not possible."""
        if address == table.CONTROL.address and len(words) == table.CONTROL.count:
            self._command(words)
        elif address == table.CONFIGURATION.address and len(words) == table.CONFIGURATION.count:
            self._rig.configure(table.configuration_from(table.CONFIGURATION.decode(words)))
        elif address == table.WRITE_HEADER.address:
            self._stream(words)
        elif address == table.HEARTBEAT_ADDRESS and len(words) == 1:
            self._rig.poll(words[0])
        else:
            raise RequestRefused(f"a write of {len(words)} words at 0x{address:04X} is no command of this rig")

    def _command(self, words: list[int]) -> None:
        values = {name: float(value) for name, value in table.CONTROL.decode(words).items()}
        control, heartbeat, command = (int(values[name]) for name in ("control", "heartbeat", "command"))
        if Control.RESET in Control(control) and int(values["reset_key"]) != table.RESET_KEY:
            raise RequestRefused("a reset needs its key")
        if int(values["mode"]) == table.MODE_DIRECT:
            self.direct(values["direct_displacement_m"], values["direct_current_a"], heartbeat, command)
        else:
            self.command(Control(control), int(values["run_id"]), heartbeat, command)

    def command(self, control: Control, run_id: int, heartbeat: int, command: int) -> None:
        """Execute a control word and acknowledge its number."""
        self._rig.command(control, run_id, heartbeat)
        self._acknowledged = command

    def direct(self, displacement_m: float, current_a: float, heartbeat: int, command: int) -> None:
        """Travel and acknowledge the number, or report the refusal."""
        try:
            self._rig.direct(displacement_m, current_a, heartbeat)
        except RequestRefused:
            self._refused_command = command
            raise
        self._acknowledged = command

    def _stream(self, words: list[int]) -> None:
        window = table.decode_write(words)
        self._refused = window is None
        if window is None:
            self._rig.crc_errors += 1
            return
        reply = self._rig.exchange(
            window.block, window.run_id, window.captured, window.heartbeat, table.CAPTURE_SAMPLES
        )
        self._refused = reply.refused

    def read(self, address: int, count: int) -> list[tuple[table.Block, list[int]]]:
        """Return every block of registers that a read touches, as it is now."""
        end = address + count
        return [
            (block, encode())
            for block, encode in (
                (table.IDENTITY, self._identity),
                (table.STATUS, self._status),
                (table.COUNTERS, self._counters),
                (table.ACTUALS, self._actuals),
                (table.MACHINE_LIMITS, self._machine_limits),
                (table.CONFIGURATION, self._configuration),
                (table.READ_HEADER, self._read_window),
            )
            if block.address < end and address < block.address + block.count
        ]

    def _identity(self) -> list[int]:
        identity = self._rig.identity()
        own = {register.name for register in table.IDENTITY.registers} - {"magic"}
        return table.IDENTITY.encode({"magic": table.MAGIC, **{name: getattr(identity, name) for name in own}})

    def _machine_limits(self) -> list[int]:
        return table.MACHINE_LIMITS.encode(asdict(self._rig.identity().limits))

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
        }
        return table.encode_read(head, reply.capture, self._refused, reply.heartbeat)
