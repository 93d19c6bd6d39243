"""Swept sines: linear or logarithmic in time, their amplitude what the bounds allow at each frequency."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray

from excitation.bounds import Bounds
from excitation.checks import check_above, check_within
from excitation.configuration import STRICT, to_config
from excitation.errors import DesignError
from excitation.fades import fade
from excitation.kinds import Kind
from excitation.periodic import derivative
from excitation.portable_math import cosine_and_sine
from excitation.signal import Excitation, Samples, made_on_demand
from excitation.tone_drive import constant

__all__ = ["SweepSpec", "sweep"]

_MOST_SAMPLES: Final = 2**24


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepSpec:
    """A sine from ``f_start`` to ``f_end``, up or down, faded in and out over ``fade`` at each end.

    Its amplitude at each frequency is ``level`` of the largest that the bounds allow: constant displacement, then
    velocity, then acceleration. It is made once; it begins and ends at rest in the middle.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    f_start_hz: float
    f_end_hz: float
    duration_s: float
    bounds: Bounds
    law: Literal["linear", "log"] = "log"
    fade_s: float | None = None  # none: a twentieth of the duration
    level: float = 1.0
    current_a: float | None = None

    def __post_init__(self) -> None:
        check_above("sample_rate", self.sample_rate_hz, 0.0, "Hz")
        for name, value in (("f_start", self.f_start_hz), ("f_end", self.f_end_hz)):
            check_above(name, value, 0.0, "Hz")
            if value > self.sample_rate_hz / 8:
                raise DesignError(
                    f"{name} is {value:g} Hz: at {self.sample_rate_hz:g} Hz it must not exceed "
                    f"{self.sample_rate_hz / 8:g} Hz, eight samples a period"
                )
        if self.f_start_hz == self.f_end_hz:
            raise DesignError(f"f_end is {self.f_end_hz:g} Hz like f_start: a sweep changes its frequency; use a sine")
        samples = self.duration_s * self.sample_rate_hz
        if not 16 <= samples <= _MOST_SAMPLES:
            raise DesignError(f"duration is {self.duration_s:g} s: {samples:.3g} samples; 16 … {_MOST_SAMPLES}")
        check_within("level", self.level, 1e-6, 1.0)
        if self.fade_s is not None:
            check_within("fade", self.fade_s, 2.0 / self.sample_rate_hz, 0.5 * self.duration_s, "s")
        if self.duration_s * 0.5 * (self.f_start_hz + self.f_end_hz) < 1.0:
            raise DesignError(f"duration is {self.duration_s:g} s: less than one cycle; make it longer")


def sweep(spec: SweepSpec) -> Excitation:
    """x(t) = A(f(t))·w(t)·sin φ(t), φ' = 2πf; w fades in and out, A(f) = min(x_max, v_max/ω, a_max/ω²).

    The whole is scaled down where its slowly changing amplitude adds to velocity or acceleration, so that the bounds
    hold sample by sample.
    """
    shape = _shape(spec)
    velocity = derivative(shape, spec.sample_rate_hz)  # it ends where it begins, at rest
    acceleration = derivative(velocity, spec.sample_rate_hz)
    x, v, a = (float(np.abs(values).max()) for values in (shape, velocity, acceleration))
    factor = spec.level * min(1.0, spec.bounds.largest_factor((x, v, a)))
    samples = shape.size
    current: Samples | None = None if spec.current_a is None else partial(constant, spec.current_a, samples)
    return made_on_demand(
        kind=Kind.SWEEP,
        sample_rate_hz=spec.sample_rate_hz,
        period_samples=0,
        samples=samples,
        displacement_m=partial(_scaled_shape, spec, factor),
        current_a=current,
        design={"kind": str(Kind.SWEEP), **to_config(spec)},
        figures={
            "peak_displacement": factor * x,
            "peak_velocity": factor * v,
            "peak_acceleration": factor * a,
            "sweep_rate": _rate_of(spec),
        },
    )


def _rate_of(spec: SweepSpec) -> str:
    if spec.law == "linear":
        return f"{(spec.f_end_hz - spec.f_start_hz) / spec.duration_s:.4g} Hz/s"
    return f"{np.log2(spec.f_end_hz / spec.f_start_hz) * 60.0 / spec.duration_s:.4g} octaves/min"


def _scaled_shape(spec: SweepSpec, factor: float) -> NDArray[np.float64]:
    return factor * _shape(spec)


def _shape(spec: SweepSpec) -> NDArray[np.float64]:
    """The sweep at full level, before the small correction for its changing amplitude; (N,)."""
    samples = round(spec.duration_s * spec.sample_rate_hz)
    frequency = _frequency(spec, samples)
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (frequency[1:] + frequency[:-1]) / spec.sample_rate_hz)])
    fade_s = 0.05 * spec.duration_s if spec.fade_s is None else spec.fade_s
    window = fade(samples, max(2, round(fade_s * spec.sample_rate_hz)))
    return _amplitude(spec.bounds, frequency) * window * cosine_and_sine(turns - np.floor(turns))[1]


def _frequency(spec: SweepSpec, samples: int) -> NDArray[np.float64]:
    """Hz at each sample, (N,): equal steps, or equal ratios."""
    low, high = spec.f_start_hz, spec.f_end_hz
    if spec.law == "linear":
        return np.asarray(low + (high - low) * (np.arange(samples) / (samples - 1)))
    ratio = float(f"{(high / low) ** (1.0 / (samples - 1)):.15g}")  # powers differ in the last bit between machines
    steps = np.full(samples, ratio)
    steps[0] = low
    return np.clip(np.cumprod(steps), min(low, high), max(low, high))


def _amplitude(bounds: Bounds, frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    omega = 2.0 * np.pi * frequency_hz
    amplitude = np.minimum(bounds.max_displacement_m, bounds.max_velocity_m_s / omega)
    if bounds.max_acceleration_m_s2 is not None:
        amplitude = np.minimum(amplitude, bounds.max_acceleration_m_s2 / (omega * omega))
    return np.asarray(amplitude)
