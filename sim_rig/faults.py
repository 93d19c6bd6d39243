"""Faults on command: ``NAME[@SECONDS][:VALUE]``, for example ``emergency_stop@3`` or ``lost:0.01``."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from rigctl.device import SENSORS
from sim_rig.errors import FaultError


class FaultKind(StrEnum):
    """The faults that can be ordered."""

    LOST = "lost"
    DELAYED = "delayed"
    DOUBLED = "doubled"
    REORDERED = "reordered"
    CORRUPTED = "corrupted"
    STALLED = "stalled"
    HEARTBEAT = "heartbeat"
    BROWN_OUT = "brown_out"
    EMERGENCY_STOP = "emergency_stop"
    PUMP_TRIP = "pump_trip"
    OVER_TEMPERATURE = "over_temperature"
    FOLLOWING_ERROR = "following_error"
    SENSOR_STUCK = "sensor_stuck"
    SENSOR_SATURATED = "sensor_saturated"
    SENSOR_BROKEN = "sensor_broken"


FRAMES: Final = frozenset(
    {FaultKind.LOST, FaultKind.DELAYED, FaultKind.DOUBLED, FaultKind.REORDERED, FaultKind.CORRUPTED}
)
SECONDS: Final = {FaultKind.STALLED: 1.0, FaultKind.BROWN_OUT: 0.5, FaultKind.EMERGENCY_STOP: float("inf")}
OF_SENSOR: Final = frozenset({FaultKind.SENSOR_STUCK, FaultKind.SENSOR_SATURATED, FaultKind.SENSOR_BROKEN})
RATE: Final = 0.01  # of the frames


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultOrder:
    """One fault: kind, time and size.

    ``at_s`` counts on the rig's clock from the first sample of the first run; None: from power-on.
    """

    kind: FaultKind
    at_s: float | None = None
    share: float = RATE  # of frames
    seconds: float = 0.0  # how long it lasts
    sensor: str = "force"


def fault_order(text: str) -> FaultOrder:
    """Read ``NAME[@SECONDS][:VALUE]``; the value is a share of frames, a duration in s, or a sensor.

    Raises
    ------
    FaultError
        One line: what is wrong, and what would be right.

    >>> fault_order("sensor_stuck@2.5:displacement").sensor
    'displacement'
    """
    found = re.fullmatch(r"(?P<kind>[a-z_]+)(@(?P<at>[^:]+))?(:(?P<value>.+))?", text)
    kind = found["kind"] if found else text
    if found is None or kind not in set(FaultKind):
        raise FaultError(f"fault {text!r} does not exist: NAME[@SECONDS][:VALUE], NAME one of {', '.join(FaultKind)}")
    at_s = _number(text, "the time", found["at"], 0.0, 1e9) if found["at"] else None
    return _with_value(FaultKind(kind), at_s, found["value"], text)


def _with_value(kind: FaultKind, at_s: float | None, value: str | None, text: str) -> FaultOrder:
    if kind in OF_SENSOR:
        sensor = value or SENSORS[0]
        if sensor not in SENSORS:
            raise FaultError(f"fault {text!r}: sensor {sensor!r} does not exist: choose one of {', '.join(SENSORS)}")
        return FaultOrder(kind=kind, at_s=at_s, sensor=sensor)
    if kind in FRAMES:
        share = RATE if value is None else _number(text, "the share of frames", value, 0.0, 1.0)
        return FaultOrder(kind=kind, at_s=at_s, share=share)
    if kind in SECONDS:
        seconds = SECONDS[kind] if value is None else _number(text, "the duration", value, 0.0, 1e9)
        return FaultOrder(kind=kind, at_s=at_s, seconds=seconds)
    if value is not None:
        raise FaultError(f"fault {text!r}: {kind} takes no value, leave out ':{value}'")
    return FaultOrder(kind=kind, at_s=at_s)


def _number(text: str, what: str, value: str, low: float, high: float) -> float:
    try:
        number = float(value)
    except ValueError:
        number = float("nan")
    if not low <= number <= high:
        raise FaultError(f"fault {text!r}: {what} is {value!r}, it must be a number from {low:g} to {high:g}")
    return number


class Faults:
    """The faults ordered for one rig, and which of them are active now."""

    def __init__(self, orders: Iterable[FaultOrder] = (), *, now: Callable[[], float] = lambda: 0.0) -> None:
        self.orders, self._now = tuple(orders), now
        self.elapsed_s: float | None = None  # of the rig's clock since the first run began; None before it
        self._began: dict[FaultOrder, float] = {}
        self.frames_hit = 0

    def __bool__(self) -> bool:
        return bool(self.orders)

    def due(self, order: FaultOrder) -> bool:
        """Whether the fault has begun."""
        return order.at_s is None or (self.elapsed_s is not None and self.elapsed_s >= order.at_s - 1e-9)

    def remaining_s(self, order: FaultOrder) -> float:
        """Seconds of real time until the fault ends; 0 before it begins and after it has ended."""
        if not self.due(order):
            return 0.0
        began = self._began.setdefault(order, self._now())
        return max(began + order.seconds - self._now(), 0.0)

    def has_begun(self, kind: FaultKind) -> bool:
        """Whether a fault of this kind has begun."""
        return any(order.kind is kind and self.due(order) for order in self.orders)

    def select(self, *kinds: FaultKind) -> tuple[FaultOrder, ...]:
        return tuple(order for order in self.orders if order.kind in kinds)

    @property
    def is_off(self) -> bool:
        """Whether the rig is without power."""
        return any(self.remaining_s(order) > 0 for order in self.select(FaultKind.BROWN_OUT))
