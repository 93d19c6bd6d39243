"""The interface to a rig: one Protocol, blocks of samples in SI units, a deadline for every call."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from excitation.signal import Excitation
from rigctl.device import Control, Fault, PressureStage, RigState
from rigctl.limits import Configuration, Limits, LowPressure
from rigctl.waveform import Waveform

SEQUENCES = 1 << 16
HEARTBEATS = 1 << 7  # the heartbeat in a reply is counted modulo this
NO_SEQUENCE = SEQUENCES - 1  # reported before the first block, number 0, is accepted


class Capability(IntFlag):
    """Optional capabilities of a rig."""

    NONE = 0
    CURRENT = 1  # drives the current of a controllable damper
    SIMULATED = 2
    FURTHER_AXES = 4  # measures motions and loads of further axes, and sends them where a configuration asks for it


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Identity and properties of the rig."""

    map_version: int
    vendor: str
    model: str
    serial: str
    channel_count: int
    sample_rate_min_hz: float
    sample_rate_max_hz: float
    fifo_samples: int
    capture_samples: int
    capabilities: Capability
    limits: Limits  # what the machine can do: a configuration may only be tighter
    low_pressure: LowPressure | None = None  # None: the rig has no low pressure
    unmeasured: tuple[str, ...] = ()  # channels of a captured sample that it does not measure: they read 0
    takes_whole: bool = False  # it needs the whole motion before it starts
    watchdog: str = ""  # what a controller of another make does when its host is silent, as its map says
    watchdog_s: float = 0.0  # after so long a silence; 0: as configured
    takes_limits: tuple[str, ...] = ()  # the limits that a controller of another make is given and keeps
    rate_step_hz: float = 0.0  # it plays whole multiples of this rate only; 0: any

    @property
    def foreign(self) -> bool:
        """Whether it is a controller of another make: it speaks no register map of this program."""
        return self.map_version == 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """Status as the rig reports it."""

    state: RigState
    stage: PressureStage
    faults: Fault
    first_fault: Fault
    detector: int  # which one acted first, as rigctl.device.DETECTORS numbers them; 0: none
    run_id: int
    session: int  # of the host that commands the rig; 0: nobody does
    heartbeat: int
    fifo_level: int
    last_accepted: int
    consumed: int
    sample_index: int  # of the rig's clock since it was switched on
    capture_backlog: int
    underruns: int
    crc_errors: int
    duplicates: int
    gaps: int
    arrived: bool  # at rest on the hold set-point
    force_n: float
    displacement_m: float
    current_a: float
    temperature_degc: float
    pressure_pa: float

    @property
    def measured(self) -> NDArray[np.float64]:
        """Sensor readings in the order of a captured sample, (1, 5)."""
        return np.array([[self.force_n, self.displacement_m, self.current_a, self.temperature_degc, self.pressure_pa]])


@dataclass(frozen=True, slots=True, kw_only=True)
class SetpointBlock:
    """Consecutive set-points of one run."""

    run_id: int
    sequence: int  # counted from 0; on a wire modulo 65 536, and the check covers the whole number
    displacement_m: NDArray[np.float64]  # (n,)
    current_a: NDArray[np.float64]  # (n,)
    end_of_stream: bool  # the last block of the run: an empty FIFO after it is a clean end

    @property
    def samples(self) -> int:
        return int(self.displacement_m.size)


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureBlock:
    """Consecutive captured samples of one run; sample k was measured when set-point k applied."""

    run_id: int
    first_index: int
    values: NDArray[np.float64]
    """(n, 5): force N, displacement m, current A, temperature degC, pressure Pa; (n, 15) where further axes were asked
    for: then their channels, in the order of `rigctl.further_axes.FURTHER_AXES`."""

    @property
    def samples(self) -> int:
        return int(self.values.shape[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """The answer to one exchange."""

    state: RigState
    faults: Fault
    last_accepted: int
    fifo_free: int
    consumed: int
    refused: bool  # the last block was refused: send again from last_accepted + 1
    heartbeat: int  # of the rig, modulo 128: constant where its controller has stopped
    owned: bool  # whether the rig still obeys this host
    capture: CaptureBlock


class Transport(Protocol):
    """A connection to one rig. Every call ends by its deadline and raises only TransportError.

    Every call may be repeated after an error: the rig drops blocks and commands that it already has.
    Reading needs no session and does not feed the rig's watchdog; commanding needs one, see :meth:`claim`.
    """

    @property
    def url(self) -> str: ...

    @property
    def block_samples(self) -> int:
        """Largest number of set-points in one exchange, once the rig is configured."""
        ...

    @property
    def capture_samples(self) -> int:
        """Largest number of captured samples in one reply; with fewer the rig has no more at the moment."""
        ...

    @property
    def session(self) -> int:
        """The session in which this host commands the rig; 0: it only reads."""
        ...

    def identify(self, deadline_s: float) -> Identity: ...

    def claim(self, deadline_s: float) -> int:
        """Become the rig's only master and return the session; RequestDenied where another host is.

        The rig gives a new session to a claim, so that what was sent in an earlier one has no effect any more.
        """
        ...

    def release(self, deadline_s: float) -> None:
        """End the session of a rig without power; RequestDenied where it has power. Nothing where there is none."""
        ...

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        """Write the configuration and read it back; IdentityError where the rig keeps another one."""
        ...

    def command(self, control: Control, run_id: int, deadline_s: float) -> Status:
        """Send a control word and wait until the rig has acknowledged it; the state may change later.

        A HOLD with a higher run number opens that run; RequestDenied where the rig does not obey.
        """
        ...

    def direct(self, displacement_m: float, current_a: float, deadline_s: float) -> Status:
        """Move the hold set-point; the rig travels there within its own limits, in HOLD at high pressure only."""
        ...

    def jog(self, displacement_m: float, deadline_s: float) -> Status:
        """Ask for a slow movement to a displacement, in HOLD at low pressure only.

        The piston moves only for JOG_S after each request, then it comes to rest.
        """
        ...

    def stop(self, deadline_s: float) -> Status:
        """Stop the rig and switch its power off, whoever commands it; this ends the session of its master.

        Returns what the rig says at once: it may still be coming to rest.
        """
        ...

    def status(self, deadline_s: float) -> Status:
        """Read the status; in a session this is also a heartbeat."""
        ...

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, deadline_s: float) -> Reply:
        """Send a block (or none), acknowledge captured samples below `captured`, fetch the next ones."""
        ...

    def close(self) -> None:
        """Close the connection; safe to call twice."""
        ...


@runtime_checkable
class OwnMotion(Protocol):
    """A transport to a controller that may play another motion than the one it was asked for."""

    def played_waveform(self, excitation: Excitation, waveform: Waveform) -> Waveform:
        """Return the motion that the controller will play for a test; LimitError where it cannot."""
        ...

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the run file should say of the test that has just ended."""
        ...
