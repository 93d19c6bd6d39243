"""Any transport with the faults of a wire: each call is one frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias, TypeVar

import numpy as np

from rigctl.clock import Clock
from rigctl.device import Control
from rigctl.errors import TransportError, TransportTimeout
from rigctl.limits import Configuration
from rigctl.transport import Identity, Reply, SetpointBlock, Status, Transport
from sim_rig.faults import Faults
from sim_rig.faulty_wire import FaultyWire

T = TypeVar("T")
STEP_S = 0.002
Call: TypeAlias = Callable[[], Any]  # Any: what the call of the transport underneath returns


class FaultyTransport:
    """Loses, delays, doubles, reorders and damages the requests and answers of another transport.

    A request that arrives too late for its caller is still executed, as on a real wire. A damaged block is
    refused by the rig; other damaged requests never arrive; a damaged answer is an error.
    """

    def __init__(self, inner: Transport, faults: Faults, clock: Clock, *, seed: int = 1) -> None:
        self._inner, self._clock = inner, clock
        self._requests: FaultyWire[tuple[int, Call]] = FaultyWire(faults, clock.now, _damaged_request, seed=seed)
        self._answers: FaultyWire[tuple[int, Call]] = FaultyWire(faults, clock.now, _damaged_answer, seed=seed + 1)
        self._number = 0

    @property
    def url(self) -> str:
        return self._inner.url

    @property
    def block_samples(self) -> int:
        return self._inner.block_samples

    @property
    def capture_samples(self) -> int:
        return self._inner.capture_samples

    @property
    def session(self) -> int:
        return self._inner.session

    def identify(self, deadline_s: float) -> Identity:
        return self._carry(self._inner.identify, deadline_s)

    def claim(self, deadline_s: float) -> int:
        return self._carry(self._inner.claim, deadline_s)

    def release(self, deadline_s: float) -> None:
        return self._carry(self._inner.release, deadline_s)

    def stop(self, deadline_s: float) -> Status:
        return self._carry(self._inner.stop, deadline_s)

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        return self._carry(self._inner.configure, deadline_s, configuration)

    def command(self, control: Control, run_id: int, deadline_s: float) -> Status:
        return self._carry(self._inner.command, deadline_s, control, run_id)

    def direct(self, displacement_m: float, current_a: float, deadline_s: float) -> Status:
        return self._carry(self._inner.direct, deadline_s, displacement_m, current_a)

    def jog(self, displacement_m: float, deadline_s: float) -> Status:
        return self._carry(self._inner.jog, deadline_s, displacement_m)

    def status(self, deadline_s: float) -> Status:
        return self._carry(self._inner.status, deadline_s)

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, deadline_s: float) -> Reply:
        return self._carry(self._inner.exchange, deadline_s, block, run_id, captured)

    def close(self) -> None:
        self._inner.close()

    def _carry(self, call: Callable[..., T], deadline_s: float, *arguments: object) -> T:
        ends = self._clock.now() + deadline_s
        self._number += 1
        self._requests.put((self._number, partial(call, *arguments, deadline_s)))
        while True:
            for number, request in self._requests.take():
                self._answers.put((number, _outcome(request)))
            for number, answer in self._answers.take():
                if number == self._number:  # other numbers are answers to earlier requests
                    found: T = answer()
                    return found
            if self._clock.now() >= ends:
                raise TransportTimeout(f"{self.url}: no answer before the deadline")
            self._clock.sleep(STEP_S)


def _outcome(request: Call) -> Call:
    """Execute a request now; its result is returned when the answer arrives."""
    try:
        return partial(_given, request())
    except TransportError as error:
        return partial(_raised, error)


def _given(value: T) -> T:
    return value


def _raised(error: TransportError) -> None:
    raise error


def _damaged_request(frame: tuple[int, Call], random: np.random.Generator) -> tuple[int, Call] | None:
    number, call = frame
    assert isinstance(call, partial)
    if call.func.__name__ != "exchange":
        return None

    def refused() -> Reply:
        reply: Reply = call.func(None, *call.args[1:])
        return replace(reply, refused=True)

    return number, refused


def _damaged_answer(frame: tuple[int, Call], random: np.random.Generator) -> tuple[int, Call]:
    return frame[0], partial(_raised, TransportError("an answer arrived damaged (CRC)"))
