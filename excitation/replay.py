"""A measured record played again: cut, centred, filtered, resampled, faded at both ends and scaled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from excitation.bounds import Bounds
from excitation.checks import check_above, check_at_least, check_one_of, check_within
from excitation.configuration import STRICT, to_config
from excitation.errors import DesignError
from excitation.fades import fade
from excitation.kinds import REPLAY, Kind
from excitation.periodic import derivative
from excitation.record import UNITS, read_channel
from excitation.record_digest import check_digest, digest_of
from excitation.signal import Excitation, made_on_demand

__all__ = ["ReplaySpec", "replay"]

_MOST_SAMPLES: Final = 2**24
_FINEST: Final = 10_000
"""Largest denominator of a ratio of sample rates: beyond it two clocks are not told apart from one that drifts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplaySpec:
    """A part of a record as a displacement, about its own mean.

    ``record_sha256`` is filled in when the record is read: the design is made again from the same record only.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    record: str
    bounds: Bounds
    channel: str = "displacement"
    unit: str = ""  # of the channel, where the file states none
    start_s: float = 0.0
    end_s: float | None = None
    sample_rate_hz: float | None = None  # none: that of the record
    f_max_hz: float | None = None  # what lies above is filtered out
    fade_s: float = 0.5
    scale: float = 1.0
    level: float = 1.0
    current_channel: str = ""
    current_unit: str = ""  # of the current channel, where the file states none
    current_a: float | None = None
    record_sha256: str = ""

    def __post_init__(self) -> None:
        check_at_least("start", self.start_s, 0.0, "s")
        if self.end_s is not None and self.end_s <= self.start_s:
            raise DesignError(f"end is {self.end_s:g} s: it must be above start ({self.start_s:g} s)")
        for name, value in (("sample_rate", self.sample_rate_hz), ("f_max", self.f_max_hz), ("fade", self.fade_s)):
            if value is not None:
                check_above(name, value, 0.0)
        if self.scale == 0.0 or abs(self.scale) > 1e6:
            raise DesignError(
                f"scale is {self.scale:g}: it must be another number than 0, up to 1e6; -1 turns the sign"
            )
        check_within("level", self.level, 1e-6, 1e3)
        for name, unit, si in (("unit", self.unit, "m"), ("current_unit", self.current_unit, "A")):
            if unit:
                check_one_of(name, unit, [one for one, (of, _) in UNITS.items() if of == si])
        if self.current_channel and self.current_a is not None:
            raise DesignError("current_channel and current are both given: give one of them")


def replay(spec: ReplaySpec) -> Excitation:
    """The record's part, faded in and out over ``fade`` by (1 − cos)/2: it begins and ends at rest in the middle.

    It keeps no samples: they are made of the record, whose SHA-256 is compared, whenever they are read.

    Raises DesignError where the record cannot be read, has changed since the design, or exceeds the bounds.
    """
    shape, played_hz, mean_m = _shape(spec)
    velocity = derivative(shape, played_hz)  # it ends where it begins, at rest
    moved = (shape, velocity, derivative(velocity, played_hz))
    x, v, a = (float(np.abs(values).max()) for values in moved)
    factor = spec.bounds.factor((x, v, a), spec.level)
    spec = replace(spec, record_sha256=spec.record_sha256 or digest_of(Path(spec.record)))
    current = partial(_current, spec, shape.size) if spec.current_channel or spec.current_a is not None else None
    if current is not None:
        current()  # to check it
    return made_on_demand(
        kind=Kind.CUSTOM,
        sample_rate_hz=played_hz,
        period_samples=0,
        samples=shape.size,
        displacement_m=partial(_motion, spec, factor),
        current_a=current,
        design={"kind": REPLAY, **to_config(spec)},
        figures={"peak_displacement": factor * x, "peak_velocity": factor * v, "peak_acceleration": factor * a,
                 "scaled_by": factor, "record_mean": mean_m},
        checked=True,
    )  # fmt: skip


def _shape(spec: ReplaySpec) -> tuple[NDArray[np.float64], float, float]:
    """What is played before it is brought into the bounds, (N,), m; its rate, Hz; and the mean of the record's part."""
    motion, rate_hz = _channel(spec, spec.channel, "m", spec.unit)
    motion = _cut(spec, motion, rate_hz)
    played_hz, mean_m = spec.sample_rate_hz or rate_hz, float(motion.mean())
    return spec.scale * _prepared(spec, motion - mean_m, rate_hz, played_hz), played_hz, mean_m


def _motion(spec: ReplaySpec, factor: float) -> NDArray[np.float64]:
    return factor * _shape(spec)[0]


def _current(spec: ReplaySpec, samples: int) -> NDArray[np.float64]:
    if spec.current_a is not None:
        return np.full(samples, spec.current_a)
    asked, rate_hz = _channel(spec, spec.current_channel, "A", spec.current_unit)
    return _held(_cut(spec, asked, rate_hz), rate_hz, spec.sample_rate_hz or rate_hz, samples)


def _channel(spec: ReplaySpec, channel: str, si: str, unit: str = "") -> tuple[NDArray[np.float64], float]:
    """The channel of the record of the design, and its rate."""
    path = Path(spec.record)
    if spec.record_sha256 and path.is_file():
        check_digest(path, spec.record_sha256)
    return read_channel(path, channel, si, unit)


def _cut(spec: ReplaySpec, values: NDArray[np.float64], rate_hz: float) -> NDArray[np.float64]:
    end_s = values.size / rate_hz if spec.end_s is None else spec.end_s
    first, last = round(min(spec.start_s * rate_hz, 2.0**53)), round(min(end_s * rate_hz, 2.0**53))
    if last > values.size or last - first < 16:
        raise DesignError(
            f"start … end is {spec.start_s:g} … {end_s:g} s: the record lasts {values.size / rate_hz:g} s, and a part "
            "has 16 samples or more"
        )
    return values[first:last]


def _prepared(spec: ReplaySpec, x: NDArray[np.float64], rate_hz: float, played_hz: float) -> NDArray[np.float64]:
    """Faded, at the other rate, filtered, and faded again, as a filter leaves a little at the ends."""
    if 2.0 * spec.fade_s * rate_hz > x.size:
        raise DesignError(f"fade is {spec.fade_s:g} s: two of them are longer than the part of {x.size / rate_hz:g} s")
    x = _resampled(x * fade(x.size, max(2, round(spec.fade_s * rate_hz))), rate_hz, played_hz)
    window = fade(x.size, max(2, round(spec.fade_s * played_hz)))
    if spec.f_max_hz is None:
        return x * window
    spectrum = np.fft.rfft(x)
    spectrum[np.arange(spectrum.size) * (played_hz / x.size) > spec.f_max_hz] = 0.0
    return np.fft.irfft(spectrum, n=x.size) * window


def _resampled(x: NDArray[np.float64], rate_hz: float, played_hz: float) -> NDArray[np.float64]:
    """Without what the lower of the two rates cannot carry."""
    if played_hz == rate_hz:
        return x
    from scipy.signal import resample_poly  # 0.3 s to import: only where it is needed

    ratio = Fraction(played_hz / rate_hz).limit_denominator(_FINEST)
    if ratio == 0 or x.size * ratio > _MOST_SAMPLES or abs(float(ratio) * rate_hz / played_hz - 1.0) > 1e-6:
        raise DesignError(f"sample_rate is {played_hz:g} Hz: the record's {rate_hz:g} Hz cannot be brought to it")
    return np.asarray(resample_poly(x, ratio.numerator, ratio.denominator))


def _held(current: NDArray[np.float64], rate_hz: float, played_hz: float, samples: int) -> NDArray[np.float64]:
    """The current at each played sample, held between those of the record."""
    index = np.minimum((np.arange(samples) * (rate_hz / played_hz) + 1e-9).astype(np.int64), current.size - 1)
    return current[index]
