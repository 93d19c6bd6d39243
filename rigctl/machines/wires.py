"""The wires of a map: Modbus TCP, CAN frames, a CANopen node, a folder of files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

from excitation.configuration import STRICT
from rigctl.errors import MapError
from rigctl.machines.registers import Order, Orders, Register
from rigctl.machines.roles import Role


@dataclass(frozen=True, slots=True, kw_only=True)
class ModbusWire:
    """A Modbus TCP server. Orders are those of values of several words; a register may say otherwise."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    host: str
    port: int = 502
    unit: int = 1
    word_order: Order = "high_first"
    byte_order: Order = "high_first"
    most_words: int = 120  # of one request
    gap_words: int = 0  # that may be read between two values, to save a request
    write_single: bool = False  # function 6 for one word instead of 16

    def __post_init__(self) -> None:
        if not 1 <= self.port <= 65535:
            raise MapError(f"port is {self.port}: it must lie in 1 … 65535")
        if not 0 <= self.unit <= 247:
            raise MapError(f"unit is {self.unit}: it must lie in 0 … 247")
        if not 2 <= self.most_words <= 123:
            raise MapError(f"most_words is {self.most_words}: it must lie in 2 … 123, what one request carries")
        if not 0 <= self.gap_words <= 100:
            raise MapError(f"gap_words is {self.gap_words}: it must lie in 0 … 100")

    def orders(self, register: Register) -> Orders:
        """Word and byte order of one value."""
        return Orders(register.word_order or self.word_order, register.byte_order or self.byte_order)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bus:
    """A CAN bus as python-can opens it: SocketCAN, PCAN, Kvaser, Vector and the others, with its bit timing."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    interface: str  # loopback, socketcan, pcan, kvaser, vector, …
    channel: str
    bitrate: int = 500_000
    sample_point: float | None = None  # share of a bit
    sjw: int | None = None  # synchronisation jump width, time quanta
    clock_hz: int | None = None  # of the controller chip; with sample_point: all timing registers are computed
    fd: bool = False
    data_bitrate: int = 2_000_000
    data_sample_point: float | None = None
    app_name: str | None = None  # Vector only

    def __post_init__(self) -> None:
        for name in ("bitrate", "data_bitrate"):
            if not 1_000 <= getattr(self, name) <= 12_000_000:
                raise MapError(f"{name} is {getattr(self, name)}: it must lie in 1 000 … 12 000 000 bit/s")
        for name in ("sample_point", "data_sample_point"):
            point = getattr(self, name)
            if point is not None and not 0.5 <= point < 1:
                raise MapError(f"{name} is {point}: it must lie in 0.5 … 1, as a share of the bit")
        if (self.sample_point is None) != (self.clock_hz is None):
            raise MapError("sample_point and clock belong together: give both or neither")


@dataclass(frozen=True, slots=True, kw_only=True)
class Signal:
    """A value in a CAN frame: by its names in the DBC file, or by its place in the frame."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    role: Role
    message: str = ""  # name in the DBC file
    signal: str = ""
    id: int | None = None  # without a DBC file
    start_bit: int = 0
    bits: int = 16
    order: Order = "low_first"  # low_first: Intel
    signed: bool = False
    real: bool = False
    scale: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        if (self.id is None) == (not self.message):
            raise MapError(f"signal {self.role}: give message and signal of the DBC file, or id, start_bit and bits")
        if self.message and not self.signal:
            raise MapError(f"signal {self.role}: signal is missing: name it as the DBC file does")
        if self.scale == 0:
            raise MapError(f"signal {self.role}: scale is 0: it must not be")
        if self.id is not None and not 1 <= self.bits <= 64:
            raise MapError(f"signal {self.role}: bits is {self.bits}: it must lie in 1 … 64")


@dataclass(frozen=True, slots=True, kw_only=True)
class CanWire:
    """CAN frames of a controller; `id_offset` is added to every identifier of the file, as for a second unit."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    bus: Bus
    dbc: Path | None = None  # beside rig.toml
    id_offset: int = 0
    command_cycle_s: float = 0.02  # command frames are sent again after this time
    stale_s: float = 0.25  # state frames older than this are no answer

    def __post_init__(self) -> None:
        if not -0x7FF <= self.id_offset <= 0x1FFFFFFF:
            raise MapError(f"id_offset is {self.id_offset}: it must lie in -2047 … 536870911")
        if not 0.001 <= self.command_cycle_s <= 0.2:
            raise MapError(f"command_cycle is {self.command_cycle_s} s: it must lie in 0.001 … 0.2")
        if not 0.05 <= self.stale_s <= 2:
            raise MapError(f"stale is {self.stale_s} s: it must lie in 0.05 … 2")


@dataclass(frozen=True, slots=True, kw_only=True)
class CanopenWire:
    """A CANopen drive after CiA 402, described by its EDS file."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    bus: Bus
    eds: Path
    node: int
    counts_per_metre: float  # of positions
    force_object: str = ""  # name in the EDS; empty: the drive measures no force
    force_scale: float = 1.0  # N for one count
    counter_object: str = ""  # counts interpolation periods; mapped into the same PDO as the position
    current_object: str = ""  # name in the EDS of the coil's current; empty: the drive drives none
    current_scale: float = 1e-4  # A for one count
    standstill_bit: int = 14  # of the status word: the manufacturer's, set while the axis stands
    period_s: float = 0.01  # interpolation period
    host_node: int = 127
    heartbeat_s: float = 0.1  # of the host; the drive stops after its own consumer time

    def __post_init__(self) -> None:
        if not 1 <= self.node <= 127 or not 1 <= self.host_node <= 127 or self.node == self.host_node:
            raise MapError(f"node is {self.node}, host_node {self.host_node}: two different numbers in 1 … 127")
        if self.standstill_bit not in (8, 10, 14, 15):
            raise MapError(f"standstill_bit is {self.standstill_bit}: CiA 402 leaves 8, 14 and 15 free, or 10")
        if not self.counts_per_metre > 0:
            raise MapError(f"counts_per_metre is {self.counts_per_metre}: it must be above 0")
        if not 0.001 <= self.period_s <= 0.1:
            raise MapError(f"period is {self.period_s} s: it must lie in 0.001 … 0.1")
        if not 0.01 <= self.heartbeat_s <= 0.5:
            raise MapError(f"heartbeat is {self.heartbeat_s} s: it must lie in 0.01 … 0.5")


@dataclass(frozen=True, slots=True, kw_only=True)
class FileWire:
    """A console that takes a drive file when a start flag appears and puts a response file beside a done flag.

    All names are files in `folder`, which both sides reach.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    folder: Path
    format: Literal["rpc3", "csv"] = "rpc3"
    drive: str = "drive.drv"
    response: str = "response.rsp"
    start: str = "start.flag"
    done: str = "done.flag"
    stop: str = "stop.flag"
    command: str = "command.txt"
    status: str = "status.txt"
    host_alive: str = "host.alive"
    drive_position: str = "Axis"  # channel of the drive file, written in mm
    drive_current: str = ""  # in A; empty: the console drives no current
    response_position: str = "Axis"  # channels of the response file, in the units that it names
    response_force: str = "Load"
    response_current: str = ""
    response_temperature: str = ""
    response_pressure: str = ""

    def __post_init__(self) -> None:
        names = [
            self.drive,
            self.response,
            self.start,
            self.done,
            self.stop,
            self.command,
            self.status,
            self.host_alive,
        ]
        for name in names:
            if not name or Path(name).name != name:
                raise MapError(f"files: {name!r} must be a name of a file in the folder")
        if len(set(names)) != len(names):
            raise MapError("files: two of the names are equal: each file has one purpose")
        if not (self.drive_position and self.response_position and self.response_force):
            raise MapError("files: drive_position, response_position and response_force must name channels")

    def channels(self) -> dict[Role, str]:
        """Names of the response's channels."""
        return {
            Role.POSITION: self.response_position,
            Role.FORCE: self.response_force,
            Role.CURRENT: self.response_current,
            Role.TEMPERATURE: self.response_temperature,
            Role.PRESSURE: self.response_pressure,
        }

    @staticmethod
    def measured() -> tuple[tuple[str, float], ...]:
        """Keys of the status file with their factors to SI, in the order of a captured sample."""
        return (("load_kn", 1e3), ("axis_mm", 1e-3), ("coil_a", 1.0), ("oil_degc", 1.0), ("supply_bar", 1e5))
