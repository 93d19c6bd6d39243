"""A rig in this process on a clock of the test, and a rig in its own process."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.typing import NDArray

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.device import Control
from rigctl.limits import Configuration
from rigctl.session import Session
from sim_rig.faults import Faults, fault_order
from sim_rig.faulty_plant import FaultyPlant
from sim_rig.fifo import FIFO_SAMPLES
from sim_rig.plant import SimulatedPlant
from sim_rig.rig import SimulatedRig
from sim_rig.specimens import SPECIMENS
from tests.starting import Started


class FakeClock:
    """Time that passes only when somebody sleeps."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += max(seconds, 0.0)


class LoggedPlant(SimulatedPlant):
    """Keeps every set-point that reached the actuator."""

    def __init__(self, seed: int) -> None:
        found = SPECIMENS["semi-active"]
        super().__init__(found.damper, found.noise, seed=seed, start_degc=25.0)
        self.commands: list[NDArray[np.float64]] = []
        self.measured: list[NDArray[np.float64]] = []

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        self.commands.append(setpoints[:, 0].copy())
        values = super().play(setpoints)
        self.measured.append(values[:, 1].copy())
        return values

    @property
    def travelled_m(self) -> NDArray[np.float64]:
        """The true position of the piston, also where a sensor fails."""
        return np.concatenate(self.measured)

    def snapshot(self) -> object:
        return super().snapshot(), len(self.commands)

    def restore(self, snapshot: object) -> None:
        assert isinstance(snapshot, tuple)
        snapshot, played = snapshot
        del self.commands[played:], self.measured[played:]
        super().restore(snapshot)

    def fastest_m_s(self, rate_hz: float = 1000.0) -> float:
        return float(np.max(np.abs(np.diff(np.concatenate(self.commands))))) * rate_hz

    def hardest_m_s2(self, rate_hz: float = 1000.0) -> float:
        return float(np.max(np.abs(np.diff(np.concatenate(self.commands), 2)))) * rate_hz**2


class Bench:
    """A simulated rig, its clock, and a log of what it commanded."""

    def __init__(
        self, *, speed: float = 20.0, seed: int = 3, faults: Sequence[str] = (), fifo_samples: int = FIFO_SAMPLES
    ) -> None:
        self.clock = FakeClock()
        self.plant = LoggedPlant(seed)
        ordered = Faults([fault_order(text) for text in faults], now=self.clock.now)
        plant = FaultyPlant(self.plant, ordered) if ordered else self.plant
        self.rig = SimulatedRig(plant, speed=speed, now=self.clock.now, faults=ordered, fifo_samples=fifo_samples)

        self.own = Session()

    def command(self, control: Control, run_id: int = 1) -> None:
        """Send a command as the rig's master."""
        self._claim()
        self.rig.command(control, run_id, self.own.number, self.own.next_command())

    def direct(self, displacement_m: float, current_a: float) -> None:
        self._claim()
        self.rig.direct(displacement_m, current_a, self.own.number, self.own.next_command())

    def configure(self, configuration: Configuration) -> None:
        self._claim()
        self.rig.configure(configuration, self.own.number, self.own.next_command())

    def beat(self) -> None:
        """Give the rig a sign of life, as its master."""
        self._claim()
        self.rig.poll(self.own.number, self.own.next_heartbeat())

    def _claim(self) -> None:
        if self.rig.master.session != self.own.number or not self.own.claimed:
            self.rig.claim(12345 + self.own.number)
            self.own = Session(number=self.rig.master.session)

    def wait(self, seconds: float, step_s: float = 0.005) -> None:
        """Advance time without a host."""
        for _ in range(round(seconds / step_s)):
            self.clock.sleep(step_s)
            self.rig.tick()


@pytest.fixture
def bench() -> Callable[..., Bench]:
    return Bench


def a_sine(samples: int = 400, *, amplitude_m: float = 0.01, frequency_hz: float = 5.0, name: str = "sine") -> Test:
    time = np.arange(samples) / 1000.0
    period = round(1000 / frequency_hz)
    return Test(
        name=name,
        excitation=Excitation(
            kind=Kind.SINE,
            sample_rate_hz=1000.0,
            period_samples=period if period <= samples else 0,
            displacement_m=amplitude_m * np.sin(2 * np.pi * frequency_hz * time),
            current_a=0.8 + 0.4 * np.sin(2 * np.pi * frequency_hz * time),
            design={"kind": "sine", "amplitude": amplitude_m},
        ),
    )


@pytest.fixture(name="a_sine")
def _a_sine() -> Callable[..., Test]:
    return a_sine


SERVE = """
import sys
from sim_rig.server import serve
serve(sys.argv[1], speed=float(sys.argv[2]), seed=3, on_ready=lambda url: print("ready", url, flush=True))
"""


@contextmanager
def a_process(url: str, speed: float) -> Iterator[tuple[subprocess.Popen[str], str]]:
    command = [sys.executable, "-c", SERVE, url, str(speed)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            word, real = process.stdout.readline().split()
            assert word == "ready"
            yield process, real
        finally:
            process.kill()


@contextmanager
def a_fast_sim(url: str) -> Iterator[str]:
    with Started(["sim", "--listen", url, "--speed", "50", "--seed", "3"]) as process:
        yield process.wait_until_ready()


@pytest.fixture(scope="module")
def modbus_rig() -> Iterator[str]:
    with a_fast_sim("modbus://127.0.0.1:0") as url:
        yield url


@pytest.fixture(scope="module")
def can_rig() -> Iterator[str]:
    with a_fast_sim(f"can://loopback/test-{os.getpid()}") as url:
        yield url


@pytest.fixture(scope="module")
def can_fd_rig() -> Iterator[str]:
    with Started(
        ["sim", "--listen", f"can://loopback/test-fd-{os.getpid()}?fd=true", "--speed", "50", "--seed", "3"]
    ) as process:
        yield process.wait_until_ready()


@pytest.fixture
def start_rig() -> Callable[[str, float], object]:
    return a_process
