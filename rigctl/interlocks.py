"""Interlocks of the host: the waveform before its first sample leaves, and what is measured while it plays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import isnan

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import LimitError
from rigctl.limits import Limits

CHANNELS = ("force", "displacement", "current", "temperature", "pressure")


def check_waveform(
    displacement_m: NDArray[np.float64], current_a: NDArray[np.float64], sample_rate_hz: float, limits: Limits
) -> None:
    """Refuse a waveform that leaves the limits anywhere, differences taken from sample to sample.

    Raises
    ------
    LimitError
        One line: which quantity, at which sample, its value, and the limit.
    """
    velocity = np.diff(displacement_m) * sample_rate_hz
    _within("displacement", displacement_m, limits.position_min_m, limits.position_max_m, "m")
    _within("velocity", velocity, -limits.velocity_m_s, limits.velocity_m_s, "m/s")
    _within("current", current_a, limits.current_min_a, limits.current_max_a, "A")


def _within(name: str, values: NDArray[np.float64], low: float, high: float, unit: str) -> None:
    bad = np.flatnonzero(~((values >= low) & (values <= high)))  # the negation catches NaN too
    if bad.size:
        worst = values[bad][np.argmax(np.abs(values[bad]))]
        raise LimitError(
            f"{name} leaves {low:g} … {high:g} {unit}: {values[bad[0]]:.6g} at sample {bad[0]}, "
            f"{bad.size} samples in all, worst {worst:.6g}"
        )


class Action(StrEnum):
    """What the host does when an interlock trips; the rig has its own, which take the pressure away."""

    INDICATE = "indicate"  # note it in the run file, play on
    HOLD = "hold"  # come to rest, go on when the value is back
    STOP = "stop"  # come to rest, end the test


@dataclass(frozen=True, slots=True, kw_only=True)
class Interlock:
    """A channel that must stay between two values, SI; leaving them for `delay_s` calls for the action."""

    channel: str
    low: float
    high: float
    action: Action
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        if self.channel not in CHANNELS:
            raise LimitError(f"interlock: channel {self.channel!r} does not exist: choose one of {', '.join(CHANNELS)}")
        if isnan(self.low) or isnan(self.high) or not self.low < self.high:
            raise LimitError(f"interlock on {self.channel}: {self.low:g} must lie below {self.high:g}")
        if not 0 <= self.delay_s < 3600:
            raise LimitError(f"interlock on {self.channel}: the delay is {self.delay_s} s, it must lie in 0 … 3600")

    def holds(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Say where captured samples (n, 5) lie inside."""
        column = values[:, CHANNELS.index(self.channel)]
        inside: NDArray[np.bool_] = (column >= self.low) & (column <= self.high)
        return inside

    def __str__(self) -> str:
        return f"interlock: {self.channel} outside {self.low:g} … {self.high:g}: {self.action}"


def interlock(text: str) -> Interlock:
    """Read ``CHANNEL:LOW:HIGH:ACTION`` or ``CHANNEL:LOW:HIGH:ACTION:DELAY``; LimitError with one line otherwise.

    >>> interlock("temperature:-20:80:hold").high
    80.0
    """
    parts = text.split(":")
    if len(parts) not in (4, 5) or parts[3] not in set(Action):
        raise LimitError(
            f"interlock {text!r}: it must be CHANNEL:LOW:HIGH:ACTION[:DELAY_S], ACTION one of {', '.join(Action)}"
        )
    try:
        low, high, delay = (float(part) for part in (parts[1], parts[2], parts[4] if len(parts) == 5 else "0"))
    except ValueError as error:
        raise LimitError(f"interlock {text!r}: {error}") from None
    return Interlock(channel=parts[0], low=low, high=high, action=Action(parts[3]), delay_s=delay)


class Watch:
    """Follows captured samples and says which interlocks trip; one that has tripped rests until it is inside again."""

    def __init__(self, interlocks: Sequence[Interlock], sample_rate_hz: float) -> None:
        self._interlocks, self._rate_hz = tuple(interlocks), sample_rate_hz
        self._lasting = [0] * len(self._interlocks)
        self._resting = [False] * len(self._interlocks)

    def tripped(self, values: NDArray[np.float64]) -> tuple[Interlock, ...]:
        """Look at the next samples, (n, 5)."""
        found = []
        for k, one in enumerate(self._interlocks):
            violated = ~one.holds(values)
            needed = max(round(one.delay_s * self._rate_hz), 1)
            sample, self._lasting[k] = first_trip(violated, self._lasting[k], needed)
            if sample is not None and not self._resting[k]:
                found.append(one)
                self._resting[k] = True
            self._resting[k] = self._resting[k] and bool(violated[-1])
        return tuple(found)


def first_trip(violated: NDArray[np.bool_], lasting: int, needed: int) -> tuple[int | None, int]:
    """Find where a violation has lasted `needed` samples, `lasting` of them before, and how long it lasts."""
    if not violated.any():
        return None, 0
    index = np.arange(violated.size)
    since = np.maximum.accumulate(np.where(violated, -1, index))  # last sample without violation, −1 if none
    length = np.where(violated, index - since, 0) + np.where(violated & (since < 0), lasting, 0)
    reached = np.flatnonzero(length >= needed)
    return (int(reached[0]), 0) if reached.size else (None, int(length[-1]))
