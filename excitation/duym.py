"""Duym's one-dimensional homogenisation, as published: rank, replace by equidistant values, keep the
phases.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from excitation.coverage import coverage
from excitation.portable_math import angle_turns, cosine_and_sine, uniform

if TYPE_CHECKING:
    from excitation.coverage_cost import Axis
    from excitation.periodic import Multitone

__all__ = ["duym"]

_ITERATIONS = 200
_MOST_ROUNDS_WITHOUT_GAIN = 20  # rounds without a lower index: a fixed point


def duym(
    tones: Sequence[Multitone],
    axes: Sequence[Axis],
    grid: Sequence[int],
    iterations: int | None,
    key: tuple[int, ...] = (0,),
) -> tuple[NDArray[np.float64], ...]:
    """Phases in turns, (K,) for each multitone: the best by coverage index of ``iterations`` rounds.

    Each round and each axis: the samples, in ascending order, are replaced by the equidistant set of the same
    rms (range ±√3·rms), put back in time, and the phases of that signal's DFT are kept with the original
    amplitudes. Axes that share their phases (displacement and velocity) are treated one after the other: the
    kinematic coupling, which the published method leaves out, then acts through the shared phases. The iteration
    ends in a fixed point that depends on the start: remaining rounds start again from other random phases,
    drawn by ``key``.

    References
    ----------
    Duym & Schoukens, Mech. Syst. Signal Process. 9 (1995); restated by Witters & Swevers 2009, section 4.2.
    """
    lines = [t.lines for t in tones]
    samples = tones[0].period_samples
    phasors = [_phasor(t.phase_turns) for t in tones]
    # axes have rms 1/√3
    equidistant = (2.0 * np.arange(1.0, samples + 1.0) - samples - 1.0) / (samples - 1.0)
    best, lowest, stalled = list(phasors), np.inf, 0
    lowest_here = np.inf
    for number in range((iterations or _ITERATIONS) + 1):
        signals = [_signal(axis, phasors[axis.tones], lines[axis.tones], samples) for axis in axes]
        index = coverage(signals, grid).index
        stalled = 0 if index < lowest_here * (1.0 - 1e-3) else stalled + 1
        lowest_here = min(lowest_here, index)
        if index < lowest:
            lowest, best = index, list(phasors)
        if stalled >= _MOST_ROUNDS_WITHOUT_GAIN:
            phasors = [_phasor(uniform((*key, 7, number, n), t.lines.size)) for n, t in enumerate(tones)]
            lowest_here, stalled = np.inf, 0
            continue
        for axis in axes:
            phasors[axis.tones] = _round(axis, phasors[axis.tones], lines[axis.tones], equidistant)
    return tuple(angle_turns(p.real, p.imag) for p in best)


def _round(
    axis: Axis,
    phasor: NDArray[np.complex128],
    lines: NDArray[np.int64],
    equidistant: NDArray[np.float64],
) -> NDArray[np.complex128]:
    """The phasors of the signal whose ordered samples are ``equidistant``; a line without power keeps its
    phase.
    """
    uniform_signal = np.empty_like(equidistant)
    ranks = np.argsort(_signal(axis, phasor, lines, equidistant.size), kind="stable")
    uniform_signal[ranks] = equidistant
    found = _rotated(np.fft.rfft(uniform_signal)[lines], -axis.offset_turns)
    size = np.sqrt(found.real * found.real + found.imag * found.imag)
    size = np.where(size > 0.0, size, 1.0)
    unit = _complex(found.real / size, found.imag / size)
    return np.asarray(np.where((unit.real != 0.0) | (unit.imag != 0.0), unit, phasor))


def _phasor(turns: NDArray[np.float64]) -> NDArray[np.complex128]:
    cos, sin = cosine_and_sine(turns)
    return _complex(cos, sin)


def _complex(real: NDArray[np.float64], imaginary: NDArray[np.float64]) -> NDArray[np.complex128]:
    """A complex array made without complex arithmetic, whose fused products differ between processors."""
    value = np.empty(real.shape, dtype=np.complex128)
    value.real, value.imag = real, imaginary
    return value


def _rotated(phasor: NDArray[np.complex128], turns: float | NDArray[np.float64]) -> NDArray[np.complex128]:
    cos, sin = cosine_and_sine(np.atleast_1d(turns))
    return _complex(phasor.real * cos - phasor.imag * sin, phasor.imag * cos + phasor.real * sin)


def _signal(axis: Axis, phasor: NDArray[np.complex128], lines: NDArray[np.int64], samples: int) -> NDArray[np.float64]:
    spectrum = np.zeros(samples // 2 + 1, dtype=np.complex128)
    turned = _rotated(phasor, axis.offset_turns)
    spectrum.real[lines] = axis.amplitude * turned.real
    spectrum.imag[lines] = axis.amplitude * turned.imag
    return np.fft.irfft(spectrum, n=samples, norm="forward") * 0.5
