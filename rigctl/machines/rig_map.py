"""``rig.toml``: the map of a foreign controller as data, checked whole before anything is sent."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any, ClassVar, Literal, TypeAlias

from excitation.configuration import STRICT, read_config, to_spec
from excitation.errors import DesignError
from rigctl.device import Fault
from rigctl.errors import MapError
from rigctl.limits import Limits, LowPressure
from rigctl.machines.registers import Register
from rigctl.machines.roles import NEEDED, Role, Way
from rigctl.machines.wires import CanopenWire, CanWire, FileWire, ModbusWire, Signal

FaultName: TypeAlias = Literal[
    "underflow",
    "heartbeat",
    "position_limit",
    "velocity_limit",
    "position_jump",
    "force_limit",
    "following_error",
    "temperature",
    "pressure",
    "capture_overrun",
    "emergency_stop",
    "current_limit",
    "sensor",
    "setpoint",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineClock:
    """The controller's sample clock."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    rate_hz: float  # ticks a second; tests must be sampled at this rate
    counter_bits: Literal[8, 16, 32] = 16  # the tick counter begins again at 0 after so many bits
    longest_gap: int = 2  # missed ticks that are interpolated; more end the test

    def __post_init__(self) -> None:
        if not (isfinite(self.rate_hz) and 1 <= self.rate_hz <= 20_000):
            raise MapError(f"rate is {self.rate_hz} Hz: it must lie in 1 … 20 000")
        if not 0 <= self.longest_gap <= 20:
            raise MapError(f"longest_gap is {self.longest_gap}: it must lie in 0 … 20 ticks")


@dataclass(frozen=True, slots=True, kw_only=True)
class Watchdog:
    """What the controller does when its host is silent. It is the last stop path: a map without one is refused."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    time_s: float  # after which the controller stops by itself
    statement: str  # what it does then, as its manual says; printed before a run

    def __post_init__(self) -> None:
        if not 0.1 <= self.time_s <= 10:
            raise MapError(f"time is {self.time_s} s: it must lie in 0.1 … 10")
        if not self.statement.strip():
            raise MapError("statement is empty: say what the controller does when its host is silent")


@dataclass(frozen=True, slots=True, kw_only=True)
class Generator:
    """The numbers by which a controller names the shapes of its function generator, and its fade-in."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sine: int | None = None
    triangle: int | None = None
    ramp_cycles: int = 2  # over which the amplitude grows and falls, linearly in time

    def __post_init__(self) -> None:
        if self.sine is None and self.triangle is None:
            raise MapError("sine and triangle are missing: give the number of at least one shape")
        if not 1 <= self.ramp_cycles <= 100:
            raise MapError(f"ramp_cycles is {self.ramp_cycles}: it must lie in 1 … 100: a start without is a step")


@dataclass(frozen=True, slots=True, kw_only=True)
class RigMap:
    """Everything about one controller. Exactly one wire; the roles that its way needs."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str
    make: str
    way: Way
    clock: MachineClock
    watchdog: Watchdog
    limits: Limits
    low_pressure: LowPressure | None = None  # what it keeps to then; it is chosen by the role of this name
    serial: str = ""
    simulated: bool = False  # false: a person must agree before it moves
    modbus: ModbusWire | None = None
    can: CanWire | None = None
    canopen: CanopenWire | None = None
    files: FileWire | None = None
    register: tuple[Register, ...] = ()
    signal: tuple[Signal, ...] = ()
    generator: Generator | None = None
    faults: Mapping[str, FaultName] = field(default_factory=dict)  # by the controller's code

    def __post_init__(self) -> None:
        if not self.name.strip() or not self.make.strip():
            raise MapError("name and make must not be empty: they are written into the run files")
        _check_wire(self)
        _check_roles(self)
        _check_overlaps(self.register)
        for code in self.faults:
            if not code.isdecimal():
                raise MapError(f"faults.{code}: it must be the controller's code as a whole number")

    @property
    def roles(self) -> frozenset[Role]:
        """Roles that the map gives a place."""
        return frozenset([one.role for one in self.register] + [one.role for one in self.signal])

    def fault_of(self, code: int) -> Fault:
        """Return the fault that a controller's code means; FOREIGN for a code that the map does not name."""
        name = self.faults.get(str(code))
        return Fault.FOREIGN if name is None else Fault[name.upper()]


def _check_wire(found: RigMap) -> None:
    wires = {"modbus": found.modbus, "can": found.can, "canopen": found.canopen, "files": found.files}
    given = [name for name, wire in wires.items() if wire is not None]
    if len(given) != 1:
        raise MapError(f"wires are {', '.join(given) or 'missing'}: give exactly one of {', '.join(wires)}")
    allowed = {
        "modbus": (Way.STREAMED, Way.BUFFERED, Way.GENERATOR),
        "can": (Way.STREAMED, Way.GENERATOR),
        "canopen": (Way.STREAMED,),
        "files": (Way.FILE,),
    }[given[0]]
    if found.way not in allowed:
        raise MapError(f"way is {found.way}: over {given[0]} it must be {' or '.join(allowed)}")
    if found.way is Way.GENERATOR and found.generator is None:
        raise MapError("generator is missing: say how the controller numbers its shapes")


def _check_roles(found: RigMap) -> None:
    if (found.register and found.modbus is None) or (found.signal and found.can is None):
        raise MapError("register belongs to modbus, signal to can: leave them out on another wire")
    counts = Counter([one.role for one in found.register] + [one.role for one in found.signal])
    twice = [role for role, count in counts.items() if count > 1]
    if twice:
        raise MapError(f"role {twice[0]} is given {counts[twice[0]]} times: once is right")
    if found.modbus is None and found.can is None:
        if found.low_pressure is not None:
            raise MapError("low_pressure: over canopen and files it cannot be chosen, leave it out")
        return
    missing = [role for role in NEEDED[found.way] if role not in counts]
    if missing:
        raise MapError(f"role {missing[0]} is missing: way {found.way} needs {', '.join(missing)} too")
    if (found.low_pressure is None) != (Role.LOW_PRESSURE not in counts):
        raise MapError("low_pressure and the role low_pressure belong together: give both or neither")
    if Role.HOST_COUNTER not in counts:
        raise MapError("role host_counter is missing: the controller must notice when its host has died")


def _check_overlaps(registers: tuple[Register, ...]) -> None:
    """Refuse two values in one place, except different bits of one word."""
    seen: dict[tuple[int, int | None, int, int | None], Register] = {}
    for register in registers:
        for address in range(register.address, register.end):
            bits = range(16) if register.bit is None else (register.bit,)
            for bit in bits if not register.is_coil else (None,):
                key = (register.function, register.unit, address, bit)
                if key in seen:
                    raise MapError(
                        f"register {register.role} at {register.address}: address {address} "
                        f"belongs to {seen[key].role} at {seen[key].address} already"
                    )
                seen[key] = register


def read_rig_map(path: str | os.PathLike[str]) -> RigMap:
    """Read and check a map.

    Raises
    ------
    MapError
        One line: file, key, value and what would be right.
    """
    place = Path(path)
    try:
        found = to_spec(RigMap, read_config(place), str(place))
    except DesignError as error:
        raise MapError(str(error)) from None
    found = _beside(found, place.parent)
    try:
        _check_files(found)
    except MapError as error:
        raise MapError(f"{place}: {error}") from None
    return found


def _check_files(found: RigMap) -> None:
    """Check a map against the file that its controller's maker gave, DBC or EDS."""
    if found.can is not None:
        from rigctl.machines.can_signals import check_signals

        check_signals(found.can, found.signal)
    if found.canopen is not None:
        from rigctl.machines.canopen_map import node_map

        node_map(found.canopen)


def _beside(found: RigMap, folder: Path) -> RigMap:
    """Resolve the paths in a map, which count from the map's own folder."""
    if found.can is not None and found.can.dbc is not None:
        return replace(found, can=replace(found.can, dbc=folder / found.can.dbc))
    if found.canopen is not None:
        return replace(found, canopen=replace(found.canopen, eds=folder / found.canopen.eds))
    if found.files is not None:
        return replace(found, files=replace(found.files, folder=folder / found.files.folder))
    return found
