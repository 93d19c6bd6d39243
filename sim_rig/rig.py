"""The rig as its wire sees it: requests in, answers out, and the watch on the host's heartbeat."""

from __future__ import annotations

from collections.abc import Callable

from rigctl.device import Control, Fault, RigState
from rigctl.limits import Configuration, Limits
from rigctl.transport import HEARTBEATS, Capability, Identity, Reply, SetpointBlock, Status
from sim_rig.clock import Pace
from sim_rig.controller import Controller, Plant
from sim_rig.faults import FaultKind, Faults
from sim_rig.fifo import CAPTURE_SAMPLES, FIFO_SAMPLES

POLL_SAMPLES = 100  # what a poll lets a waiting clock advance between runs
POLL_S = 0.01  # hosts poll at most so often
MACHINE = Limits()
PATIENCE_S = 5.0
POWERED = (RigState.HOLD, RigState.ACTIVE)


class SimulatedRig:
    """A controller with a clock and a watchdog; every wire and every test talks to it through these calls."""

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
        self.starts = 1  # how often it was switched on
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
        """Take a configuration; RequestRefused where the state or the machine does not allow it."""
        self.controller.configure(configuration)
        self._pace.restart(configuration.sample_rate_hz)

    def command(self, control: Control, run_id: int, heartbeat: int) -> None:
        self.beat(heartbeat)
        before = self.controller.state
        self.controller.command(control, run_id)
        if before not in POWERED:
            self._beat_at = self._now()  # supervision begins with the power

    def direct(self, displacement_m: float, current_a: float, heartbeat: int) -> None:
        self.beat(heartbeat)
        self.controller.direct(displacement_m, current_a)

    def poll(self, heartbeat: int) -> None:
        """Take a sign of life; between runs a waiting clock advances by a fixed number of samples with it.

        However late or early it comes: what is measured must not depend on that. One that is repeated counts once.
        """
        repeated, self._polled = heartbeat == self._polled, heartbeat
        self.beat(heartbeat)
        if not self._pace.waits or self.controller.state is RigState.ACTIVE:
            self.tick()
        elif not repeated:
            self._pace.take(self.controller.advance(self._pace.at_most(POLL_SAMPLES, POLL_S)))

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, heartbeat: int, most: int) -> Reply:
        """Take a block, forget what the host has, go on, and give the next captured samples."""
        controller = self.controller
        self.beat(heartbeat)
        refused = block is not None and not controller.accept(block)
        controller.acknowledge(run_id, captured)
        if controller.store.backlog < most and (controller.state is RigState.ACTIVE or not self._pace.waits):
            self._go_on()
        return self.reply(refused, most)

    def reply(self, refused: bool, most: int) -> Reply:
        """Give state and captured samples; asked again it answers the same."""
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
        """Do what the clock and the watchdog ask for; a server calls this every few milliseconds."""
        if self.faults:
            self._suffer()
        if not self.faults.has(FaultKind.HEARTBEAT):
            self.heartbeat = (self.heartbeat + 1) % 0x10000
        controller = self.controller
        silent = self._now() - self._beat_at
        # A clock that waits for the host moves nothing meanwhile: it may be patient with a busy computer.
        patience = max(controller.configuration.heartbeat_s, PATIENCE_S if self._pace.waits else 0.0)
        if controller.state in POWERED and silent > patience:
            controller.fail(Fault.HEARTBEAT)
        if not self._pace.waits or controller.state.moving:
            self._go_on()

    def _suffer(self) -> None:
        """Let happen what was ordered and no sample shows: the emergency stop, the loss of power."""
        stops = self.faults.of(FaultKind.EMERGENCY_STOP)
        if stops:
            pressed = any(self.faults.left_s(order) > 0 for order in stops)
            if pressed != bool(self.controller.standing & Fault.EMERGENCY_STOP):
                self.controller.stand(Fault.EMERGENCY_STOP, pressed)
        if self.faults.offline and not self._dark:
            self._dark = True
            self._lose_power()
        elif self._dark and not self.faults.offline:
            self._dark = False
            self._pace.restart(self.controller.rate_hz)
            self.starts += 1

    def _lose_power(self) -> None:
        """Be as after a start: disabled where the piston stands, with no memory of any run."""
        self.controller = Controller(
            self._plant,
            MACHINE,
            waits=self._pace.waits,
            at_m=float(self.controller.measured[1]),
            fifo_samples=self.controller.fifo.capacity,
        )
        self._beat_value, self._beat_at = -1, self._now()

    def _go_on(self) -> None:
        if self._dark:
            return
        due = self._pace.due()
        if self._pace.waits and self.controller.state is RigState.ACTIVE:
            due = min(due, self.controller.fifo.level)  # never beyond the stream into the hold after it
        self._pace.take(self.controller.advance(due))

    def beat(self, heartbeat: int) -> None:
        """Take a sign of the host's life: a counter that goes on."""
        if heartbeat != self._beat_value:
            self._beat_value, self._beat_at = heartbeat, self._now()
