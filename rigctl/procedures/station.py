"""A rig that this host commands: without power for readings, with power for slow movements near a person."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from math import floor

from rigctl.axis import Axis
from rigctl.clock import Clock
from rigctl.device import PressureStage
from rigctl.errors import RigError
from rigctl.limits import Configuration, Limits, tighter
from rigctl.procedures.criteria import MOUNTING_FORCE_SHARE, SLOW_M_S
from rigctl.transport import Identity, Status, Transport

STALL_S = 5.0
ROUNDING = 1e-6  # of a step: 1000 // 0.1 is 9999
USUAL_HZ = 1000.0  # sample rate of a rig that has no rate of its own
RIG_FORCE_FACTOR = 2.0  # over the force at which this program stops: within half a millimetre it may overshoot


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """The rig, and how to talk to it."""

    axis: Axis
    clock: Clock
    identity: Identity
    rate_hz: float  # at which the rig counts its samples
    stage: PressureStage  # of its power, once that is on

    def move(self, displacement_m: float, should_stop: Callable[[], bool]) -> Status:
        """Move to a displacement and return the status at rest: a jog at low pressure, else a travel."""
        if self.stage is PressureStage.LOW:
            return self.axis.jog(displacement_m, lambda: not should_stop())
        return self.axis.travel(displacement_m, 0.0)


@contextmanager
def commanded(transport: Transport, clock: Clock, *, stage: PressureStage = PressureStage.HIGH) -> Iterator[Station]:
    """Command the rig alone, without power; nothing moves. Where it has no low pressure, the stage is HIGH.

    Raises RigOccupied where another host commands it, NeedsReset where it has latched a fault.
    """
    axis = Axis(transport, clock, stall_s=STALL_S)
    identity = axis.identify()
    axis.claim()
    try:
        rate_hz, limits = usual_rate_hz(identity), slow_limits(identity.limits)
        if identity.low_pressure is None:
            stage = PressureStage.HIGH
        elif stage is PressureStage.LOW:
            limits = identity.low_pressure.within(limits)
        axis.prepare(Configuration(sample_rate_hz=rate_hz, limits=limits, stage=stage))
        yield Station(axis=axis, clock=clock, identity=identity, rate_hz=rate_hz, stage=stage)
    finally:
        with suppress(RigError):  # else the rig ends the session itself, once this host is silent
            axis.release()


def usual_rate_hz(identity: Identity) -> float:
    """1 kHz, or what the rig has nearest to it."""
    rate_hz = min(max(USUAL_HZ, identity.sample_rate_min_hz), identity.sample_rate_max_hz)
    step_hz = identity.rate_step_hz
    return floor(rate_hz / step_hz + ROUNDING) * step_hz if step_hz else rate_hz


def slow_limits(machine: Limits) -> Limits:
    """The machine's limits, with the speed and the force of movements near a person."""
    slow = replace(
        machine,
        velocity_m_s=min(SLOW_M_S, machine.velocity_m_s),
        force_n=RIG_FORCE_FACTOR * MOUNTING_FORCE_SHARE * machine.force_n,
    )
    return tighter(machine, slow)


@contextmanager
def powered(transport: Transport, clock: Clock, *, stage: PressureStage = PressureStage.LOW) -> Iterator[Station]:
    """Command the rig with power, at rest where its piston stands; it ends at rest without power, also after an error.

    The rig is given the limits of slow movements, and low pressure where it has it: it stops itself beyond them.

    Raises
    ------
    StopFailed
        When the rig did not acknowledge the stop at the end.
    """
    with commanded(transport, clock, stage=stage) as station:
        axis = station.axis
        try:
            axis.enable(axis.status().displacement_m, 0.0)
            yield station
        finally:
            despite_interrupts(axis.make_safe)


def despite_interrupts(make_safe: Callable[[], None]) -> None:
    """Stop the rig; a second Ctrl-C while it stops must not leave it moving."""
    while True:
        try:
            make_safe()
        except KeyboardInterrupt:
            continue
        except RigError:
            raise
        return
