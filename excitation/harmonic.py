"""Sines and triangles with a whole number of samples per period, and current steps while a sine runs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_above, check_at_least, check_within
from excitation.configuration import STRICT, to_config
from excitation.errors import DesignError
from excitation.kinds import Kind
from excitation.portable_math import cosine_and_sine, uniform
from excitation.signal import JSON, Excitation

__all__ = ["SineSpec", "StepsSpec", "TriangleSpec", "sine", "steps", "triangle"]

_MOST_SAMPLES = 2**24


def _check_cycles(spec: SineSpec | TriangleSpec | StepsSpec) -> None:
    check_above("sample_rate", spec.sample_rate_hz, 0.0, "Hz")
    check_above("amplitude", spec.amplitude_m, 0.0, "m")
    check_above("frequency", spec.frequency_hz, 0.0, "Hz")
    if spec.frequency_hz > spec.sample_rate_hz / 8:
        raise DesignError(
            f"frequency is {spec.frequency_hz:g} Hz: at {spec.sample_rate_hz:g} Hz it must not exceed "
            f"{spec.sample_rate_hz / 8:g} Hz, eight samples a period"
        )
    check_at_least("cycles", spec.cycles, 1)
    check_at_least("settling_cycles", spec.settling_cycles, 0)
    total = (spec.cycles + spec.settling_cycles) * spec.sample_rate_hz / spec.frequency_hz
    if total > _MOST_SAMPLES:
        raise DesignError(f"cycles is {spec.cycles}: with settling {total:.3g} samples; at most {_MOST_SAMPLES}")


@dataclass(frozen=True, slots=True, kw_only=True)
class SineSpec:
    """x(t) = amplitude·sin(2π·frequency·t), settling cycles first; a constant current where one is given."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    amplitude_m: float
    frequency_hz: float
    cycles: int
    settling_cycles: int = 0
    current_a: float | None = None
    frequency_asked_hz: float | None = None  # as asked, before rounding to whole samples per period

    def __post_init__(self) -> None:
        _check_cycles(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class TriangleSpec:
    """Constant speed 4·amplitude·frequency between the turning points.

    ``corner_time`` rounds each turning point by a parabola of that duration, so that the acceleration stays
    at 2·speed/corner_time; the amplitude and the frequency stay. 0: sharp corners.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    amplitude_m: float
    frequency_hz: float
    cycles: int
    settling_cycles: int = 0
    current_a: float | None = None
    corner_time_s: float = 0.0
    frequency_asked_hz: float | None = None

    def __post_init__(self) -> None:
        _check_cycles(self)
        check_within("corner_time", self.corner_time_s, 0.0, 0.5 / self.frequency_hz, "s")


@dataclass(frozen=True, slots=True, kw_only=True)
class StepsSpec:
    """A sine during which the current jumps between levels every ``step_time``.

    The levels come in blocks, each block a random order of all of them, no level twice in a row. The whole is
    periodic where ``periods`` is two or more.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    amplitude_m: float
    frequency_hz: float
    cycles: int  # in one period of the whole
    levels_a: tuple[float, ...]
    step_time_s: float
    seed: int = 0
    settling_cycles: int = 0  # before the first step, at the first level; none where the whole is periodic
    periods: int = 1
    frequency_asked_hz: float | None = None

    def __post_init__(self) -> None:
        _check_cycles(self)
        if len(self.levels_a) < 2 or len(set(self.levels_a)) != len(self.levels_a):
            raise DesignError(f"levels is {list(self.levels_a)}: give two or more different currents")
        check_at_least("step_time", self.step_time_s, 1.0 / self.sample_rate_hz, "s")
        check_within("seed", self.seed, 0, 2**63 - 1)
        check_at_least("periods", self.periods, 1)
        if self.periods > 1 and self.settling_cycles:
            raise DesignError(
                f"settling_cycles is {self.settling_cycles}: it must be 0 where periods is above 1, "
                "the first period settles"
            )
        total = self.periods * self.cycles * self.sample_rate_hz / self.frequency_hz
        if total > _MOST_SAMPLES:
            raise DesignError(f"periods is {self.periods}: {total:.3g} samples in all; at most {_MOST_SAMPLES}")


def sine(spec: SineSpec) -> Excitation:
    """A sine whose frequency is the nearest that gives a whole number of samples per period (``design`` says
    which).
    """
    period_samples, realised_hz = _whole_samples(spec.sample_rate_hz, spec.frequency_hz)
    spec = replace(spec, frequency_hz=realised_hz, frequency_asked_hz=_asked(spec, realised_hz))
    return _repeated(spec, Kind.SINE, _sine_period(spec.amplitude_m, period_samples))


def triangle(spec: TriangleSpec) -> Excitation:
    """A triangle from zero upwards; its period a multiple of four samples, so that the turning points are
    samples.
    """
    period_samples, realised_hz = _whole_samples(spec.sample_rate_hz, spec.frequency_hz, multiple=4)
    corner_time_s = min(spec.corner_time_s, 0.5 / realised_hz)
    spec = replace(
        spec,
        frequency_hz=realised_hz,
        frequency_asked_hz=_asked(spec, realised_hz),
        corner_time_s=corner_time_s,
    )
    corner = corner_time_s * realised_hz
    return _repeated(spec, Kind.TRIANGLE, spec.amplitude_m * _triangle_shape(period_samples, corner))


def steps(spec: StepsSpec) -> Excitation:
    """Current steps while a sine runs: each step is exactly at a sample, the current is held between
    samples.
    """
    period_samples, realised_hz = _whole_samples(spec.sample_rate_hz, spec.frequency_hz)
    spec = replace(spec, frequency_hz=realised_hz, frequency_asked_hz=_asked(spec, realised_hz))
    motion = _sine_period(spec.amplitude_m, period_samples)
    moving = spec.cycles * period_samples
    current = _level_sequence(spec, moving)
    settling = np.full(spec.settling_cycles * period_samples, current[0])
    return Excitation(
        kind=Kind.STEPS,
        sample_rate_hz=spec.sample_rate_hz,
        period_samples=moving if spec.periods > 1 else 0,
        displacement_m=np.tile(motion, spec.settling_cycles + spec.cycles * spec.periods),
        current_a=np.concatenate([settling, np.tile(current, spec.periods)]),
        design={"kind": str(Kind.STEPS), **to_config(spec)},
    )


def _asked(spec: SineSpec | TriangleSpec | StepsSpec, realised_hz: float) -> float | None:
    asked = spec.frequency_hz if spec.frequency_asked_hz is None else spec.frequency_asked_hz
    return None if asked == realised_hz else asked


def _whole_samples(sample_rate_hz: float, frequency_hz: float, multiple: int = 1) -> tuple[int, float]:
    """Samples per period and the frequency that they give: the nearest frequency with a whole number of
    samples.
    """
    exact = sample_rate_hz / frequency_hz / multiple
    candidates = [multiple * max(1, int(n)) for n in (np.floor(exact + 1e-9), np.ceil(exact - 1e-9))]
    period_samples = min(candidates, key=lambda n: abs(sample_rate_hz / n - frequency_hz))
    return period_samples, sample_rate_hz / period_samples


def _sine_period(amplitude_m: float, period_samples: int) -> NDArray[np.float64]:
    return amplitude_m * cosine_and_sine(np.arange(period_samples) / period_samples)[1]


def _triangle_shape(period_samples: int, corner: float) -> NDArray[np.float64]:
    """One period with peak 1; ``corner``: duration of the rounded part of each turning point, in turns (0 …
    1/2).

    With u the distance from the turning point in turns, the line 1 − 4u becomes the parabola
    1 − corner − 4u²/corner for u < corner/2; the whole is divided by its peak 1 − corner.
    """
    turns = np.arange(period_samples) / period_samples
    sign = np.where(turns < 0.5, 1.0, -1.0)
    distance = np.abs(np.where(turns < 0.5, turns, turns - 0.5) - 0.25)
    shape = 1.0 - 4.0 * distance
    round_ = distance < 0.5 * corner
    near = distance[round_]  # only these: with a tiny corner the other samples would overflow
    shape[round_] = 1.0 - corner - 4.0 * near * (near / corner)
    return np.asarray(sign * shape / (1.0 - corner))


def _level_sequence(spec: StepsSpec, samples: int) -> NDArray[np.float64]:
    """The current of one period, (samples,): blocks of all levels in random order, no level twice in a
    row.
    """
    step_samples = max(1, round(spec.step_time_s * spec.sample_rate_hz))
    needed = -(-samples // step_samples)
    order: list[int] = []
    block = 0
    while len(order) < needed:
        draw = np.argsort(uniform((spec.seed, 3, block), len(spec.levels_a)), kind="stable").tolist()
        if order and draw[0] == order[-1]:
            draw = draw[1:] + draw[:1]
        order += draw
        block += 1
    return np.repeat(np.array(spec.levels_a)[order[:needed]], step_samples)[:samples]


def _repeated(spec: SineSpec | TriangleSpec, kind: Kind, period: NDArray[np.float64]) -> Excitation:
    displacement = np.tile(period, spec.settling_cycles + spec.cycles)
    config: dict[str, JSON] = {"kind": str(kind), **to_config(spec)}
    return Excitation(
        kind=kind,
        sample_rate_hz=spec.sample_rate_hz,
        period_samples=period.size,
        displacement_m=displacement,
        current_a=None if spec.current_a is None else np.full(displacement.size, spec.current_a),
        design=config,
    )
