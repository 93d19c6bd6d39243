"""What the transport asks of a foreign controller, whatever its wire and its way of being driven."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from excitation.signal import Excitation
from rigctl.device import PressureStage
from rigctl.errors import TransportError
from rigctl.limits import Limits
from rigctl.waveform import Waveform

NO_ROWS: NDArray[np.float64] = np.empty((0, 5))


class RunLost(TransportError):
    """The run cannot go on, and a repetition does not help: samples or set-points were missed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """State of a controller at one moment."""

    tick: int  # of its clock; begins again at 0 after the counter's bits
    enabled: bool
    running: bool
    at_rest: bool
    fault_code: int  # 0: none
    values: NDArray[np.float64]  # (5,) force N, displacement m, current A, temperature degC, pressure Pa


class Pumped(NamedTuple):
    """Result of one pass: set-points that the controller took, and samples that it measured."""

    taken: int = 0
    first: int = 0  # number of the first sample, from the start of the run
    rows: NDArray[np.float64] = NO_ROWS


class Machine(Protocol):
    """A foreign controller. Every call ends by `ends` on the clock and raises only TransportError.

    Set-points are (n, 2): displacement m, current A.
    """

    @property
    def url(self) -> str: ...

    @property
    def takes_whole(self) -> bool:
        """Whether it needs the whole motion before it starts."""
        ...

    @property
    def drives_current(self) -> bool: ...

    @property
    def unmeasured(self) -> tuple[str, ...]:
        """Channels of a captured sample that it does not measure."""
        ...

    def played_waveform(self, excitation: Excitation, waveform: Waveform) -> Waveform:
        """Return the motion that the controller will really play; LimitError where it cannot play this test."""
        ...

    def configure(self, limits: Limits, stage: PressureStage, ends: float) -> None:
        """Give the controller its limits and stage, where it takes any; IdentityError where it keeps others."""
        ...

    def read(self, ends: float) -> Reading: ...

    def beat(self, ends: float) -> None:
        """Tell the controller that its host lives."""
        ...

    def enable(self, ends: float) -> None: ...

    def disable(self, ends: float) -> None: ...

    def stop(self, ends: float) -> None:
        """Bring the motion to rest by the controller's own deceleration; what it has buffered is void."""
        ...

    def reset(self, ends: float) -> None: ...

    def travel(self, displacement_m: float, current_a: float, ends: float) -> None:
        """Position at low speed, by the controller's own profile."""
        ...

    def start(self, queue: NDArray[np.float64], total: int, ends: float) -> None:
        """Start a run with the set-points at hand; the next `pump` says how many of them were taken.

        `total` is the length of the run where it is known, else 0.
        """
        ...

    def pump(self, queue: NDArray[np.float64], total: int, ends: float) -> Pumped: ...

    def close(self) -> None: ...
