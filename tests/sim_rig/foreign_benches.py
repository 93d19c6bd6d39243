"""Controllers of other makes, each with its plant and a host, on one virtual clock."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from excitation.plan import Test
from rigctl.machines.can_points import CanPoints
from rigctl.machines.canopen_map import node_map
from rigctl.machines.canopen_node import CanopenNode
from rigctl.machines.ds402 import Ds402Machine
from rigctl.machines.file_console import FileConsole
from rigctl.machines.modbus_points import ModbusPoints
from rigctl.machines.register_machine import RegisterMachine
from rigctl.machines.rig_map import RigMap, read_rig_map
from rigctl.machines.transport import MachineTransport
from rigctl.player import PlayerSettings, play
from rigctl.runfile import Run, read_run
from sim_rig.foreign.console import Console
from sim_rig.foreign.ds402 import Drive
from sim_rig.foreign.motion import MotionController
from sim_rig.foreign.plc import Plc
from sim_rig.foreign.plc_can import PlcOnCan
from tests.sim_rig.foreign import EXAMPLES, ForeignModem, Killed, NodeBus, Time, faults_and_plant, slow_sine

SCAN = 10  # readings of the loop in one scan of the PLC
PERIOD = 10  # steps of the loop in one interpolation period of the drive
SETTINGS = PlayerSettings(ramp_s=0.2)


class PlcBench:
    """The PLC, its plant and a host, all on one virtual clock."""

    def __init__(self, example: str = "plc_streamed", *orders: str) -> None:
        self.time = Time()
        faults, self.plant, played = faults_and_plant(orders, self.time)
        self.plc = Plc(played, now=self.time.now, faults=faults)
        self.time.living.append(self.plc.tick)
        self.modem = ForeignModem(self.plc, self.time)
        self.rig = read_rig_map(EXAMPLES / f"{example}.toml")
        assert self.rig.modbus is not None
        points = ModbusPoints(self.rig.modbus, self.rig.register, clock=self.time, client=self.modem)
        self.transport = MachineTransport(self.rig, RegisterMachine(self.rig, points, self.time), clock=self.time)

    def another_host(self) -> MachineTransport:
        """A host in another process, which knows nothing of this one."""
        assert self.rig.modbus is not None
        modem = ForeignModem(self.plc, self.time)
        points = ModbusPoints(self.rig.modbus, self.rig.register, clock=self.time, client=modem)
        return MachineTransport(self.rig, RegisterMachine(self.rig, points, self.time), clock=self.time)

    def play(self, test: Test, folder: Path, **more: object) -> Run:
        return read_run(play(self.transport, test, folder, clock=self.time, **more))  # type: ignore[arg-type]

    def scanned(self) -> np.ndarray:
        """What the PLC showed at the end of each scan, (scans, 5), after the readings at switch-on."""
        measured = self.plant.measured[4:]
        return measured[SCAN - 1 :: SCAN]


class CanBench:
    """The PLC on its bus, its plant and a host, all on one virtual clock."""

    def __init__(self, *orders: str, rig: RigMap | None = None) -> None:
        self.time = Time()
        faults, self.plant, played = faults_and_plant(orders, self.time)
        self.plc = Plc(played, now=self.time.now, faults=faults)
        self.bus = NodeBus(PlcOnCan(self.plc), self.time)
        rig = rig or read_rig_map(EXAMPLES / "plc_can.toml")
        assert rig.can is not None
        points = CanPoints("can://virtual", rig.can, rig.signal, lambda: self.bus, self.time)
        self.transport = MachineTransport(rig, RegisterMachine(rig, points, self.time), clock=self.time)

    def play(self, folder: Path, seconds: float = 2.0, **more: object) -> Run:
        return read_run(play(self.transport, slow_sine(seconds), folder, clock=self.time, **more))  # type: ignore[arg-type]


class MotionBench:
    """The motion controller, its plant and a host, all on one virtual clock."""

    def __init__(self, *orders: str, call_s: float = 0.0005) -> None:
        self.time = Time()
        faults, self.plant, played = faults_and_plant(orders, self.time)
        self.controller = MotionController(played, now=self.time.now, faults=faults)
        self.time.living.append(self.controller.tick)
        self.modem = ForeignModem(self.controller, self.time, call_s=call_s)
        rig = read_rig_map(EXAMPLES / "motion_buffered.toml")
        assert rig.modbus is not None
        points = ModbusPoints(rig.modbus, rig.register, clock=self.time, client=self.modem)
        self.transport = MachineTransport(rig, RegisterMachine(rig, points, self.time), clock=self.time)

    def play(self, test: Test, folder: Path, **more: object) -> Run:
        return read_run(play(self.transport, test, folder, clock=self.time, settings=SETTINGS, **more))  # type: ignore[arg-type]


class DriveBench:
    """The drive, its plant and a host, all on one virtual clock."""

    def __init__(self, *orders: str) -> None:
        self.time = Time()
        faults, self.plant, played = faults_and_plant(orders, self.time)
        self.drive = Drive(played, now=self.time.now, faults=faults)
        self.bus = NodeBus(self.drive, self.time)
        rig = read_rig_map(EXAMPLES / "ds402.toml")
        assert rig.canopen is not None
        node = CanopenNode("canopen://virtual", node_map(rig.canopen), lambda: self.bus, self.time)
        self.machine = Ds402Machine(rig, node, self.time)
        self.transport = MachineTransport(rig, self.machine, clock=self.time)

    def play(self, test: Test, folder: Path, **more: object) -> Run:
        return read_run(play(self.transport, test, folder, clock=self.time, settings=SETTINGS, **more))  # type: ignore[arg-type]

    def periods(self) -> np.ndarray:
        """What the drive showed at the end of each period."""
        return self.plant.measured[4:][PERIOD - 1 :: PERIOD]


class ConsoleBench:
    """The console, its plant and a host, on one virtual clock and in one folder."""

    def __init__(self, folder: Path, *orders: str) -> None:
        self.time, self.killed = Time(), False
        faults, self.plant, played = faults_and_plant(orders, self.time)
        self.console = Console(folder / "console", played, now=self.time.now, faults=faults)
        self.time.living.append(self.console.tick)
        rig = read_rig_map(EXAMPLES / "console_file.toml")
        assert rig.files is not None
        rig = replace(rig, files=replace(rig.files, folder=folder / "console"))
        self.transport = MachineTransport(rig, FileConsole(rig, self), clock=self)

    def now(self) -> float:
        return self.time.now()

    def sleep(self, seconds: float) -> None:
        """The host's clock: a host that was killed never comes back from it."""
        if self.killed:
            raise Killed
        self.time.sleep(seconds)

    def play(self, test: Test, folder: Path, **more: object) -> Run:
        return read_run(play(self.transport, test, folder, clock=self, settings=SETTINGS, **more))  # type: ignore[arg-type]

    def shown(self) -> np.ndarray:
        """Readings of the sensors at the points of the drive file, counted from the last one back."""
        return self.plant.measured
