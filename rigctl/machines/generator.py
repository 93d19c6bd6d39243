"""The numbers of a function generator for a test, and the motion that it will make of them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from excitation.signal import Excitation
from rigctl.errors import LimitError
from rigctl.waveform import Waveform

FIT = 2e-3  # of the amplitude: a test whose samples depart further from the shape is refused; sampling itself gives 0


class Shape(StrEnum):
    """Shapes that function generators offer."""

    SINE = "sine"
    TRIANGLE = "triangle"


@dataclass(frozen=True, slots=True, kw_only=True)
class Numbers:
    """What a function generator is told."""

    shape: Shape
    amplitude_m: float
    frequency_hz: float
    cycles: int
    current_a: float


def numbers_of(excitation: Excitation) -> Numbers:
    """Numbers by which a generator makes this excitation.

    Raises
    ------
    LimitError
        Where it is no sine or triangle of whole cycles that begins at zero and rises, at a constant current.
    """
    x, period = excitation.displacement_m, excitation.period_samples
    if str(excitation.kind) not in tuple(Shape) or not period:
        raise LimitError(f"kind is {excitation.kind}: a function generator plays whole cycles of a sine or a triangle")
    in_a_period = max(
        1, int(np.argmax(np.abs(np.fft.rfft(x[:period]))))
    )  # cycles, where one alone has no whole samples
    cycles, more = divmod(excitation.samples * in_a_period, period)
    if more >= in_a_period:  # more than the part of a sample that ends the last cycle
        raise LimitError(
            f"{excitation.samples} samples are no whole number of cycles of {period / in_a_period:.6g}: "
            "a generator plays whole ones"
        )
    current = np.zeros_like(x) if excitation.current_a is None else excitation.current_a
    if np.ptp(current) > 0:
        raise LimitError("the current varies: a function generator holds it, split the test into one for each current")
    shape = Shape(excitation.kind)
    unit = unit_wave(shape, np.arange(excitation.samples) * in_a_period / period)
    amplitude = float(unit @ x / (unit @ unit))
    worst = float(np.max(np.abs(x - amplitude * unit)))
    if amplitude <= 0 or worst > FIT * amplitude:
        raise LimitError(
            f"the samples depart by {worst:.3g} m from a {shape} of {amplitude:.6g} m that begins at zero and rises: "
            "a function generator cannot play it"
        )
    return Numbers(
        shape=shape,
        amplitude_m=amplitude,
        frequency_hz=in_a_period * excitation.sample_rate_hz / period,
        cycles=cycles,
        current_a=float(current[0]),
    )


def unit_wave(shape: Shape, cycles: NDArray[np.float64]) -> NDArray[np.float64]:
    """One of the shapes at an amplitude of 1, from zero upwards."""
    if shape is Shape.SINE:
        sine: NDArray[np.float64] = np.sin(2 * np.pi * cycles)
        return sine
    phase = (cycles + 0.25) % 1.0
    triangle: NDArray[np.float64] = 1.0 - 4.0 * np.abs(phase - 0.5)
    return triangle


def generated(numbers: Numbers, rate_hz: float, ramp_cycles: int) -> Waveform:
    """The motion of a generator whose amplitude grows and falls linearly in time over whole cycles."""
    period = rate_hz / numbers.frequency_hz
    lead, body = round(ramp_cycles * period), round(numbers.cycles * period)
    k = np.arange(2 * lead + body)
    growth = np.clip(np.minimum(k / lead, (k.size - k) / lead), 0.0, 1.0)
    x = numbers.amplitude_m * growth * unit_wave(numbers.shape, k / period)
    return Waveform(displacement_m=x, current_a=np.full(x.size, numbers.current_a), lead=lead, samples=body, start=0)
