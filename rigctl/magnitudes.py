"""Whether the numbers of a run can be those of a damper on a machine, and which unit is probably wrong where not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.runfile import Run

__all__ = ["Doubt", "doubts_of"]

Floats = NDArray[np.float64]

# What no machine does. Half and double: the usual mistakes are factors of 25 and more, so both change little.
MOST_SPEED: Final = 30.0  # m/s: drop towers and gas guns for landing gear and crash reach some 20
MOST_STROKE: Final = 5.0  # m, peak to peak: the longest dampers of bridges have ±1.5 m
MOST_FORCE: Final = 1e8  # N: the largest machine for bridge bearings presses with 6e7 N
LEAST_TEMPERATURE: Final = -273.15  # degC
# What few machines do: a question, and no refusal.
LARGE_FORCE: Final = 1e6  # N: dampers of buildings exceed it
SMALL_FORCE: Final = 2.0  # N, peak to peak: below the friction of the smallest damper of furniture
SMALL_STROKE: Final = 1e-4  # m, peak to peak: bushes are tested with less …
STIFF: Final = 2e7  # N/m … but are not that stiff
HOT, COLD = 250.0, -80.0  # degC: oil burns and freezes
LARGE_CURRENT: Final = 60.0  # A: coils of dampers take up to some 10
ALIKE: Final = 0.9  # correlation from which two channels show the same motion
OFF: Final = 0.2  # share by which the same motion may differ in two channels
_SMOOTH_HZ: Final = 200.0  # speeds are means over such a time: sensor noise is not taken for speed
_LOOKED_AT: Final = 1_000_000  # samples

_LENGTHS: Final = (
    (1e-3, "millimetres stored as metres"),
    (0.0254, "inches stored as metres"),
    (1e3, "metres stored as millimetres"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Doubt:
    """What is strange about a channel, with the probable cause; ``impossible``: no machine does it."""

    channel: str
    text: str
    impossible: bool = False


def doubts_of(run: Run) -> tuple[Doubt, ...]:
    """Everything that is strange about the size of the channels of a run; empty where there is nothing."""
    channels = {name: values[:_LOOKED_AT] for name, values in run.channels.items()}
    found: list[Doubt] = []
    if "displacement" in channels and run.samples > 1:
        found += _motion(channels["displacement"], channels.get("force"), run.sample_rate_hz)
        for other in ("velocity", "displacement_command"):
            if other in channels and not found:
                found += _same_motion(channels["displacement"], channels[other], other, run.sample_rate_hz)
    if "force" in channels:
        found += _force(channels["force"])
    if "temperature" in channels:
        found += _temperature(channels["temperature"])
    if "current" in channels and (peak := float(np.max(np.abs(channels["current"])))) > LARGE_CURRENT:
        text = f"it reaches {peak:.4g} A: are these milliamperes stored as amperes?"
        found.append(Doubt(channel="current", text=text))
    return tuple(found)


def _motion(x: Floats, force: Floats | None, rate: float) -> Iterator[Doubt]:
    stroke, speed = float(np.ptp(x)), _peak_speed(x, rate)
    if speed > MOST_SPEED or stroke > MOST_STROKE:
        words = _length_words(stroke, speed)
        text = f"it spans {stroke:.4g} m at up to {speed:.4g} m/s, which no machine does: {words}"
        yield Doubt(channel="displacement", text=text, impossible=True)
    elif force is not None and 0.0 < stroke < SMALL_STROKE and np.ptp(force) / stroke > STIFF:
        text = f"it spans {1e3 * stroke:.3g} mm under {np.ptp(force):.4g} N: is it {_LENGTHS[2][1]}?"
        yield Doubt(channel="displacement", text=text)


def _length_words(stroke: float, speed: float) -> str:
    """The mistake of a unit that would make the motion one of a damper."""
    for factor, words in _LENGTHS[:2]:
        if factor * stroke < 1.0 and factor * speed < 10.0:
            return f"it looks like {words}"
    return "its unit, or the sample rate, is wrong"


def _peak_speed(x: Floats, rate: float) -> float:
    """Highest speed, m/s, over a two-hundredth of a second or three samples, of all but one sample in 200."""
    steps = min(max(1, round(rate / _SMOOTH_HZ)), x.size - 1)
    return float(np.percentile(np.abs(x[steps:] - x[:-steps]), 99.5)) * rate / steps


def _same_motion(x: Floats, other: Floats, name: str, rate: float) -> Iterator[Doubt]:
    """A measured velocity beside the derivative of the displacement, or a command beside the displacement."""
    steps = min(max(1, round(rate / _SMOOTH_HZ)), max(1, (x.size - 1) // 4))
    moved = (x[steps:] - x[:-steps]) * (rate / steps if name == "velocity" else 1.0)
    beside = _means(other, steps) if name == "velocity" else other[steps:] - other[:-steps]
    size = float(np.linalg.norm(moved) * np.linalg.norm(beside))
    if size == 0.0:
        return
    alike = float(moved @ beside) / size
    ratio = float(np.linalg.norm(beside) / np.linalg.norm(moved))
    if abs(alike) < ALIKE:
        return
    if alike < 0.0:
        yield Doubt(channel=name, text="it has the opposite sign of the displacement: turn one of the two")
    elif not 1.0 - OFF < ratio < 1.0 / (1.0 - OFF):
        cause = "a unit is wrong" if name != "velocity" else "a unit, or the sample rate, is wrong"
        text = f"it is {ratio:.4g} times what the displacement shows: {cause}"
        yield Doubt(channel=name, text=text, impossible=not 0.5 < ratio < 2.0)


def _means(values: Floats, steps: int) -> Floats:
    """The mean over each stretch of `steps` intervals, by the trapezoidal rule."""
    total = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
    return np.asarray((total[steps:] - total[:-steps]) / steps)


def _force(force: Floats) -> Iterator[Doubt]:
    peak, span = float(np.max(np.abs(force))), float(np.ptp(force))
    if peak > MOST_FORCE:
        text = f"it reaches {peak:.4g} N, which no machine does: it looks like newtons stored as kilonewtons"
        yield Doubt(channel="force", text=text, impossible=True)
    elif peak > LARGE_FORCE:
        yield Doubt(channel="force", text=f"it reaches {peak:.4g} N: are these newtons stored as kilonewtons?")
    elif 0.0 < span < SMALL_FORCE:
        yield Doubt(channel="force", text=f"it spans {span:.3g} N: are these kilonewtons stored as newtons, or volts?")


def _temperature(temperature: Floats) -> Iterator[Doubt]:
    low, high = float(np.min(temperature)), float(np.max(temperature))
    if low < LEAST_TEMPERATURE:
        yield Doubt(
            channel="temperature",
            text=f"it falls to {low:.4g} degC, below absolute zero: the unit is wrong",
            impossible=True,
        )
    elif high > HOT or low < COLD:
        text = f"it goes from {low:.4g} to {high:.4g} degC: are these kelvin or °F stored as degC, or a broken sensor?"
        yield Doubt(channel="temperature", text=text)
