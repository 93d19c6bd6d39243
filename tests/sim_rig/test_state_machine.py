"""Whatever two hosts, a late gateway and faults do, the rig moves only when its master has just asked for it.

The rules send real CAN frames; the licences are a model of their own, which knows nothing of the rig's code.
"""

from __future__ import annotations

import os

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from numpy.typing import NDArray

from rigctl import can_frames as frames
from rigctl import modbus_map as table
from rigctl import sdo
from rigctl.device import Control, Fault, PressureStage, RigState
from rigctl.limits import JOG_S, Configuration
from rigctl.session import Session
from sim_rig.can_server import CanDevice
from sim_rig.rig import LOW_PRESSURE, MACHINE, SimulatedRig

TICK_S = 0.05
REST_S = 1.4  # from a stop in full motion until the piston is at rest
PRESSURE_S = 10.5  # pressure of a fault that nobody has cared for
SEQUENCES = int(os.environ.get("DAMPER_RIG_SEQUENCES", "60"))
POWERED = (RigState.HOLD, RigState.ACTIVE)
SAMPLES = 600
WIGGLE_M = 5e-6  # a rig that loses its pressure takes the measured position, with its noise, for its set-point


class PerfectPlant:
    """Follows every set-point at once; keeps what it was told."""

    def __init__(self) -> None:
        self.commands: list[NDArray[np.float64]] = []
        self._wiggle = 0

    def set_rate(self, rate_hz: float) -> None:
        pass

    def set_stage(self, stage: PressureStage) -> None:
        self.stage = stage

    def begin_run(self) -> None:
        pass

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        self.commands.append(setpoints[:, 0].copy())
        n = setpoints.shape[0]
        self._wiggle += n
        noise = 1.0 + np.arange(self._wiggle - n, self._wiggle) % 2  # sensors that stand still count as stuck
        return np.column_stack(
            [
                10 * noise,
                setpoints[:, 0] + 1e-6 * noise,
                setpoints[:, 1] + 1e-3 * noise,
                25 + 0.1 * noise,
                21e6 * noise**0,
            ]
        )

    def snapshot(self) -> object:
        return len(self.commands), self._wiggle

    def restore(self, snapshot: object) -> None:
        assert isinstance(snapshot, tuple)
        played, self._wiggle = snapshot
        del self.commands[played:]


class Host:
    """What one host knows: its session, the run that it opened, and whether it believes to be the master."""

    def __init__(self, nonce: int) -> None:
        self.nonce, self.own, self.run = nonce, Session(), 0


class Machine(RuleBasedStateMachine):
    """Frames of two hosts, replays, time, faults and losses of power, in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0
        self.plant = PerfectPlant()
        self.rig = SimulatedRig(self.plant, speed=1.0, now=lambda: self.now)
        self.device = CanDevice(self.rig, lambda: self.now, fd=False)
        self.hosts = (Host(11), Host(22))
        self.sent: list[tuple[int, bytes]] = []
        self.may_move = self.may_have_power = False
        self.rest_by = self.off_by = 0.0
        self.jog_ends = -1.0  # of the last request that the rig had to obey
        self.seen, self.at = len(self.plant.commands), 0.0

    # what goes over the wire

    def send(self, number: int, data: bytes) -> None:
        self.sent.append((number, data))
        self.device.take(number, data)
        self.device.give()

    def write(self, address: int, value: int) -> None:
        self.send(frames.SDO_REQUEST, sdo.Sdo(kind=sdo.DOWNLOAD, address=address, value=value).pack())

    def order(self, host: Host, control: Control) -> None:
        own = host.own
        frame = frames.ControlFrame(
            control=int(control), session=own.number, run_id=host.run, number=own.next_command()
        )
        self.send(frames.CONTROL, frame.pack())

    def master(self, host: Host) -> bool:
        return host.own.claimed and self.rig.master.session == host.own.number

    def withdraw(self, *, power: bool = True) -> None:
        """From now on nothing may begin to move; what moves must come to rest, and lose its power where that goes."""
        if self.may_move or self.rig.controller.state.moving or not self.rig.controller.at_rest:
            self.rest_by = max(self.rest_by, self.now + REST_S)
        self.may_move, self.jog_ends = False, min(self.jog_ends, self.now)
        if power:
            if self.may_have_power:
                self.off_by = self.now + REST_S + PRESSURE_S
            self.may_have_power = False

    # rules

    @rule(k=st.integers(0, 1))
    def claim(self, k: int) -> None:
        host, before = self.hosts[k], self.rig.master.session
        self.write(table.CLAIM.address, host.nonce)
        if self.rig.master.nonce == host.nonce and self.rig.master.session not in (0, host.own.number):
            host.own, host.run = Session(number=self.rig.master.session), self.rig.controller.fifo.run_id
        if self.rig.master.session != before:
            assert self.rig.controller.state not in POWERED, "power never changes its master"

    @rule(k=st.integers(0, 1), next_run=st.booleans())
    def hold(self, k: int, next_run: bool) -> None:
        host = self.hosts[k]
        host.run += next_run
        may = self.master(host) and not self.rig.controller.state.faulted
        if may:
            self.withdraw(power=False)
            self.may_have_power = True
        self.order(host, Control.HOLD)

    @rule(k=st.integers(0, 1))
    def disable(self, k: int) -> None:
        if self.master(self.hosts[k]):
            self.withdraw()
        self.order(self.hosts[k], Control.DISABLE)

    @rule(k=st.integers(0, 1))
    def activate(self, k: int) -> None:
        host, controller = self.hosts[k], self.rig.controller
        ready = controller.state is RigState.HOLD and controller.at_rest
        if self.master(host) and ready and controller.fifo.run_id == host.run:
            self.may_move = True
        self.order(host, Control.ACTIVATE)

    @rule(k=st.integers(0, 1))
    def reset(self, k: int) -> None:
        faulted = self.rig.controller.state.faulted
        self.order(self.hosts[k], Control.DISABLE | Control.RESET)
        if faulted and not self.rig.controller.state.faulted:
            assert self.master(self.hosts[k]), "only the master resets"
            assert self.rig.controller.state is RigState.DISABLED

    @rule(bits=st.integers(0, 15), session=st.integers(0, 3), number=st.integers(0, 0xFFFF))
    def stranger(self, bits: int, session: int, number: int) -> None:
        """A host that has claimed nothing sends any control word."""
        known = [host.own.number for host in self.hosts]
        if session in known and session:
            return
        if session == 0 and bits == Control.DISABLE:
            self.withdraw()
        frame = frames.ControlFrame(control=bits, session=session, run_id=number, number=number)
        self.send(frames.CONTROL, frame.pack())

    @rule(k=st.integers(0, 1), left_out=st.sampled_from(["nothing", "nothing", "claim", "hold", "feed", "activate"]))
    def a_run_begins(self, k: int, left_out: str) -> None:
        """The whole way to a motion, as a good host goes it; or with a step left out."""
        if self.rig.controller.state.faulted:
            self.recover(k)
        self.time_passes_with_a_living_host(k, 0.01)
        for name in ("claim", "hold", "feed", "activate"):
            if name != left_out:
                self.hold(k, True) if name == "hold" else getattr(self, name)(k)

    @rule(k=st.integers(0, 1))
    def recover(self, k: int) -> None:
        """An operator looks at the rig and resets it: the last master has been silent for long enough."""
        self.emergency_stop(False)
        self.pass_time(1.4)
        self.claim(k)
        self.disable(k)
        self.reset(k)

    @rule(k=st.integers(0, 1), to=st.floats(-0.03, 0.03))
    def travel(self, k: int, to: float) -> None:
        host = self.hosts[k]
        if self.master(host) and self.rig.controller.stage is PressureStage.HIGH:
            self.may_move = self.may_move or self.rig.controller.state is RigState.HOLD
        number = host.own.next_command()
        data = frames.pack_direct(to, 0.1, number)
        order = frames.ControlFrame(
            control=int(Control.HOLD), mode=frames.MODE_TRAVEL, session=host.own.number, run_id=0, number=number
        )
        self.send(frames.DIRECT, data)
        self.send(frames.CONTROL, order.pack(data))

    @rule(k=st.integers(0, 1), low=st.booleans())
    def configure(self, k: int, low: bool) -> None:
        """Choose the pressure of the next power; under power the rig refuses."""
        host = self.hosts[k]
        choice = Configuration(
            limits=LOW_PRESSURE.within(MACHINE) if low else MACHINE,
            stage=PressureStage.LOW if low else PressureStage.HIGH,
        )
        own, block = host.own, table.CONFIGURATION
        values = table.configuration_values(choice, session=own.number, command=own.next_command())
        words, stage = block.encode(values), self.rig.controller.stage
        for at in range(0, block.count, 2):
            self.write(block.address + at, words[at] << 16 | words[at + 1])
        assert self.rig.controller.stage is stage, "the pressure does not change under power"

    @rule(k=st.integers(0, 1), to=st.floats(-0.03, 0.03))
    def jog(self, k: int, to: float) -> None:
        host = self.hosts[k]
        if self.master(host) and self.rig.controller.stage is PressureStage.LOW:
            self.jog_ends = self.now + JOG_S
        number = host.own.next_command()
        data = frames.pack_direct(to, 0.0, number)
        order = frames.ControlFrame(
            control=int(Control.HOLD), mode=frames.MODE_JOG, session=host.own.number, run_id=0, number=number
        )
        self.send(frames.DIRECT, data)
        self.send(frames.CONTROL, order.pack(data))

    @rule(k=st.integers(0, 1), requests=st.integers(1, 8), to=st.floats(-0.03, 0.03), fed=st.booleans())
    def a_piston_is_jogged(self, k: int, requests: int, to: float, fed: bool) -> None:
        """Low pressure as a good host goes there, some requests, and a start, which low pressure refuses."""
        if self.rig.controller.state.faulted:
            self.recover(k)
        self.claim(k)
        self.disable(k)
        self.time_passes_with_a_living_host(k, 0.1)
        self.configure(k, True)
        self.hold(k, True)
        for _ in range(requests):
            self.jog(k, to)
            self.time_passes_with_a_living_host(k, 0.1)
        if fed:
            before = self.may_move
            self.feed(k)
            self.activate(k)
            if self.rig.controller.stage is PressureStage.LOW:
                assert self.rig.controller.state is not RigState.ACTIVE
                self.may_move = before

    @rule(k=st.integers(0, 1))
    def feed(self, k: int) -> None:
        """Send a whole smooth motion for the run that this host believes to be open."""
        host = self.hosts[k]
        start = float(self.rig.controller._setpoint[0])
        toward = -1.0 if start > 0 else 1.0
        rows = np.zeros((SAMPLES, 2))
        rows[:, 0] = start + toward * 0.01 * (1 - np.cos(2 * np.pi * np.arange(SAMPLES) / SAMPLES))
        for number in range(0, SAMPLES, 200):
            end = number + 200 == SAMPLES
            block = rows[number : number + 200]
            for frame in frames.pack_stream(block, number // 200, host.run, end, session=host.own.number):
                self.sent.append(frame)
                self.device.take(*frame)
        self.device.give()

    @rule(k=st.integers(0, 1), seconds=st.sampled_from([0.01, 0.1, 0.4, 1.2, 3.0]))
    def time_passes_with_a_living_host(self, k: int, seconds: float) -> None:
        host = self.hosts[k]
        for _ in range(round(seconds / 0.1) or 1):
            self.send(frames.HOST_HEARTBEAT, frames.pack_host_heartbeat(host.own.number, host.own.next_heartbeat()))
            self.pass_time(min(seconds, 0.1))

    @rule(seconds=st.sampled_from([0.01, 0.2, 0.9, 1.3, 4.0, 12.0]))
    def time_passes(self, seconds: float) -> None:
        self.pass_time(seconds)

    @precondition(lambda self: self.sent)
    @rule(data=st.data(), many=st.integers(1, 5))
    def old_frames_come_again(self, data: st.DataObject, many: int) -> None:
        for _ in range(many):
            number, old = self.sent[data.draw(st.integers(0, len(self.sent) - 1))]
            if number == frames.CONTROL and old[0] == Control.DISABLE and old[1:3] == b"\0\0":
                self.withdraw()  # a stop may come late: it makes the rig safe
            self.device.take(number, old)
            self.device.give()

    @precondition(lambda self: len(self.sent) > 5)
    @rule(many=st.integers(5, 80))
    def a_gateway_delivers_everything_again(self, many: int) -> None:
        """The last frames once more, in their order: a start, its set-points, and all."""
        for number, old in self.sent[-many:]:
            if number == frames.CONTROL and old[0] == Control.DISABLE and old[1:3] == b"\0\0":
                self.withdraw()
            self.device.take(number, old)
        self.device.give()

    @rule(k=st.integers(0, 1))
    def a_stop_overtakes_a_start(self, k: int) -> None:
        """Somebody stops the rig while the frames of a start are still in a gateway; then they arrive."""
        self.time_passes_with_a_living_host(k, 0.01)
        direct, take = [], self.device.take
        self.device.take = lambda number, data: direct.append((number, data))  # type: ignore[method-assign]
        may_move, may_have_power = self.may_move, self.may_have_power
        for name in ("feed", "activate"):
            getattr(self, name)(k)
        self.hold(k, True)
        for name in ("feed", "activate"):
            getattr(self, name)(k)
        self.device.take = take  # type: ignore[method-assign]
        self.may_move, self.may_have_power = may_move, may_have_power
        self.stranger(int(Control.DISABLE), 0, 0)
        self.pass_time(1.4)
        for number, data in direct:
            take(number, data)
        self.device.give()
        self.pass_time(0.2)

    @precondition(lambda self: self.rig.controller.state in POWERED)
    @rule()
    def a_dead_hosts_heartbeats_come_again(self) -> None:
        beats = [frame for frame in self.sent if frame[0] == frames.HOST_HEARTBEAT]
        for k in range(30):
            if beats:
                self.device.take(*beats[k % len(beats)])
                self.device.give()
            self.pass_time(0.05)
        assert self.rig.controller.state not in POWERED, "only a living host keeps the power on"

    @precondition(lambda self: self.rig.controller.state.moving or self.rig.controller.standing)
    @rule(pressed=st.booleans())
    def emergency_stop(self, pressed: bool) -> None:
        if pressed:
            self.withdraw()
        self.rig.controller.set_cause(Fault.EMERGENCY_STOP, pressed)

    @precondition(lambda self: self.rig.controller.state in POWERED)
    @rule(fault=st.sampled_from([Fault.SENSOR, Fault.FORCE_LIMIT, Fault.PRESSURE]))
    def fault(self, fault: Fault) -> None:
        self.withdraw()
        self.rig.controller.fail(fault)

    @precondition(lambda self: self.rig.controller.state in POWERED)
    @rule()
    def power_is_lost(self) -> None:
        self.withdraw()
        self.rig._lose_power()
        self.rig.starts += 1
        self.at = float(self.rig.controller._setpoint[0])
        self.seen = len(self.plant.commands)

    # what must be true

    def pass_time(self, seconds: float) -> None:
        for _ in range(max(round(seconds / TICK_S), 1)):
            self.now += TICK_S
            self.rig.tick()
            self.notice_fault()
            self.check_motion()
            if self.rig.controller.state is not RigState.ACTIVE and self.rig.controller.at_rest:
                self.may_move = False  # what was asked for is done, or was refused

    def notice_fault(self) -> None:
        """A fault, whatever its cause, takes every licence away."""
        if self.rig.controller.state.faulted and (self.may_move or self.may_have_power):
            self.withdraw()

    def check_motion(self) -> None:
        fresh = np.concatenate([np.full(1, self.at), *self.plant.commands[self.seen :]])
        self.seen, self.at = len(self.plant.commands), float(fresh[-1])
        moved = float(np.max(np.abs(np.diff(fresh)), initial=0.0))
        if self.rig.controller.stage is PressureStage.LOW and not self.rig.controller.state.faulted:
            assert moved <= 1.01 * LOW_PRESSURE.velocity_m_s / self.rig.controller.rate_hz + WIGGLE_M
        if moved > WIGGLE_M and not self.may_move and self.now > self.jog_ends + 2 * TICK_S:
            assert self.now <= self.rest_by + 2 * TICK_S, f"it moved {moved} m, and nobody has asked for it"

    @invariant()
    def the_state_is_one_that_was_asked_for(self) -> None:
        controller = self.rig.controller
        self.notice_fault()
        if controller.state is RigState.ACTIVE:
            assert self.may_move
        if controller.state in POWERED and not self.may_have_power:
            assert self.now <= self.off_by + TICK_S
        if controller.state not in POWERED:
            assert controller.state.faulted or abs(controller._setpoint[1]) == 0.0
        if controller.state.faulted:
            assert controller._setpoint[1] == 0.0, "no current after a fault"

    @invariant()
    def a_pressure_that_nobody_cares_for_falls(self) -> None:
        state = self.rig.controller.state
        if state is RigState.FAULT_HOLD and self.off_by and self.now > self.off_by + 1.0:
            raise AssertionError("the pressure is still on")

    @invariant()
    def a_run_that_is_over_leaves_nothing_to_play(self) -> None:
        controller = self.rig.controller
        if controller.state not in POWERED:
            assert controller.fifo.level == 0


TestStateMachine = Machine.TestCase
TestStateMachine.settings = settings(
    max_examples=SEQUENCES,
    stateful_step_count=40,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
