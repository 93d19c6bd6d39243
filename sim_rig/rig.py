"""The simulated rig: requests, answers, and supervision of the host's heartbeat."""

from __future__ import annotations

from collections.abc import Callable

from rigctl.device import Control, Fault, RigState
from rigctl.limits import Configuration, Limits
from rigctl.transport import HEARTBEATS, Capability, Identity, Reply, SetpointBlock, Status
from sim_rig.clock import Pace
from sim_rig.controller import Controller, Plant
from sim_rig.faults import FaultKind, Faults
from sim_rig.fifo import CAPTURE_SAMPLES, FIFO_SAMPLES

POLL_SAMPLES = 100  # samples by which a poll advances a waiting clock between runs
POLL_S = 0.01  # shortest interval between polls of a host
MACHINE = Limits()
PATIENCE_S = 5.0
POWERED = (RigState.HOLD, RigState.ACTIVE)


class SimulatedRig:
    """A controller with a clock and a watchdog; the interface for every wire and test."""

    def __init__(
        self,
        plant: Plant,
        *,
        speed: float,
        now: Callable[[], float],
        serial: str = "1",
        faults: Faults | None = None,
        fifo_samples: int = FIFO_SAMPLES,
    ) -> None:
        self._now, self._pace = now, Pace(speed, now)
        self._plant, self.faults = plant, faults or Faults()
        self.controller = Controller(plant, MACHINE, waits=self._pace.waits, fifo_samples=fifo_samples)
        self.starts = 1  # number of times it was switched on
        self._serial = serial
        self._beat_value, self._beat_at = -1, now()
        self._polled = -1
        self.crc_errors = 0
        self.heartbeat = 0
        self._dark = False

    def identity(self) -> Identity:
        return Identity(
            map_version=1,
            vendor="damper-rig",
            model="sim_rig",
            serial=self._serial,
            channel_count=5,
            sample_rate_min_hz=100.0,
            sample_rate_max_hz=5000.0,
            fifo_samples=self.controller.fifo.capacity,
            capture_samples=CAPTURE_SAMPLES,
            capabilities=Capability.CURRENT | Capability.SIMULATED,
            limits=MACHINE,
        )

    def configure(self, configuration: Configuration) -> None:
        """Apply a configuration; RequestRefused where the state or the machine does not allow it."""
        self.controller.configure(configuration)
        self._pace.restart(configuration.sample_rate_hz)

    def command(self, control: Control, run_id: int, heartbeat: int) -> None:
        self.beat(heartbeat)
        before = self.controller.state
        self.controller.command(control, run_id)
        if before not in POWERED:
            self._beat_at = self._now()  # supervision begins with power on

    def direct(self, displacement_m: float, current_a: float, heartbeat: int) -> None:
        self.beat(heartbeat)
        self.controller.direct(displacement_m, current_a)

    def poll(self, heartbeat: int) -> None:
        """Accept a heartbeat; between runs a waiting clock advances by a fixed number of samples.

        The number does not depend on when the poll arrives, so neither do the measurements; a repeated one counts once.
        """
        repeated, self._polled = heartbeat == self._polled, heartbeat
        self.beat(heartbeat)
        if not self._pace.waits or self.controller.state is RigState.ACTIVE:
            self.tick()
        elif not repeated:
            self._pace.take(self.controller.advance(self._pace.at_most(POLL_SAMPLES, POLL_S)))

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, heartbeat: int, most: int) -> Reply:
        """Accept a block, drop acknowledged samples, advance, and return the next captured samples."""
        controller = self.controller
        self.beat(heartbeat)
        refused = block is not None and not controller.accept(block)
        controller.acknowledge(run_id, captured)
        if controller.store.backlog < most and (controller.state is RigState.ACTIVE or not self._pace.waits):
            self._advance()
        return self.reply(refused, most)

    def reply(self, refused: bool, most: int) -> Reply:
        """Return state and captured samples; a repeated call returns the same."""
        controller = self.controller
        return Reply(
            state=controller.state,
            faults=controller.faults,
            last_accepted=controller.fifo.last_accepted,
            fifo_free=controller.fifo.free,
            consumed=controller.fifo.consumed,
            refused=refused,
            heartbeat=self.heartbeat % HEARTBEATS,
            capture=controller.fetch(most),
        )

    def status(self) -> Status:
        controller = self.controller
        force, displacement, current, temperature, pressure = (float(value) for value in controller.measured)
        return Status(
            state=controller.state,
            faults=controller.faults,
            first_fault=controller.first_fault,
            detector=controller.detector,
            run_id=controller.fifo.run_id,
            heartbeat=self.heartbeat,
            fifo_level=controller.fifo.level,
            last_accepted=controller.fifo.last_accepted,
            consumed=controller.fifo.consumed,
            sample_index=controller.sample_index,
            capture_backlog=controller.store.backlog,
            underruns=controller.underruns,
            crc_errors=self.crc_errors,
            duplicates=controller.fifo.duplicates,
            gaps=controller.fifo.gaps,
            arrived=controller.arrived,
            force_n=force,
            displacement_m=displacement,
            current_a=current,
            temperature_degc=temperature,
            pressure_pa=pressure,
        )

    def tick(self) -> None:
        """Advance with the clock and check the watchdog; a server calls this every few milliseconds."""
        if self.faults:
            self._apply_faults()
        if not self.faults.has_begun(FaultKind.HEARTBEAT):
            self.heartbeat = (self.heartbeat + 1) % 0x10000
        controller = self.controller
        silent = self._now() - self._beat_at
        # A rig whose clock waits for the host does not move meanwhile, so its watchdog may be slower.
        patience = max(controller.configuration.heartbeat_s, PATIENCE_S if self._pace.waits else 0.0)
        if controller.state in POWERED and silent > patience:
            controller.fail(Fault.HEARTBEAT)
        if not self._pace.waits or controller.state.moving:
            self._advance()

    def _apply_faults(self) -> None:
        """Apply ordered faults that do not belong to a sample: emergency stop, loss of power."""
        stops = self.faults.select(FaultKind.EMERGENCY_STOP)
        if stops:
            pressed = any(self.faults.remaining_s(order) > 0 for order in stops)
            if pressed != bool(self.controller.standing & Fault.EMERGENCY_STOP):
                self.controller.set_cause(Fault.EMERGENCY_STOP, pressed)
        if self.faults.is_off and not self._dark:
            self._dark = True
            self._lose_power()
        elif self._dark and not self.faults.is_off:
            self._dark = False
            self._pace.restart(self.controller.rate_hz)
            self.starts += 1

    def _lose_power(self) -> None:
        """Reset to the state after a start: disabled where the piston is, without a run."""
        self.controller = Controller(
            self._plant,
            MACHINE,
            waits=self._pace.waits,
            at_m=float(self.controller.measured[1]),
            fifo_samples=self.controller.fifo.capacity,
        )
        self._beat_value, self._beat_at = -1, self._now()

    def _advance(self) -> None:
        if self._dark:
            return
        due = self._pace.due()
        if self._pace.waits and self.controller.state is RigState.ACTIVE:
            due = min(due, self.controller.fifo.level)  # not beyond the end of the stream
        self._pace.take(self.controller.advance(due))

    def beat(self, heartbeat: int) -> None:
        """Note the host's heartbeat, a counter that increases."""
        if heartbeat != self._beat_value:
            self._beat_value, self._beat_at = heartbeat, self._now()
