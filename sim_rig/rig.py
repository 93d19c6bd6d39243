"""The simulated rig: requests, answers, and supervision of the host's heartbeat."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from rigctl.device import Control, Fault, RigState
from rigctl.interlocks import CHANNELS
from rigctl.limits import Configuration, Limits, LowPressure
from rigctl.modbus_map import MAP_VERSION
from rigctl.scaling import SAMPLE_RATE_HZ
from rigctl.session import NOBODY
from rigctl.transport import HEARTBEATS, Capability, CaptureBlock, Identity, Reply, SetpointBlock, Status
from sim_rig.clock import Pace
from sim_rig.controller import UNPOWERED, Controller, Plant
from sim_rig.errors import RequestRefused
from sim_rig.faults import FaultKind, Faults
from sim_rig.fifo import CAPTURE_SAMPLES, FIFO_SAMPLES
from sim_rig.master import Master

POLL_SAMPLES = 100  # samples by which a poll advances a waiting clock between runs
POLL_S = 0.01  # shortest interval between polls of a host
# 25 kN on 60 kg of piston and rod and 40 kg of fixture: 250 m/s². The valve (2.4 m/s, 120 Hz) could do more.
MACHINE = replace(Limits(), acceleration_m_s2=250.0)
LOW_PRESSURE = LowPressure(velocity_m_s=0.01, force_n=2.5e3)
"""10 mm/s is the reduced speed of presses under hold-to-run control (EN 693); a tenth of the force limit holds a
fixture of 100 kg with its friction, and is less than the low supply can push (sim_rig.plant.LOW_SUPPLY)."""
PATIENCE_S = 5.0
WATCHDOG_S = (0.25, 10.0)  # the host's silence that a configuration may allow
POWERED = (RigState.HOLD, RigState.ACTIVE)
FAULT_HOLD_S = 10.0
"""How long the pressure stays on after a fault for which nobody has cared. A host that lives switches it off within a
second; longer only heats the oil, shorter takes from an operator the time to look at a rig that stands still."""


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
        self.controller = Controller(plant, MACHINE, LOW_PRESSURE, waits=self._pace.waits, fifo_samples=fifo_samples)
        self.starts = 1  # number of times it was switched on
        self._serial = serial
        self.master = Master(now)
        self._held_since: float | None = None  # in FAULT_HOLD
        self.crc_errors = 0
        self.heartbeat = 0
        self._dark = False

    def identity(self) -> Identity:
        return Identity(
            map_version=MAP_VERSION,
            vendor="damper-rig",
            model="sim_rig",
            serial=self._serial,
            channel_count=self.controller.measured.size,
            sample_rate_min_hz=100.0,
            sample_rate_max_hz=5000.0,
            fifo_samples=self.controller.fifo.capacity,
            capture_samples=CAPTURE_SAMPLES,
            capabilities=self._capabilities,
            limits=MACHINE,
            low_pressure=LOW_PRESSURE,
            rate_step_hz=SAMPLE_RATE_HZ,
        )

    @property
    def _capabilities(self) -> Capability:
        several = self.controller.measured.size > len(CHANNELS)
        return Capability.CURRENT | Capability.SIMULATED | (Capability.FURTHER_AXES if several else Capability.NONE)

    def claim(self, nonce: int) -> None:
        """Begin the session of a host; RequestRefused where another one commands the rig."""
        powered = self.controller.state in (*POWERED, RigState.FAULT_REACTION)
        if self.master.claim(nonce, powered=powered):
            self.controller.begin_session(self.master.session)

    def release(self, session: int, number: int) -> None:
        """End a session; RequestRefused where the rig has power."""
        if self.master.obeys(session, number):
            if self.controller.state not in UNPOWERED:
                raise RequestRefused(f"the session cannot end in {self.controller.state.name}: send DISABLE first")
            self.master.end()

    def stop(self) -> None:
        """Stop and switch the power off, whoever asks; the session ends, so that nothing that is in transit starts."""
        self.controller.command(Control.DISABLE, 0)
        self.master.end()

    def configure(self, configuration: Configuration, session: int, number: int) -> None:
        """Apply a configuration; RequestRefused where the session, the state or the machine does not allow it."""
        if self.master.obeys(session, number):
            identity = self.identity()
            if not identity.sample_rate_min_hz <= configuration.sample_rate_hz <= identity.sample_rate_max_hz:
                raise RequestRefused(f"sample rate {configuration.sample_rate_hz:g} Hz is not played here")
            if not WATCHDOG_S[0] <= configuration.heartbeat_s <= WATCHDOG_S[1]:
                raise RequestRefused(f"a watchdog of {configuration.heartbeat_s:g} s is not allowed here")
            if configuration.further_axes and Capability.FURTHER_AXES not in identity.capabilities:
                raise RequestRefused("this rig measures no further axes")
            self.controller.configure(configuration)
            self._pace.restart(configuration.sample_rate_hz)

    def command(self, control: Control, run_id: int, session: int, number: int) -> None:
        """Obey a command of the master; DISABLE without a session is a stop, from anybody."""
        if session == NOBODY and control == Control.DISABLE:
            self.stop()
        elif self.master.obeys(session, number):
            before = self.controller.state
            self.controller.command(control, run_id)
            if before not in POWERED:
                self.master.supervise()  # supervision begins with power on

    def direct(self, displacement_m: float, current_a: float, session: int, number: int) -> None:
        if self.master.obeys(session, number):
            self.controller.direct(displacement_m, current_a)

    def jog(self, displacement_m: float, session: int, number: int) -> None:
        if self.master.obeys(session, number):
            self.controller.jog(displacement_m)

    def poll(self, session: int, beat: int) -> None:
        """Accept a heartbeat; between runs a waiting clock advances by a fixed number of samples.

        The number does not depend on when the poll arrives, so neither do the measurements; a repeated one counts once.
        """
        new = self.beat(session, beat)
        if not self._pace.waits or self.controller.state is RigState.ACTIVE:
            self.tick()
        elif new:
            self._pace.take(self.controller.advance(self._pace.at_most(POLL_SAMPLES, POLL_S)))

    def beat(self, session: int, beat: int) -> bool:
        """Accept a heartbeat of the master; anybody else's, or one that was used before, has no effect."""
        return self.master.beat(session, beat)

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, session: int, most: int) -> Reply:
        """Accept a block, drop acknowledged samples, advance, and return the next captured samples."""
        controller = self.controller
        owned = self.master.owns(session)
        refused = block is not None and not (owned and controller.accept(block))
        controller.acknowledge(session, run_id, captured)
        flows = controller.state is RigState.ACTIVE or not self._pace.waits
        if owned and controller.store.backlog < most and flows:
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
            owned=True,
            capture=self._captured(most),
        )

    def _captured(self, most: int) -> CaptureBlock:
        """The next captured samples, with the channels that the configuration asks for."""
        block = self.controller.fetch(most)
        if self.controller.configuration.further_axes:
            return block
        return replace(block, values=block.values[:, : len(CHANNELS)])

    def status(self) -> Status:
        controller = self.controller
        force, displacement, current, temperature, pressure = (
            float(value) for value in controller.measured[: len(CHANNELS)]
        )
        return Status(
            state=controller.state,
            stage=controller.stage,
            faults=controller.faults,
            first_fault=controller.first_fault,
            detector=controller.detector,
            run_id=controller.fifo.run_id,
            session=self.master.session,
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
        silent = self.master.silent_s
        # A rig whose clock waits for the host does not move meanwhile, so its watchdog may be slower.
        patience = max(controller.configuration.heartbeat_s, PATIENCE_S if self._pace.waits else 0.0)
        if controller.state in POWERED and silent > patience:
            controller.fail(Fault.HEARTBEAT)
        self._release_pressure()
        if not self._pace.waits or controller.state.moving:
            self._advance()

    def _release_pressure(self) -> None:
        """Switch the pressure off in FAULT_HOLD after FAULT_HOLD_S."""
        if self.controller.state is not RigState.FAULT_HOLD:
            self._held_since = None
        elif self._held_since is None:
            self._held_since = self._now()
        elif self._now() - self._held_since >= FAULT_HOLD_S:
            self.controller.release_pressure()

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
            LOW_PRESSURE,
            waits=self._pace.waits,
            at_m=float(self.controller.measured[1]),
            fifo_samples=self.controller.fifo.capacity,
        )
        self.master.end()

    def _advance(self) -> None:
        if self._dark:
            return
        due = self._pace.due()
        if self._pace.waits and self.controller.state is RigState.ACTIVE:
            due = min(due, self.controller.fifo.level)  # not beyond the end of the stream
        self._pace.take(self.controller.advance(due))
