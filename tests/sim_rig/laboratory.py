"""Simulated rigs with a specimen of the test's own, for the laboratory procedures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import Declined, TransportError
from sim_rig.direct import DirectTransport
from sim_rig.parameters import HYPERBOLIC, Damper
from sim_rig.plant import SimulatedPlant
from sim_rig.rig import SimulatedRig
from sim_rig.sensors import Noise
from tests.sim_rig.conftest import FakeClock

NOTHING = Damper(base=HYPERBOLIC, heat_capacity=1e9)  # no specimen: only what is set in it


class LoggedPlant(SimulatedPlant):
    """Keeps every set-point that reached the actuator."""

    commands: list[NDArray[np.float64]]

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        self.commands.append(setpoints[:, 0].copy())
        return super().play(setpoints)


class Laboratory:
    """A rig with one specimen on a clock of the test, and how to reach it."""

    def __init__(self, specimen: Damper, *, seed: int = 3, noise_n: float = 10.0, speed: float = 20.0) -> None:
        self.clock = FakeClock()
        self.plant = LoggedPlant(specimen, Noise(force_n=noise_n), seed=seed, start_degc=22.0)
        self.plant.commands = self.commands = []
        self.rig = SimulatedRig(self.plant, speed=speed, now=self.clock.now)
        self.wire: Any = DirectTransport(self.rig, self.clock)  # Any: a test may wrap it


class Person:
    """Answers as told; keeps the questions."""

    def __init__(
        self, *, yes: bool = True, readings: tuple[float, ...] = (), then: Callable[[str], None] | None = None
    ):
        self.yes, self.readings, self.then = yes, list(readings), then
        self.asked: list[str] = []

    def confirm(self, text: str) -> None:
        self.asked.append(text)
        if self.then is not None:
            self.then(text)
        if not self.yes:
            raise Declined(f"not confirmed: {text}")

    def number(self, text: str, unit: str) -> float:
        self.asked.append(text)
        if not self.readings:
            raise Declined(f"no answer: {text}")
        return self.readings.pop(0)


class CutFrom:
    """A transport whose wire is cut from its n-th call on."""

    def __init__(self, inner: Any, nth: int) -> None:
        self._inner, self._nth, self.calls = inner, nth, 0

    def __getattr__(self, name: str) -> Any:
        """The attribute of the transport. Any: a method or a property."""
        found = getattr(self._inner, name)
        if callable(found):
            self.calls += 1
            if self.calls >= self._nth:
                raise TransportError("the wire is cut")
        return found
