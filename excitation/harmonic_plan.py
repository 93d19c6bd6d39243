"""Plans of sines and triangles over amplitude × frequency × peak velocity × current."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice, product

import numpy as np

from excitation.configuration import to_spec
from excitation.errors import DesignError
from excitation.excess import fit_plan
from excitation.harmonic import LEAST_PERIODS, cycles_of_a_period
from excitation.harmonic_plan_spec import HarmonicPlanSpec, OrderSpec, SeriesSpec, SplitSpec, values_of
from excitation.kinds import Kind
from excitation.plan import Test, TestPlan, test_from_config
from excitation.portable_math import uniform
from excitation.signal import JSON

__all__ = ["harmonic_plan"]

_MOST_TESTS = 10_000  # weeks on a rig: more is a typing error


@dataclass(frozen=True, slots=True, kw_only=True)
class _Point:
    """One test before it has samples."""

    series: SeriesSpec
    wave_form: str
    amplitude_m: float
    frequency_hz: float
    current_a: float | None
    data_set: str
    held_out: bool

    @property
    def severity(self) -> float:
        return (self.amplitude_m * self.frequency_hz) ** 2


def harmonic_plan(config: Mapping[str, JSON]) -> TestPlan:
    """The plan that the configuration describes, in its order, checked against its envelope.

    Raises DesignError for the configuration and EnvelopeError for the first test that exceeds the rig.
    """
    spec = to_spec(HarmonicPlanSpec, config)
    every = (point for series in spec.series for point in _points(spec, series))
    points = list(islice(every, _MOST_TESTS + 1))
    if len(points) > _MOST_TESTS:
        raise DesignError(f"series make more than {_MOST_TESTS} tests: give shorter axes or fewer series")
    points = _split(points, spec.split)
    points = [points[n] for n in _order([p.severity for p in points], spec.order)]
    names = _names(points)
    tests = [_test(spec, point, name) for point, name in zip(points, names, strict=True)]
    plan = TestPlan(tests=tuple(tests), warm_up=_warm_up(spec), design=config)
    if spec.envelope is not None:
        return fit_plan(plan, spec.envelope, spec.on_excess or ("scale" if spec.scale_to_fit else "refuse"))
    return plan


def _points(spec: HarmonicPlanSpec, series: SeriesSpec) -> Iterator[_Point]:
    wave_form = series.wave_form or spec.wave_form
    speed_factor = 4.0 if wave_form == "triangle" else 2.0 * np.pi
    currents: tuple[float | None, ...] = (None,) if series.current_a is None else values_of(series.current_a)
    for (amplitude, frequency), current, _ in product(_motions(series, speed_factor), currents, range(series.repeats)):
        yield _Point(
            series=series,
            wave_form=wave_form,
            amplitude_m=amplitude,
            frequency_hz=frequency,
            current_a=current,
            data_set=series.data_set,
            held_out=series.is_held_out,
        )


def _motions(series: SeriesSpec, speed_factor: float) -> list[tuple[float, float]]:
    """Amplitude and frequency of each combination; ``speed_factor``: peak velocity over
    amplitude·frequency.
    """
    amplitude, frequency, velocity = series.amplitude_m, series.frequency_hz, series.peak_velocity_m_s
    if velocity is None:
        assert amplitude is not None and frequency is not None  # noqa: PT018  # SeriesSpec holds two of three
        return list(product(values_of(amplitude), values_of(frequency)))
    if amplitude is not None:
        return [(a, float(v / (speed_factor * a))) for a, v in product(values_of(amplitude), values_of(velocity))]
    assert frequency is not None
    return [(float(v / (speed_factor * f)), f) for f, v in product(values_of(frequency), values_of(velocity))]


def _split(points: list[_Point], split: SplitSpec | None) -> list[_Point]:
    """Draws the data set of each point that has none, so that each set spans the whole range of severity.

    The points are sorted by severity and cut into equal intervals; one point of each interval is drawn.
    """
    if split is None:
        return points
    free = sorted((n for n, p in enumerate(points) if not p.data_set), key=lambda n: points[n].severity)
    wanted = {"validation": round(split.validation * len(free)), "test": round(split.test * len(free))}
    names = ["training"] * len(free)
    for number, (name, count) in enumerate(wanted.items()):
        left = [n for n, known in enumerate(names) if known == "training"]
        draw = uniform((split.seed, 6, number), count)
        for k in range(count):  # one of each of `count` equal intervals of the remaining points
            first, last = k * len(left) // count, (k + 1) * len(left) // count
            names[left[first + int(draw[k] * (last - first))]] = name
    result = list(points)
    for n, name in zip(free, names, strict=True):
        result[n] = replace(points[n], data_set=name, held_out=name != "training")
    return result


def _order(severity: list[float], order: OrderSpec) -> list[int]:
    """Indices in playing order."""
    count = len(severity)
    if order.method == "listed":
        return list(range(count))
    if order.method == "random":
        return [int(n) for n in np.argsort(uniform((order.seed, 5), count), kind="stable")]
    by_severity = np.argsort(severity, kind="stable")
    blocks = max(1, -(-count // order.block_size))
    played: list[int] = []
    for block in range(blocks):
        dealt = by_severity[block::blocks]
        shuffled = dealt[np.argsort(uniform((order.seed, 5, block), dealt.size), kind="stable")]
        played += [int(n) for n in shuffled]
    return played


def _names(points: list[_Point]) -> list[str]:
    """Names made of wave form, amplitude, frequency and current; a repeated name gets _2, _3 …"""
    seen: Counter[str] = Counter()
    names = []
    for point in points:
        name = f"{point.wave_form}_{1e3 * point.amplitude_m:.4g}mm_{point.frequency_hz:.4g}Hz"
        if point.current_a is not None:
            name += f"_{point.current_a:.4g}A"
        if point.series.name:
            name = f"{point.series.name}_{name}"
        seen[name] += 1
        names.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
    return names


def _test(spec: HarmonicPlanSpec, point: _Point, name: str) -> Test:
    series = point.series
    if not 0.0 < point.frequency_hz < 0.5 * spec.sample_rate_hz:
        raise DesignError(
            f"test {name!r}: amplitude {point.amplitude_m:g} m has a frequency of {point.frequency_hz:.4g} Hz: it must "
            f"lie above 0 and below half the sample rate ({0.5 * spec.sample_rate_hz:g} Hz)"
        )
    cycles = series.cycles or max(spec.cycles, int(np.ceil(spec.measure_time_s * point.frequency_hz)))
    settling = spec.settling_cycles if series.settling_cycles is None else series.settling_cycles
    cycles = max(cycles, _cycles_for_the_speed(spec, point) - settling)
    config: dict[str, JSON] = {
        "name": name,
        "kind": point.wave_form,
        "sample_rate": spec.sample_rate_hz,
        "amplitude": point.amplitude_m,
        "frequency": point.frequency_hz,
        "cycles": cycles,
        "settling_cycles": settling,
        "dwell": spec.dwell_s,
        "held_out": point.held_out,
        "data_set": point.data_set,
    }
    optional: dict[str, JSON] = {
        "current": point.current_a,
        "min_temperature": spec.min_temperature_degc,
        "max_temperature": spec.max_temperature_degc,
        "corner_time": series.corner_time_s if point.wave_form == "triangle" else None,
    }
    return test_from_config(config | {key: value for key, value in optional.items() if value is not None})


def _cycles_for_the_speed(spec: HarmonicPlanSpec, point: _Point) -> int:
    """Cycles of the three periods that keep the peak velocity, where a period must hold several; else 0.

    Only at high frequencies, where they take no time: at 1000 Hz from 2 Hz on, and at most 30.
    """
    if not 8.0 * point.frequency_hz <= spec.sample_rate_hz:
        return 0  # refused by the test itself
    multiple = 4 if point.wave_form == "triangle" else 1
    in_a_period = cycles_of_a_period(spec.sample_rate_hz, point.frequency_hz, multiple)
    return LEAST_PERIODS * in_a_period if in_a_period > 1 else 0


def _warm_up(spec: HarmonicPlanSpec) -> Test | None:
    asked = spec.warm_up
    if asked is None:
        return None
    config: dict[str, JSON] = {
        "name": "warm_up",
        "kind": str(Kind.SINE),
        "sample_rate": spec.sample_rate_hz,
        "amplitude": asked.amplitude_m,
        "frequency": asked.frequency_hz,
        "cycles": asked.cycles,
    }
    return test_from_config(config if asked.current_a is None else {**config, "current": asked.current_a})
