"""A simulated controller of another make as a process, in real time, until a signal stops it."""

from __future__ import annotations

import asyncio
import signal
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from rigctl.address import can_address, host_and_port, open_bus
from rigctl.errors import UrlError
from rigctl.priority import real_time_priority
from sim_rig.draw import draw
from sim_rig.errors import SimRigError
from sim_rig.faults import FaultKind, Faults, fault_order
from sim_rig.faulty_plant import FaultyPlant
from sim_rig.foreign.amplifier import Amplifier, TappedPlant
from sim_rig.foreign.console import Console
from sim_rig.foreign.ds402 import Drive
from sim_rig.foreign.image import TICK_S, RegisterController, serve_image
from sim_rig.foreign.motion import MotionController
from sim_rig.foreign.ordered import check_faults
from sim_rig.foreign.plc import Plc
from sim_rig.foreign.plc_can import PlcOnCan
from sim_rig.foreign.servo import Plant
from sim_rig.plant import SimulatedPlant
from sim_rig.specimens import SPECIMENS

if TYPE_CHECKING:
    import can


class ControllerKind(StrEnum):
    """The controllers of other makes that can be simulated."""

    PLC = "plc"  # Modbus TCP or CAN: a set-point register, or a function generator
    MOTION = "motion"  # Modbus TCP: a trajectory buffer
    DS402 = "ds402"  # CANopen, CiA 402: interpolated position mode
    CONSOLE = "console"  # a folder: files and flags


class Ticking(Protocol):
    """A controller that lives by being called."""

    def tick(self) -> None: ...


KNOWN_FAULTS = (
    FaultKind.EMERGENCY_STOP,
    FaultKind.STALLED,
    FaultKind.OVER_TEMPERATURE,
    FaultKind.SENSOR_STUCK,
    FaultKind.SENSOR_SATURATED,
    FaultKind.SENSOR_BROKEN,
)


def serve_controller(
    kind: ControllerKind,
    address: str,
    *,
    specimen: str = "semi-active",
    hide: Sequence[str] = (),
    seed: int = 1,
    faults: Sequence[str] = (),
    amplifier: str = "",
    on_ready: Callable[[str], None] = lambda address: None,
) -> None:
    """Serve a controller until SIGTERM or SIGINT; `on_ready` gets the real address.

    `amplifier` is the address of a measuring amplifier on the same sensors, with a clock of its own.

    Raises
    ------
    SpecimenError, FaultError, UrlError, SimRigError
        For a specimen, an effect, a fault or an address that cannot be used, before anything listens.
    """
    ordered = Faults([fault_order(text) for text in faults], now=time.monotonic)
    check_faults(ordered, KNOWN_FAULTS, kind)
    truth = draw(specimen, hide, seed)
    found = SimulatedPlant(truth.damper, SPECIMENS[specimen].noise, seed=seed, start_degc=truth.start_degc)
    plant = TappedPlant(FaultyPlant(found, ordered))
    if amplifier and not (address.startswith("modbus:") and amplifier.startswith("modbus:")):
        raise UrlError("--amplifier belongs to a controller on modbus://HOST:PORT, and listens there too")
    if kind is ControllerKind.CONSOLE:
        _serve_console(address, plant, ordered, on_ready)
    elif kind is ControllerKind.DS402:
        _serve_on_can(address, Drive(plant, now=time.monotonic, faults=ordered), on_ready)
    elif kind is ControllerKind.PLC and address.startswith("can:"):
        _serve_on_can(address, PlcOnCan(Plc(plant, now=time.monotonic, faults=ordered)), on_ready)
    else:
        _serve_registers(kind, address, amplifier, plant, ordered, on_ready)


def _serve_registers(
    kind: ControllerKind,
    address: str,
    amplifier: str,
    plant: TappedPlant,
    ordered: Faults,
    on_ready: Callable[[str], None],
) -> None:
    if not address.startswith("modbus:"):
        raise UrlError(f"--controller {kind} listens on modbus://HOST:PORT, not on {address!r}")
    host, port = host_and_port(address)
    controller: RegisterController
    if kind is ControllerKind.PLC:
        controller = Plc(plant, now=time.monotonic, faults=ordered)
    else:
        controller = MotionController(plant, now=time.monotonic, faults=ordered)
    with real_time_priority():
        beside = (Amplifier(plant, now=time.monotonic), *host_and_port(amplifier)) if amplifier else None
        asyncio.run(_until_signalled(controller, host, port, on_ready, beside))


async def _until_signalled(
    controller: RegisterController,
    host: str,
    port: int,
    on_ready: Callable[[str], None],
    beside: tuple[RegisterController, str, int] | None,
) -> None:
    stop = asyncio.Event()
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(number, stop.set)
    served = [serve_image(controller, host, port, stop, on_ready)]
    if beside is not None:
        served.append(serve_image(*beside, stop, on_ready))
    await asyncio.gather(*served)


def _serve_console(address: str, plant: Plant, faults: Faults, on_ready: Callable[[str], None]) -> None:
    if not address.startswith("files://") or len(address) == len("files://"):
        raise UrlError(f"--controller console works in files://FOLDER, not in {address!r}")
    console = Console(Path(address.removeprefix("files://")), plant, now=time.monotonic, faults=faults)
    _run(console, real_time_priority(), lambda: on_ready(address))


def _serve_on_can(address: str, node: Node, on_ready: Callable[[str], None]) -> None:
    import can

    if not address.startswith("can:"):
        raise UrlError(f"this controller listens on can://loopback/NAME or can://INTERFACE/CHANNEL, not on {address!r}")
    try:
        bus = open_bus(can_address(address), listen=True)
    except (can.CanError, OSError) as error:
        raise SimRigError(f"{address}: cannot be opened ({' '.join(str(error).split())})") from error
    try:
        _run(NodeOnBus(node, bus), real_time_priority(), lambda: on_ready(address))
    finally:
        bus.shutdown()


class Node(Ticking, Protocol):
    """A controller that takes and gives frames."""

    @property
    def answers(self) -> bool: ...

    def take(self, identifier: int, data: bytes) -> None: ...

    def give(self) -> list[tuple[int, bytes]]: ...


class NodeOnBus:
    """A controller and the bus on which it is a node."""

    def __init__(self, node: Node, bus: can.BusABC) -> None:
        self._node, self._bus = node, bus

    def tick(self) -> None:
        import can

        while self._node.answers and (message := self._bus.recv(0.0)) is not None:
            self._node.take(message.arbitration_id, bytes(message.data))
        self._node.tick()
        for identifier, data in self._node.give():
            self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))


def _run(controller: Ticking, priority: AbstractContextManager[object], ready: Callable[[], None]) -> None:
    """Let a controller without sockets live until a signal."""
    told = threading.Event()
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: told.set())
    with priority:
        ready()
        while not told.wait(TICK_S):
            controller.tick()
