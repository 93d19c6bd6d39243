"""A transport without a wire: the simulated rig in this process, for tests."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import count

from rigctl import modbus_map
from rigctl.clock import Clock
from rigctl.device import Control
from rigctl.errors import RequestDenied
from rigctl.limits import Configuration
from rigctl.session import Session
from rigctl.transport import Identity, Reply, SetpointBlock, Status
from sim_rig.errors import RequestRefused
from sim_rig.rig import SimulatedRig

_NONCES = count(1)


class DirectTransport:
    """Calls a simulated rig; each call takes the time of a transaction on the given clock."""

    url = "direct://sim_rig"
    block_samples = modbus_map.BLOCK_SAMPLES
    capture_samples = modbus_map.CAPTURE_SAMPLES

    def __init__(self, rig: SimulatedRig, clock: Clock, *, call_s: float = 0.0005) -> None:
        self._rig, self._clock, self._call_s = rig, clock, call_s
        self._session, self._nonce = Session(), next(_NONCES)

    @property
    def session(self) -> int:
        return self._session.number

    def identify(self, deadline_s: float) -> Identity:
        self._spend()
        return self._rig.identity()

    def claim(self, deadline_s: float) -> int:
        self._spend()
        with self._refusals():
            self._rig.claim(self._nonce)
        if self._rig.master.session != self._session.number:
            self._session = Session(number=self._rig.master.session)
        return self._session.number

    def release(self, deadline_s: float) -> None:
        self._spend()
        own, self._nonce = self._session, next(_NONCES)
        if self._rig.master.owns(own.number):
            with self._refusals():
                self._rig.release(own.number, own.next_command())
        self._session = Session()

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        self._spend()
        with self._refusals():
            self._rig.configure(configuration, self._session.number, self._session.next_command())

    def command(self, control: Control, run_id: int, deadline_s: float) -> Status:
        self._spend()
        with self._refusals():
            self._rig.command(control, run_id, self._session.number, self._session.next_command())
        return self._rig.status()

    def direct(self, displacement_m: float, current_a: float, deadline_s: float) -> Status:
        self._spend()
        with self._refusals():
            self._rig.direct(displacement_m, current_a, self._session.number, self._session.next_command())
        return self._rig.status()

    def jog(self, displacement_m: float, deadline_s: float) -> Status:
        self._spend()
        with self._refusals():
            self._rig.jog(displacement_m, self._session.number, self._session.next_command())
        return self._rig.status()

    def stop(self, deadline_s: float) -> Status:
        self._spend()
        self._rig.stop()
        return self._rig.status()

    def status(self, deadline_s: float) -> Status:
        self._spend()
        if self._session.claimed:
            self._rig.poll(self._session.number, self._session.next_heartbeat())
        return self._rig.status()

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, deadline_s: float) -> Reply:
        self._spend()
        own = self._session.number
        self._rig.beat(own, self._session.next_heartbeat())
        reply = self._rig.exchange(block, run_id, captured, own, modbus_map.CAPTURE_SAMPLES)
        return replace(reply, owned=self._rig.master.owns(own))

    def close(self) -> None:
        pass

    @contextmanager
    def _refusals(self) -> Iterator[None]:
        try:
            yield
        except RequestRefused as error:
            raise RequestDenied(f"{self.url}: the rig refused: {error}") from error

    def _spend(self) -> None:
        self._clock.sleep(self._call_s)
        self._rig.tick()
