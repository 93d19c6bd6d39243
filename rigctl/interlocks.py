"""Interlocks of the host: on the whole waveform before it is sent, and on the measured samples during the test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite, isnan

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import LimitError
from rigctl.further_axes import FURTHER_AXES
from rigctl.limits import Limits
from rigctl.setpoint_check import all_bad, at_rest

MARGIN = 0.02  # share of the range between the limits, or of the one limit: inside by this, an interlock is released
CHANNELS = ("force", "displacement", "current", "temperature", "pressure")
WATCHED = (*CHANNELS, *FURTHER_AXES)
"""Channels that an interlock may watch, in the order of a captured sample; a rig of one axis has the first five."""


def check_waveform(
    displacement_m: NDArray[np.float64], current_a: NDArray[np.float64], sample_rate_hz: float, limits: Limits
) -> None:
    """Refuse a waveform, played from rest, that leaves the limits anywhere.

    Raises
    ------
    LimitError
        One line: which quantity, at which sample, its value, and the limit.
    """
    bad = all_bad(displacement_m, current_a, at_rest(float(displacement_m[0])), limits, sample_rate_hz)
    if bad:
        raise LimitError(str(bad[0]))


FORM = "CHANNEL:LOW:HIGH:ACTION[:DELAY_S[:MARGIN[:RELEASE_S]]]"


class Action(StrEnum):
    """What the host does when an interlock trips; the rig has its own interlocks."""

    INDICATE = "indicate"  # note it in the run file, play on
    HOLD = "hold"  # come to rest, go on when the value is back
    STOP = "stop"  # come to rest, end the test


@dataclass(frozen=True, slots=True, kw_only=True)
class Interlock:
    """A channel that must stay between two values, SI; leaving them for `delay_s` triggers the action.

    It is released when the channel has been inside by `margin` for `release_s`, so that a value near its limit does
    not make a test hold and resume repeatedly. Default margin: 2 % of the range
    between the limits, or of the finite one.
    """

    channel: str
    low: float
    high: float
    action: Action
    delay_s: float = 0.0
    margin: float | None = None
    release_s: float = 1.0

    def __post_init__(self) -> None:
        if self.channel not in WATCHED:
            raise LimitError(f"interlock: channel {self.channel!r} does not exist: choose one of {', '.join(WATCHED)}")
        if self.further and self.action is Action.HOLD:
            raise LimitError(
                f"interlock on {self.channel}: a rig on hold does not tell the channels of further axes, nothing would "
                f"end the hold: use {Action.STOP} or {Action.INDICATE}"
            )
        if isnan(self.low) or isnan(self.high) or not self.low < self.high:
            raise LimitError(f"interlock on {self.channel}: {self.low:g} must lie below {self.high:g}")
        if not 0 <= self.delay_s < 3600:
            raise LimitError(f"interlock on {self.channel}: the delay is {self.delay_s} s, it must lie in 0 … 3600")
        if not 0 <= self.release_s < 3600:
            raise LimitError(f"interlock on {self.channel}: the release is {self.release_s} s, it must lie in 0 … 3600")
        if not 0 <= self.inside_by < (self.high - self.low) / 2:
            raise LimitError(
                f"interlock on {self.channel}: the margin is {self.inside_by:g}, "
                f"it must lie below half the range of {self.high - self.low:g}"
            )

    @property
    def further(self) -> bool:
        """Whether its channel is one of a further axis."""
        return self.channel in FURTHER_AXES

    @property
    def inside_by(self) -> float:
        """How far inside the limits the channel must be for the release."""
        if self.margin is not None:
            return self.margin
        finite = [limit for limit in (self.low, self.high) if isfinite(limit)]
        span = self.high - self.low if len(finite) == 2 else abs(sum(finite))
        return MARGIN * span

    def holds(self, values: NDArray[np.float64], *, by: float = 0.0) -> NDArray[np.bool_]:
        """Whether each captured sample, (n, 5) or (n, 15), lies inside the limits by at least `by`."""
        column = values[:, WATCHED.index(self.channel)]
        inside: NDArray[np.bool_] = (column >= self.low + by) & (column <= self.high - by)
        return inside

    def __str__(self) -> str:
        return f"interlock: {self.channel} outside {self.low:g} … {self.high:g}: {self.action}"


def interlock(text: str) -> Interlock:
    """Read ``CHANNEL:LOW:HIGH:ACTION[:DELAY_S[:MARGIN[:RELEASE_S]]]``; LimitError with one line otherwise.

    >>> interlock("temperature:-20:80:hold").high
    80.0
    """
    parts = text.split(":")
    if not 4 <= len(parts) <= 7 or parts[3] not in set(Action):
        raise LimitError(f"interlock {text!r}: it must be {FORM}, ACTION one of {', '.join(Action)}")
    try:
        low, high, *more = (float(part) for part in (*parts[1:3], *parts[4:]))
    except ValueError as error:
        raise LimitError(f"interlock {text!r}: {error}") from None
    times = dict(zip(("delay_s", "margin", "release_s"), more, strict=False))
    return Interlock(channel=parts[0], low=low, high=high, action=Action(parts[3]), **times)


class InterlockWatch:
    """Says which interlocks trip on captured samples; one that has tripped is ignored until it is released."""

    def __init__(self, interlocks: Sequence[Interlock], sample_rate_hz: float) -> None:
        self._interlocks, self._rate_hz = tuple(interlocks), sample_rate_hz
        self._lasting = [0] * len(self._interlocks)
        self._resting = [False] * len(self._interlocks)

    def tripped(self, values: NDArray[np.float64]) -> tuple[Interlock, ...]:
        """Interlocks that trip in the next samples, (n, 5) or (n, 15)."""
        found = []
        for k, one in enumerate(self._interlocks):
            violated = ~one.holds(values)
            needed = max(round(one.delay_s * self._rate_hz), 1)
            sample, self._lasting[k] = first_trip(violated, self._lasting[k], needed)
            if sample is not None and not self._resting[k]:
                found.append(one)
                self._resting[k] = True
            self._resting[k] = self._resting[k] and not one.holds(values[-1:], by=one.inside_by)[0]
        return tuple(found)

    def rearm(self) -> None:
        """After a hold every interlock may trip again."""
        self._lasting = [0] * len(self._interlocks)
        self._resting = [False] * len(self._interlocks)


def check_measured(interlocks: Sequence[Interlock], unmeasured: Sequence[str], *, further_axes: bool) -> None:
    """Raise LimitError where an interlock is on a channel that the rig does not measure: it would never act."""
    for one in interlocks:
        if one.channel in unmeasured or (one.further and not further_axes):
            raise LimitError(f"interlock {one}: the rig does not measure {one.channel}: take the interlock out")


class HoldWatch:
    """Decides for a test on hold whether its interlock is released, and whether another one ends the test.

    Times are counted in the rig's sample index, since statuses arrive at irregular times. A status does not tell the
    channels of further axes: while the main axis rests, their interlocks do not act.
    """

    def __init__(self, holding: Interlock | None, interlocks: Sequence[Interlock], sample_rate_hz: float) -> None:
        self._holding, self._rate_hz = holding, sample_rate_hz
        self._stops = tuple(one for one in interlocks if one.action is Action.STOP and not one.further)
        self._since: dict[Interlock | None, int] = {}  # None: time since the interlock on hold was inside by its margin

    def over(self, values: NDArray[np.float64], sample_index: int) -> bool:
        """Whether, after this sample, (1, 5), the interlock that the test holds for is released."""
        one = self._holding
        if one is None:
            return True
        return self._lasts(None, bool(one.holds(values, by=one.inside_by)[0]), sample_index, one.release_s)

    def stops(self, values: NDArray[np.float64], sample_index: int) -> Interlock | None:
        """The interlock that ends the test after this sample, (1, 5); None where none does."""
        for one in self._stops:
            if self._lasts(one, not one.holds(values)[0], sample_index, one.delay_s):
                return one
        return None

    def _lasts(self, what: Interlock | None, true: bool, sample_index: int, seconds: float) -> bool:
        if not true:
            self._since.pop(what, None)
            return False
        return sample_index - self._since.setdefault(what, sample_index) >= seconds * self._rate_hz


def first_trip(violated: NDArray[np.bool_], lasting: int, needed: int) -> tuple[int | None, int]:
    """First sample at which a violation has lasted `needed` samples, `lasting` of them earlier, and its length."""
    if not violated.any():
        return None, 0
    index = np.arange(violated.size)
    since = np.maximum.accumulate(np.where(violated, -1, index))  # last sample without violation, −1 if none
    length = np.where(violated, index - since, 0) + np.where(violated & (since < 0), lasting, 0)
    reached = np.flatnonzero(length >= needed)
    return (int(reached[0]), 0) if reached.size else (None, int(length[-1]))
