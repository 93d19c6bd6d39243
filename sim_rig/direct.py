"""A transport without a wire: the simulated rig in this process, for tests."""

from __future__ import annotations

from rigctl import modbus_map
from rigctl.clock import Clock
from rigctl.device import Control
from rigctl.errors import RequestDenied
from rigctl.limits import Configuration
from rigctl.transport import Identity, Reply, SetpointBlock, Status
from sim_rig.errors import RequestRefused
from sim_rig.rig import SimulatedRig


class DirectTransport:
    """Calls a simulated rig; each call takes the time of a transaction on the given clock."""

    url = "direct://sim_rig"
    block_samples = modbus_map.BLOCK_SAMPLES
    capture_samples = modbus_map.CAPTURE_SAMPLES

    def __init__(self, rig: SimulatedRig, clock: Clock, *, call_s: float = 0.0005) -> None:
        self._rig, self._clock, self._call_s = rig, clock, call_s
        self._heartbeat = 0

    def identify(self, deadline_s: float) -> Identity:
        self._spend()
        return self._rig.identity()

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        self._spend()
        try:
            self._rig.configure(configuration)
        except RequestRefused as error:
            raise RequestDenied(f"{self.url}: the rig refused: {error}") from error

    def command(self, control: Control, run_id: int, deadline_s: float) -> Status:
        self._rig.command(control, run_id, self._spend())
        return self._rig.status()

    def direct(self, displacement_m: float, current_a: float, deadline_s: float) -> Status:
        try:
            self._rig.direct(displacement_m, current_a, self._spend())
        except RequestRefused as error:
            raise RequestDenied(f"{self.url}: the rig refused: {error}") from error
        return self._rig.status()

    def status(self, deadline_s: float) -> Status:
        self._rig.poll(self._spend())
        return self._rig.status()

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, deadline_s: float) -> Reply:
        return self._rig.exchange(block, run_id, captured, self._spend(), modbus_map.CAPTURE_SAMPLES)

    def close(self) -> None:
        pass

    def _spend(self) -> int:
        self._clock.sleep(self._call_s)
        self._rig.tick()
        self._heartbeat = (self._heartbeat + 1) % 0x10000
        return self._heartbeat
