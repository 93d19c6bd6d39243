"""What a harmonic plan configuration says: series over amplitude, frequency, peak velocity and current."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from excitation.checks import check_above, check_at_least, check_within
from excitation.configuration import STRICT
from excitation.errors import DesignError
from excitation.rig import Envelope

__all__ = ["Axis", "AxisRange", "HarmonicPlanSpec", "OrderSpec", "SeriesSpec", "SplitSpec", "WarmUpSpec"]


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisRange:
    """``count`` values from ``min`` to ``max``, evenly or logarithmically."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    min: float
    max: float
    count: int
    spacing: Literal["log", "linear"] = "log"

    def __post_init__(self) -> None:
        check_within("count", self.count, 2, 1000)
        if self.max <= self.min or (self.spacing == "log" and self.min <= 0):
            raise DesignError(
                f"min … max is {self.min:g} … {self.max:g}: it must rise, from above 0 where spacing is log"
            )

    def values(self) -> tuple[float, ...]:
        share = [n / (self.count - 1) for n in range(self.count)]
        if self.spacing == "linear":
            return tuple(self.min + s * (self.max - self.min) for s in share)
        # six digits: powers differ in the last bit between machines
        inner = [float(f"{self.min * (self.max / self.min) ** s:.6g}") for s in share[1:-1]]
        return (self.min, *inner, self.max)


Axis = float | tuple[float, ...] | AxisRange


def values_of(axis: Axis) -> tuple[float, ...]:
    match axis:
        case AxisRange():
            return axis.values()
        case tuple():
            return axis
    return (axis,)


@dataclass(frozen=True, slots=True, kw_only=True)
class SeriesSpec:
    """Every combination of two of amplitude, frequency and peak velocity, with every current.

    The third follows: peak velocity is 2π·amplitude·frequency of a sine, 4·amplitude·frequency of a triangle.
    One amplitude over many peak velocities is the constant-amplitude series (PVP plot), one peak velocity
    over many amplitudes the constant-peak-velocity series.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    amplitude_m: Axis | None = None
    frequency_hz: Axis | None = None
    peak_velocity_m_s: Axis | None = None
    current_a: Axis | None = None  # none: a passive damper
    name: str = ""
    wave_form: Literal["sine", "triangle"] | None = None
    corner_time_s: float | None = None  # triangles
    cycles: int | None = None
    settling_cycles: int | None = None
    repeats: int = 1
    data_set: str = ""
    held_out: bool | None = None  # none: held out where data_set is neither empty nor "training"

    def __post_init__(self) -> None:
        given = [self.amplitude_m, self.frequency_hz, self.peak_velocity_m_s]
        if sum(axis is not None for axis in given) != 2:
            raise DesignError("amplitude, frequency, peak_velocity: give two of the three, the third follows")
        names = ("amplitude", "frequency", "peak_velocity")
        for name, axis in zip(names, given, strict=True):
            for value in () if axis is None else values_of(axis):
                check_above(name, value, 0.0)
        for name, axis in (*zip(names, given, strict=True), ("current", self.current_a)):
            if axis is not None and not values_of(axis):
                raise DesignError(f"{name} is an empty list: give at least one value or leave it out")
        check_within("repeats", self.repeats, 1, 1000)
        _check_cycles(self.cycles, self.settling_cycles)
        if self.corner_time_s is not None:
            check_at_least("corner_time", self.corner_time_s, 0.0, "s")

    @property
    def is_held_out(self) -> bool:
        return self.data_set not in ("", "training") if self.held_out is None else self.held_out


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderSpec:
    """In which order the tests run.

    "blocks": tests are distributed by severity (peak velocity squared) so that every block has mild and severe
    ones, and shuffled within their block: temperature and the history of current and stroke are then not
    correlated with an axis of the plan.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    method: Literal["blocks", "random", "listed"] = "blocks"
    block_size: int = 8
    seed: int = 0

    def __post_init__(self) -> None:
        check_at_least("block_size", self.block_size, 2)
        check_at_least("seed", self.seed, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitSpec:
    """Shares of the tests without a data_set that become validation and test; the others are training."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    validation: float = 0.0
    test: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        check_within("validation", self.validation, 0.0, 1.0)
        check_within("test", self.test, 0.0, 1.0)
        check_at_least("seed", self.seed, 0)
        if self.validation + self.test >= 1.0:
            raise DesignError(
                f"validation + test is {self.validation + self.test:g}: it must leave something for training, below 1"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUpSpec:
    """A sine repeated until the damper has reached the gate's lower temperature."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    amplitude_m: float
    frequency_hz: float
    cycles: int = 10
    current_a: float | None = None

    def __post_init__(self) -> None:
        check_above("amplitude", self.amplitude_m, 0.0, "m")
        check_above("frequency", self.frequency_hz, 0.0, "Hz")
        _check_cycles(self.cycles, None)


@dataclass(frozen=True, slots=True, kw_only=True)
class HarmonicPlanSpec:
    """A plan of sines and triangles; series inherit the cycles, settling cycles and wave form given here."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    series: tuple[SeriesSpec, ...]
    wave_form: Literal["sine", "triangle"] = "sine"
    cycles: int = 5
    settling_cycles: int = 2
    measure_time_s: float = 0.0  # more cycles where they last less than this
    dwell_s: float = 0.0
    min_temperature_degc: float | None = None  # the gate before each test
    max_temperature_degc: float | None = None
    order: OrderSpec = field(default_factory=OrderSpec)
    split: SplitSpec | None = None
    warm_up: WarmUpSpec | None = None
    envelope: Envelope | None = None
    scale_to_fit: bool = False
    on_excess: Literal["refuse", "drop", "shorten", "scale"] | None = None  # none: scale_to_fit says it

    def __post_init__(self) -> None:
        _check_cycles(self.cycles, self.settling_cycles)
        check_above("sample_rate", self.sample_rate_hz, 0.0, "Hz")
        if not self.series:
            raise DesignError("series is empty: a plan needs at least one [[series]]")
        check_at_least("measure_time", self.measure_time_s, 0.0, "s")
        check_at_least("dwell", self.dwell_s, 0.0, "s")
        if self.warm_up is not None and self.min_temperature_degc is None:
            raise DesignError("warm_up needs min_temperature: add the temperature up to which it runs")


def _check_cycles(cycles: int | None, settling_cycles: int | None) -> None:
    if cycles is not None:
        check_at_least("cycles", cycles, 1)
    if settling_cycles is not None:
        check_at_least("settling_cycles", settling_cycles, 0)
