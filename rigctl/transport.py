"""The interface to a rig: one Protocol, blocks of samples in SI units, a deadline for every call."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rigctl.device import Control, Fault, RigState
from rigctl.limits import Configuration, Limits

SEQUENCES = 1 << 16
HEARTBEATS = 1 << 7  # the heartbeat in a reply is counted modulo this
NO_SEQUENCE = SEQUENCES - 1  # reported before the first block, number 0, is accepted


class Capability(IntFlag):
    """Optional capabilities of a rig."""

    NONE = 0
    CURRENT = 1  # drives the current of a controllable damper
    SIMULATED = 2


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """Status as the rig reports it."""

    state: RigState
    faults: Fault
    first_fault: Fault
    detector: int  # which one acted first, as rigctl.device.DETECTORS numbers them; 0: none
    run_id: int
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
    sequence: int  # modulo 65 536
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
    values: NDArray[np.float64]  # (n, 5): force N, displacement m, current A, temperature degC, pressure Pa

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
    capture: CaptureBlock


class Transport(Protocol):
    """A connection to one rig. Every call ends by its deadline and raises only TransportError.

    Every call may be repeated after an error: the rig drops blocks that it already has.
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

    def identify(self, deadline_s: float) -> Identity: ...

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        """Write the configuration and read it back; IdentityError where the rig keeps another one."""
        ...

    def command(self, control: Control, run_id: int, deadline_s: float) -> Status:
        """Send a control word and wait until the rig has acknowledged it; the state may change later."""
        ...

    def direct(self, displacement_m: float, current_a: float, deadline_s: float) -> Status:
        """Move the hold set-point; the rig travels there within its own limits, in HOLD only."""
        ...

    def status(self, deadline_s: float) -> Status: ...

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, deadline_s: float) -> Reply:
        """Send a block (or none), acknowledge captured samples below `captured`, fetch the next ones."""
        ...

    def close(self) -> None:
        """Close the connection; safe to call twice."""
        ...
