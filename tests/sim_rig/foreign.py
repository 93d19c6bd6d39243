"""Controllers of other makes in this process and in virtual time: real frames, no sockets, no waiting."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import numpy as np
from numpy.typing import NDArray
from pymodbus.client import ModbusTcpClient
from pymodbus.framer import FramerSocket
from pymodbus.pdu import DecodePDU
from pymodbus.simulator.simcore import SimCore

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.runfile import Run
from sim_rig.faults import Faults, fault_order
from sim_rig.faulty_plant import FaultyPlant
from sim_rig.foreign.image import RegisterController, device
from sim_rig.foreign.serving import Node
from sim_rig.plant import SimulatedPlant
from sim_rig.specimens import SPECIMENS
from tests.sim_rig.virtual import ended

EXAMPLES = Path(__file__).parents[2] / "examples" / "rigs"
STEP_S = 0.0005


class Time:
    """Time that passes only when somebody sleeps; whoever lives by it is told."""

    def __init__(self) -> None:
        self.time = 0.0
        self.living: list[Callable[[], None]] = []

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        """Pass time in small steps: a controller does not wait for its host."""
        ends = self.time + max(seconds, 0.0)
        while self.time < ends - 1e-12:
            self.time = min(self.time + STEP_S, ends)
            for one in self.living:
                one()


class WatchedPlant(SimulatedPlant):
    """Keeps every reading of its sensors and every set-point, one for each millisecond."""

    def __init__(self) -> None:
        found = SPECIMENS["semi-active"]
        super().__init__(found.damper, found.noise, seed=3, start_degc=25.0)
        self.readings: list[NDArray[np.float64]] = []
        self.setpoints: list[NDArray[np.float64]] = []

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        values = super().play(setpoints)
        self.readings.append(values)
        self.setpoints.append(setpoints[:, 0].copy())
        return values

    @property
    def measured(self) -> NDArray[np.float64]:
        return np.concatenate(self.readings)

    @property
    def commanded_m(self) -> NDArray[np.float64]:
        return np.concatenate(self.setpoints)


def faults_and_plant(orders: tuple[str, ...], time: Time) -> tuple[Faults, WatchedPlant, Any]:
    """Ordered faults, the plant, and what the controller plays on. Any: the plant or its faulty double."""
    faults = Faults([fault_order(text) for text in orders], now=time.now)
    plant = WatchedPlant()
    return faults, plant, FaultyPlant(plant, faults)


class ForeignModem(ModbusTcpClient):
    """pymodbus's own client, wired to a controller's registers without a socket; frames are those of the wire."""

    def __init__(self, controller: RegisterController, time: Time, *, call_s: float = 0.001) -> None:
        super().__init__("nowhere", retries=0, timeout=1.0)
        self._controller, self._time, self._call_s = controller, time, call_s
        self._context, self._decoder = SimCore(device(controller)), DecodePDU(True)
        self._answer, self._open, self.killed = b"", False, False
        self._requests: list[bytes] = []

    @property
    def connected(self) -> bool:
        return self._open

    def connect(self) -> bool:
        self._open = True
        return True

    def close(self) -> None:
        """Disconnect: the answer is lost, requests in transit still arrive."""
        self._open, self._answer = False, b""

    def send(self, request: bytes, addr: Any = None) -> int:
        self._time.sleep(self._call_s)
        if self.killed:
            raise Killed
        self._requests.append(request)
        self._answer = b""
        self._serve()
        return len(request)

    def recv(self, size: int | None) -> bytes:
        ends = self._time.now() + (self.comm_params.timeout_connect or 0.0)
        while not self._answer and self._time.now() < ends:
            self._time.sleep(STEP_S)
            self._serve()
        answer, self._answer = self._answer, b""
        return answer

    def _serve(self) -> None:
        """Answer what has arrived, unless the server is stalled; only the last answer reaches this connection."""
        while self._requests and self._controller.answers:
            framer = FramerSocket(self._decoder)
            _, pdu = framer.handleFrame(self._requests.pop(0), 0, 0)
            assert pdu is not None
            response = ended(pdu.datastore_update(self._context, pdu.dev_id))
            response.transaction_id, response.dev_id = pdu.transaction_id, pdu.dev_id
            self._answer = bytes(framer.buildFrame(response))


def worst_departure(run: Run, shown: NDArray[np.float64], channel: str, column: int) -> float:
    """Largest difference between a recorded channel and what the sensors showed, at the best place in time."""
    recorded = run.channels["displacement"]
    starts = range(shown.shape[0] - run.samples + 1)
    place = min(starts, key=lambda k: float(np.abs(shown[k : k + run.samples : 7, 1] - recorded[::7]).max()))
    return float(np.abs(shown[place : place + run.samples, column] - run.channels[channel]).max())


def rests_within_its_limits(plant: WatchedPlant) -> bool:
    """Whether the set-point rests at the end, and never moved faster than the controller's limits allow."""
    steps = np.diff(plant.commanded_m)
    return bool(np.all(steps[-100:] == 0) and np.abs(steps).max() <= 1.5e-3 * 1.001)


class Killed(BaseException):
    """The process of the host has been killed."""


class NodeBus(can.BusABC):
    """A bus in virtual time on which one controller is the only other node."""

    def __init__(self, node: Node, time: Time) -> None:
        self._node, self._time, self._inbox = node, time, list[tuple[int, bytes]]()
        self._late: list[tuple[int, bytes]] = []
        self.killed, self.lose = False, lambda identifier: False
        self.channel_info = "virtual"
        super().__init__("virtual")
        self._is_shutdown = True  # there is nothing to shut down
        time.living.append(self._live)

    def _live(self) -> None:
        while self._node.answers and self._late:
            self._node.take(*self._late.pop(0))
        self._node.tick()
        self._inbox += [frame for frame in self._node.give() if not self.lose(frame[0])]

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if self.killed:
            raise Killed
        self._late.append((msg.arbitration_id, bytes(msg.data)))

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        ends = self._time.now() + (timeout or 0.0)
        while not self._inbox and self._time.now() < ends:
            self._time.sleep(0.0005)
        if not self._inbox:
            return None, True
        identifier, data = self._inbox.pop(0)
        return can.Message(arbitration_id=identifier, data=data, is_extended_id=False), True

    def shutdown(self) -> None:
        """Keep the bus: it may be opened again."""


def slow_sine(
    seconds: float = 2.0, *, kind: Kind = Kind.SINE, frequency_hz: float = 1.0, amplitude_m: float = 0.01
) -> Test:
    """A sine or triangle at 100 Hz, from zero upwards, at a constant current."""
    cycles = np.arange(round(seconds * 100)) * frequency_hz / 100
    x = np.sin(2 * np.pi * cycles) if kind is Kind.SINE else 1 - 4 * np.abs((cycles + 0.25) % 1 - 0.5)
    return Test(
        name="a test",
        excitation=Excitation(
            kind=kind,
            sample_rate_hz=100.0,
            period_samples=round(100 / frequency_hz),
            displacement_m=amplitude_m * x,
            current_a=np.full(cycles.size, 0.6),
            design={},
        ),
    )
