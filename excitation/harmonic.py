"""Sines and triangles with a whole number of samples per period, and current steps while a sine runs.

A period holds one cycle, or a few where only these take a whole number of samples near the frequency that is asked for:
the frequency is never above it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import Any, ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_above, check_at_least, check_within
from excitation.configuration import STRICT, to_config
from excitation.errors import DesignError
from excitation.kinds import Kind
from excitation.portable_math import cosine_and_sine, uniform
from excitation.signal import Excitation, Samples, made_on_demand
from excitation.tone_drive import constant

__all__ = ["LEAST_PERIODS", "SineSpec", "StepsSpec", "TriangleSpec", "cycles_of_a_period", "sine", "steps", "triangle"]

_MOST_SAMPLES = 2**24
_NEAR: Final = 2e-3
"""Share by which a frequency may lie below the one asked for before a period takes more cycles.

The peak velocity is lower by the same share. At half of it sines above 1 Hz at 1000 Hz hold several cycles in a period,
at double those above 4 Hz.
"""
LEAST_PERIODS: Final = 3
"""Periods that are played where one holds several cycles: a reader drops the first and compares the others.

With two there is nothing to compare, with six a plan takes twice as long at high frequencies.
"""
_MOST_CYCLES: Final = 10  # in a period: more make tests long and the frequency hardly nearer


def _check_cycles(spec: SineSpec | TriangleSpec | StepsSpec) -> None:
    check_above("sample_rate", spec.sample_rate_hz, 0.0, "Hz")
    check_above("amplitude", spec.amplitude_m, 0.0, "m")
    check_above("frequency", spec.frequency_hz, 0.0, "Hz")
    if spec.frequency_hz < spec.sample_rate_hz / _MOST_SAMPLES:
        raise DesignError(
            f"frequency is {spec.frequency_hz:g} Hz: at {spec.sample_rate_hz:g} Hz a cycle has more than "
            f"{_MOST_SAMPLES} samples; at most {_MOST_SAMPLES}"
        )
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

    ``sequence`` "blocks": each block is a random order of all levels, no level twice in a row. "listed": the levels as
    they stand, again and again. "prbs": two levels by a maximum-length sequence of 2^order − 1 steps, which begins at a
    place that the seed draws. The whole is periodic where ``periods`` is two or more.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    amplitude_m: float
    frequency_hz: float
    cycles: int  # in one period of the whole
    levels_a: tuple[float, ...]
    step_time_s: float
    sequence: Literal["blocks", "listed", "prbs"] = "blocks"
    order: int = 7  # of a prbs
    seed: int = 0
    settling_cycles: int = 0  # before the first step, at the first level; none where the whole is periodic
    periods: int = 1
    frequency_asked_hz: float | None = None

    def __post_init__(self) -> None:
        _check_cycles(self)
        if len(self.levels_a) < 2 or len(set(self.levels_a)) != len(self.levels_a):
            raise DesignError(f"levels is {list(self.levels_a)}: give two or more different currents")
        if self.sequence == "prbs" and len(self.levels_a) != 2:
            raise DesignError(f"levels is {list(self.levels_a)}: a prbs has two")
        check_within("order", self.order, 2, 20)
        check_within("step_time", self.step_time_s, 1.0 / self.sample_rate_hz, _MOST_SAMPLES / self.sample_rate_hz, "s")
        self._check_whole_sequence()
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

    def _check_whole_sequence(self) -> None:
        """A part of a maximum-length sequence has neither its spectrum nor its correlation."""
        whole_s, lasts_s = (2**self.order - 1) * self.step_time_s, self.cycles / self.frequency_hz
        if self.sequence == "prbs" and lasts_s < whole_s * (1.0 - _NEAR):
            raise DesignError(
                f"order is {self.order}: its {2**self.order - 1} steps last {whole_s:g} s and {self.cycles} cycles at "
                f"{self.frequency_hz:g} Hz {lasts_s:g} s: give {ceil(whole_s * self.frequency_hz)} cycles or more, or "
                "a smaller order"
            )


def sine(spec: SineSpec) -> Excitation:
    """A sine of which a whole number of cycles takes a whole number of samples.

    ``design`` states the frequency, which is at most the one asked for, and within 0.2 % of it where the cycles
    that are played make three such periods.
    """
    grid = _grid(spec)
    spec = replace(spec, frequency_hz=grid.frequency_hz, frequency_asked_hz=_asked(spec, grid.frequency_hz))
    return _repeated(spec, Kind.SINE, grid, partial(_sine_samples, spec.amplitude_m, grid))


def triangle(spec: TriangleSpec) -> Excitation:
    """A triangle from zero upwards.

    Where one cycle is a period, it has a multiple of four samples, and the turning points are samples; where a
    period holds several cycles, the samples next to a turning point stay below the amplitude.
    """
    grid = _grid(spec, multiple=4)
    corner_time_s = min(spec.corner_time_s, 0.5 / grid.frequency_hz)
    spec = replace(
        spec,
        frequency_hz=grid.frequency_hz,
        frequency_asked_hz=_asked(spec, grid.frequency_hz),
        corner_time_s=corner_time_s,
    )
    corner = corner_time_s * grid.frequency_hz
    return _repeated(spec, Kind.TRIANGLE, grid, partial(_triangle_samples, spec.amplitude_m, grid, corner))


def steps(spec: StepsSpec) -> Excitation:
    """Current steps while a sine runs: each step is exactly at a sample, the current is held between
    samples.
    """
    grid = _grid_of(spec.sample_rate_hz, spec.frequency_hz, spec.settling_cycles + spec.cycles)  # the whole, exactly
    spec = replace(spec, frequency_hz=grid.frequency_hz, frequency_asked_hz=_asked(spec, grid.frequency_hz))
    settling = grid.samples_of(spec.settling_cycles)
    moving = grid.period_samples - settling
    samples = settling + spec.periods * moving
    return made_on_demand(
        kind=Kind.STEPS,
        sample_rate_hz=spec.sample_rate_hz,
        period_samples=moving if spec.periods > 1 else 0,
        samples=samples,
        displacement_m=partial(_sine_samples, spec.amplitude_m, grid, samples),
        current_a=partial(_stepped_current, spec, settling, moving),
        design={"kind": str(Kind.STEPS), **to_config(spec)},
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Grid:
    """``cycles`` of the frequency on ``period_samples``."""

    sample_rate_hz: float
    cycles: int
    period_samples: int

    @property
    def frequency_hz(self) -> float:
        return self.cycles * self.sample_rate_hz / self.period_samples

    def samples_of(self, cycles: int) -> int:
        """Samples that begin within so many cycles."""
        return -(-cycles * self.period_samples // self.cycles)

    def turns(self, samples: int) -> NDArray[np.float64]:
        """The phase of each sample in turns, (samples,), in [0, 1)."""
        return (np.arange(samples) * self.cycles % self.period_samples) / self.period_samples


def _grid(spec: SineSpec | TriangleSpec, multiple: int = 1) -> _Grid:
    """The samples of the frequency that was asked for; of the one that is stated, where it is another's."""
    asked = spec.frequency_asked_hz
    most_cycles = (spec.cycles + spec.settling_cycles) // LEAST_PERIODS
    if asked is not None:  # a design made again
        found = _nearest_below(spec.sample_rate_hz, asked, most_cycles, multiple)
        if abs(found.frequency_hz - spec.frequency_hz) <= 1e-12 * spec.frequency_hz:
            return found
    return _nearest_below(spec.sample_rate_hz, spec.frequency_hz, most_cycles, multiple)


def _nearest_below(sample_rate_hz: float, frequency_hz: float, most_cycles: int, multiple: int) -> _Grid:
    """The fewest cycles on whole samples at most 0.2 % below the frequency; where none are, those nearest to it."""
    grids = [_grid_of(sample_rate_hz, frequency_hz, n, multiple if n == 1 else 1) for n in _cycles(most_cycles)]
    near = (grid for grid in grids if grid.frequency_hz >= (1.0 - _NEAR) * frequency_hz)
    return next(near, max(grids, key=lambda grid: (grid.frequency_hz, -grid.cycles)))


def cycles_of_a_period(sample_rate_hz: float, frequency_hz: float, multiple: int = 1) -> int:
    """Cycles that a period holds where enough are played; ``multiple``: of the samples of a single one."""
    return _nearest_below(sample_rate_hz, frequency_hz, _MOST_CYCLES, multiple).cycles


def _cycles(most: int) -> range:
    return range(1, max(1, min(most, _MOST_CYCLES)) + 1)


def _grid_of(sample_rate_hz: float, frequency_hz: float, cycles: int, multiple: int = 1) -> _Grid:
    """The highest frequency, not above the given one, of which ``cycles`` take a multiple of ``multiple`` samples."""
    exact = cycles * sample_rate_hz / frequency_hz / multiple
    samples = multiple * max(1, int(np.ceil(exact * (1.0 - 1e-12))))
    return _Grid(sample_rate_hz=sample_rate_hz, cycles=cycles, period_samples=samples)


def _asked(spec: SineSpec | TriangleSpec | StepsSpec, realised_hz: float) -> float | None:
    asked = spec.frequency_hz if spec.frequency_asked_hz is None else spec.frequency_asked_hz
    return None if asked == realised_hz else asked


def _sine_samples(amplitude_m: float, grid: _Grid, samples: int) -> NDArray[np.float64]:
    period = amplitude_m * cosine_and_sine(grid.turns(min(samples, grid.period_samples)))[1]
    return np.resize(period, samples)


def _triangle_samples(amplitude_m: float, grid: _Grid, corner: float, samples: int) -> NDArray[np.float64]:
    period = amplitude_m * _triangle_shape(grid.turns(min(samples, grid.period_samples)), corner)
    return np.resize(period, samples)


def _stepped_current(spec: StepsSpec, settling: int, moving: int) -> NDArray[np.float64]:
    current = _level_sequence(spec, moving)
    return np.concatenate([np.full(settling, current[0]), np.tile(current, spec.periods)])


def _triangle_shape(turns: NDArray[np.float64], corner: float) -> NDArray[np.float64]:
    """The shape at phases in turns, with peak 1.

    ``corner``: duration of the rounded part of each turning point, in turns (0 … 1/2).

    With u the distance from the turning point in turns, the line 1 − 4u becomes the parabola
    1 − corner − 4u²/corner for u < corner/2; the whole is divided by its peak 1 − corner.
    """
    sign = np.where(turns < 0.5, 1.0, -1.0)
    distance = np.abs(np.where(turns < 0.5, turns, turns - 0.5) - 0.25)
    shape = 1.0 - 4.0 * distance
    round_ = distance < 0.5 * corner
    near = distance[round_]  # only these: with a tiny corner the other samples would overflow
    shape[round_] = 1.0 - corner - 4.0 * near * (near / corner)
    return np.asarray(sign * shape / (1.0 - corner))


def _level_sequence(spec: StepsSpec, samples: int) -> NDArray[np.float64]:
    """The current of one period, (samples,), held between the steps."""
    step_samples = max(1, round(spec.step_time_s * spec.sample_rate_hz))
    needed = -(-samples // step_samples)
    if spec.sequence == "listed":
        order = [step % len(spec.levels_a) for step in range(needed)]
    elif spec.sequence == "prbs":
        order = np.resize(_maximum_length(spec.order, spec.seed), needed).tolist()
    else:
        order = _blocks(spec, needed)
    return np.repeat(np.array(spec.levels_a)[order], step_samples)[:samples]


def _maximum_length(order: int, seed: int) -> NDArray[np.int64]:
    """One period of a binary sequence, (2^order − 1,), of 0 and 1: every word of ``order`` bits but the zeros, once.

    References
    ----------
    Golomb, Shift Register Sequences, 1967.
    """
    from scipy.signal import max_len_seq  # 0.3 s to import: only where one is asked for

    sequence = np.asarray(max_len_seq(order)[0], dtype=np.int64)
    return np.roll(sequence, -int(uniform((seed, 4), 1)[0] * sequence.size))


def _blocks(spec: StepsSpec, needed: int) -> list[int]:
    order: list[int] = []
    block = 0
    while len(order) < needed:
        draw = np.argsort(uniform((spec.seed, 3, block), len(spec.levels_a)), kind="stable").tolist()
        if order and draw[0] == order[-1]:
            draw = draw[1:] + draw[:1]
        order += draw
        block += 1
    return order[:needed]


def _repeated(
    spec: SineSpec | TriangleSpec, kind: Kind, grid: _Grid, displacement_of: Callable[[int], NDArray[np.float64]]
) -> Excitation:
    samples = grid.samples_of(spec.settling_cycles + spec.cycles)
    current: Samples | None = None if spec.current_a is None else partial(constant, spec.current_a, samples)
    return made_on_demand(
        kind=kind,
        sample_rate_hz=spec.sample_rate_hz,
        period_samples=grid.period_samples,
        samples=samples,
        displacement_m=partial(displacement_of, samples),
        current_a=current,
        design={"kind": str(kind), **to_config(spec)},
    )
