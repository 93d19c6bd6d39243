"""Duym's one-dimensional homogenisation, as published: rank, replace by equidistant values, keep the
phases.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from excitation.coverage import coverage
from excitation.turns import cosine_and_sine, turns_of

if TYPE_CHECKING:
    from excitation.direct import Axis
    from excitation.periodic import Multitone

__all__ = ["duym"]

_ITERATIONS = 100


def duym(
    tones: Sequence[Multitone], axes: Sequence[Axis], grid: Sequence[int], iterations: int | None
) -> tuple[NDArray[np.float64], ...]:
    """Phases in turns, (K,) for each multitone: the best by coverage index of ``iterations`` rounds.

    Each round and each axis: the samples, in ascending order, are replaced by the equidistant set of the same
    rms (range ±√3·rms), put back in time, and the phases of that signal's DFT are kept with the original
    amplitudes. Axes that share their phases (displacement and velocity) take turns: the kinematic coupling,
    which the published method leaves out, then acts through the shared phases.

    References
    ----------
    Duym & Schoukens, Mech. Syst. Signal Process. 9 (1995); restated by Witters & Swevers 2009, section 4.2,
    steps 1-8.
    """
    lines = [t.lines for t in tones]
    samples = tones[0].period_samples
    phasors = [_phasor(t.phase_turns) for t in tones]
    equidistant = np.sqrt(3.0) * (2.0 * np.arange(1, samples + 1) - samples - 1.0) / (samples - 1.0)
    best = (np.inf, phasors)
    for _ in range((iterations or _ITERATIONS) + 1):
        signals = [_signal(axis, phasors[axis.tones], lines[axis.tones], samples) for axis in axes]
        index = coverage(signals, grid).index
        if index < best[0]:
            best = (index, list(phasors))
        for axis in axes:
            signal = _signal(axis, phasors[axis.tones], lines[axis.tones], samples)
            uniform = np.empty(samples)
            uniform[np.argsort(signal, kind="stable")] = equidistant
            found = np.fft.rfft(uniform)[lines[axis.tones]] * np.conj(_phasor(np.array([axis.offset_turns])))
            size = np.sqrt(found.real * found.real + found.imag * found.imag)
            phasors[axis.tones] = np.where(size > 0.0, found / np.maximum(size, 1e-300), phasors[axis.tones])
    return tuple(_turns(p) for p in best[1])


def _phasor(turns: NDArray[np.float64]) -> NDArray[np.complex128]:
    cos, sin = cosine_and_sine(turns)
    return np.asarray(cos + 1j * sin)


def _turns(phasor: NDArray[np.complex128]) -> NDArray[np.float64]:
    return turns_of(phasor.real, phasor.imag)


def _signal(axis: Axis, phasor: NDArray[np.complex128], lines: NDArray[np.int64], samples: int) -> NDArray[np.float64]:
    spectrum = np.zeros(samples // 2 + 1, dtype=np.complex128)
    spectrum[lines] = axis.amplitude * phasor * _phasor(np.array([axis.offset_turns]))
    return np.fft.irfft(spectrum, n=samples, norm="forward") * 0.5
