"""From a rig.toml to the transport of its controller."""

from __future__ import annotations

from collections.abc import Callable

from rigctl.clock import Clock, SystemClock
from rigctl.machines.machine import Machine
from rigctl.machines.rig_map import RigMap, read_rig_map
from rigctl.machines.transport import MachineTransport


def connect_machine(path: str, *, clock: Clock | None = None) -> MachineTransport:
    """Return the transport to the controller of a map; nothing is sent yet. MapError where the map is wrong."""
    rig, used = read_rig_map(path), clock or SystemClock()
    return MachineTransport(rig, _machine(rig, used), clock=used)


def _machine(rig: RigMap, clock: Clock) -> Machine:
    makers: tuple[tuple[object, Callable[[RigMap, Clock], Machine]], ...] = (
        (rig.modbus, _over_modbus),
        (rig.files, _over_files),
        (rig.canopen, _over_canopen),
        (rig.can, _over_can),
    )
    return next(make for wire, make in makers if wire is not None)(rig, clock)


def _over_modbus(rig: RigMap, clock: Clock) -> Machine:
    from rigctl.machines.modbus_points import ModbusPoints
    from rigctl.machines.register_machine import RegisterMachine

    assert rig.modbus is not None
    return RegisterMachine(rig, ModbusPoints(rig.modbus, rig.register, clock=clock), clock)


def _over_files(rig: RigMap, clock: Clock) -> Machine:
    from rigctl.machines.file_console import FileConsole

    return FileConsole(rig, clock)


def _over_canopen(rig: RigMap, clock: Clock) -> Machine:
    from rigctl.machines.can_bus import open_bus
    from rigctl.machines.canopen_map import node_map
    from rigctl.machines.canopen_node import CanopenNode
    from rigctl.machines.ds402 import Ds402Machine

    assert rig.canopen is not None
    bus = rig.canopen.bus
    url = f"canopen://{bus.interface}/{bus.channel}?node={rig.canopen.node}"
    return Ds402Machine(rig, CanopenNode(url, node_map(rig.canopen), lambda: open_bus(bus), clock), clock)


def _over_can(rig: RigMap, clock: Clock) -> Machine:
    from rigctl.machines.can_bus import open_bus
    from rigctl.machines.can_points import CanPoints
    from rigctl.machines.register_machine import RegisterMachine

    assert rig.can is not None
    wire = rig.can
    url = f"can://{wire.bus.interface}/{wire.bus.channel}"
    return RegisterMachine(rig, CanPoints(url, wire, rig.signal, lambda: open_bus(wire.bus), clock), clock)
