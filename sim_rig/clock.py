"""The speed of the rig's sample clock: real time, or up to a multiple of it."""

from __future__ import annotations

from collections.abc import Callable

from sim_rig.errors import SpeedError

BURST_S = 0.25  # of wall time that a clock which waited may catch up


class Pace:
    """Samples that are due at `speed` times real time.

    At speed 1 the clock is in real time: it never waits, and an empty FIFO is an underflow. At any
    other speed it is an upper bound: the clock waits for the host, and between runs it advances only with the
    host's polls, so that what is captured depends on the seed alone and not on the computer's load.
    """

    def __init__(self, speed: float, now: Callable[[], float]) -> None:
        if not 0 < speed <= 1e6:
            raise SpeedError(f"speed is {speed}: it must be positive, 1 is real time")
        self._speed, self._now = speed, now
        self._origin, self._taken, self._rate_hz = now(), 0, 1000.0

    @property
    def waits(self) -> bool:
        """Whether the clock waits for the host instead of emptying its FIFO."""
        return self._speed != 1.0

    def restart(self, rate_hz: float) -> None:
        """Begin to count at another sample rate."""
        self._origin, self._taken, self._rate_hz = self._now(), 0, rate_hz

    def due(self) -> int:
        """Count the samples that may be played now."""
        rate = self._rate_hz * self._speed
        due = int((self._now() - self._origin) * rate) - self._taken
        burst = max(int(BURST_S * rate), 1)
        if self.waits and due > burst:  # it waited: the lost time is not made up
            self._taken += due - burst
            due = burst
        return max(due, 0)

    def at_most(self, samples: int, seconds: float) -> int:
        """Return `samples`, or fewer where the clock does not play so many in `seconds`; at least 1."""
        return max(min(samples, round(seconds * self._rate_hz * self._speed)), 1)

    def take(self, samples: int) -> None:
        """Note samples as played."""
        self._taken += samples
