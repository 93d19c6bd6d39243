"""Phases that keep the largest of several quantities low, each measured by its limit: the L_p norm of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from excitation.crest import schroeder
from excitation.lbfgs import minimise
from excitation.portable_math import cosine_and_sine, uniform

__all__ = ["Limited", "largest_share", "low_shares"]

_EXPONENTS = (4, 16, 64, 256, 1024)  # powers of two: squares and square roots give the same bits on every processor
_MANY_LINES = 4096  # a highest line above it is sampled more coarsely
_OVERSAMPLING, _OVERSAMPLING_MANY = 32, 8  # samples per period of the highest line: a peak is missed by 0.5 % or 8 %

# Budgets: they save time and decide nothing else. Doubled, crest factors fall by less than 0.01.
_STEPS = 300  # iterations of an exponent
_WORK = 2**26  # samples to be evaluated, of all quantities
_EVALUATIONS = (120, 3000)  # fewest (shared by the quantities) and most

_CANNOT_BIND = 0.2  # of the largest rms share: a smaller one would need five times the other's crest factor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limited:
    """A quantity u[n] = Σ A_k cos(2π(k n/N + φ_k + turns_k)) and what its peak is measured by."""

    amplitude: NDArray[np.float64]  # (K,)
    turns: NDArray[np.float64]  # (K,)
    limit: float

    @property
    def rms_share(self) -> float:
        return float(np.sqrt(0.5 * np.sum(self.amplitude * self.amplitude))) / self.limit


def low_shares(
    lines: NDArray[np.int64],
    quantities: Sequence[Limited],
    *,
    seed: int = 0,
    from_schroeder: bool = True,
    goal: float = 0.0,
    starts: int = 60,
    evaluations: int | None = None,
) -> NDArray[np.float64]:
    """Phases in turns, (K,), of the lowest peak over limit, of the quantity that has the largest one.

    Minimises (Σ_q mean |u_q/limit_q|^p)^(1/p) by phases for p = 4, 16 … 1024, each from the result before, from
    Schroeder's phases of the quantity with the largest rms share (not where ``from_schroeder`` is false: then another
    ``seed`` gives other phases) and from random phases. Ends at ``starts``, at a
    share of ``goal``, or when the budget of evaluations is used up: it grows with neither lines nor quantities, so
    that the time is linear in the highest line.

    References
    ----------
    Guillaume, Schoukens, Pintelon & Kollár, IEEE Trans. Instrum. Meas. 40 (1991): crest factor by L_p norms, also of
    input and output together.
    """
    largest = max(q.rms_share for q in quantities)
    norm = _Norm(lines, [q for q in quantities if q.rms_share > _CANNOT_BIND * largest])
    fewest, most = _EVALUATIONS
    work = norm.samples * len(norm.quantities)
    budget = evaluations or min(most, max(fewest // len(norm.quantities), _WORK // work))
    first = max(quantities, key=lambda q: q.rms_share)
    best = schroeder(first.amplitude) - first.turns if from_schroeder else uniform((seed, 4, 0), lines.size)
    lowest = largest_share(lines, quantities, best)
    for start in range(starts):
        phases = best if start == 0 else uniform((seed, 4, start), lines.size)
        for number, exponent in enumerate(_EXPONENTS):
            left = (budget - norm.evaluations) // (len(_EXPONENTS) - number)
            if left < 1:
                break
            phases = minimise(
                partial(norm, exponent), phases, iterations=min(_STEPS, left), first_step=0.02, tolerance=1e-6
            ).x
        share = largest_share(lines, quantities, phases)
        if share < lowest:
            lowest, best = share, phases
        if lowest <= goal or norm.evaluations >= budget:
            break
    return np.asarray(best - np.floor(best))


def largest_share(lines: NDArray[np.int64], quantities: Sequence[Limited], phase_turns: NDArray[np.float64]) -> float:
    """The largest max abs(u)/limit of the quantities, sought on the fine grid of the search or twice as fine."""
    fine = _Norm(lines, quantities, finer=2)
    return max(float(np.abs(fine.signal(q, phase_turns)[0]).max()) / q.limit for q in quantities)


class _Norm:
    """The L_p norm of the quantities' shares on a fine grid, with its gradient by phases in turns."""

    def __init__(self, lines: NDArray[np.int64], quantities: Sequence[Limited], finer: int = 1) -> None:
        highest = int(lines.max())
        oversampling = _OVERSAMPLING if highest <= _MANY_LINES else _OVERSAMPLING_MANY
        self.samples = finer * 2 ** int(oversampling * highest - 1).bit_length()
        self.lines, self.quantities, self.evaluations = lines, list(quantities), 0

    def signal(
        self, quantity: Limited, turns: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """The samples, (N,), and the real and imaginary parts of the lines, (K,)."""
        cos, sin = cosine_and_sine(turns + quantity.turns)
        spectrum = np.zeros(self.samples // 2 + 1, dtype=np.complex128)
        real, imaginary = quantity.amplitude * cos, quantity.amplitude * sin
        spectrum.real[self.lines] = real
        spectrum.imag[self.lines] = imaginary
        return np.fft.irfft(spectrum, n=self.samples, norm="forward") * 0.5, (real, imaginary)

    def __call__(self, exponent: int, turns: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        self.evaluations += 1
        made = [self.signal(q, turns) for q in self.quantities]
        shares = [signal * (1.0 / q.limit) for (signal, _), q in zip(made, self.quantities, strict=True)]
        peak = max(float(np.abs(share).max()) for share in shares)
        powers = [_power(np.abs(share * (1.0 / peak)), exponent) for share in shares]
        mean = sum(float(power.sum()) for power in powers) / self.samples
        value = mean
        for _ in range(exponent.bit_length() - 1):
            value = float(np.sqrt(value))
        gradient = np.zeros(self.lines.size)
        for share, power, (_, (real, imaginary)), quantity in zip(shares, powers, made, self.quantities, strict=True):
            slope = np.divide(power, share, out=np.zeros_like(power), where=power > 0.0)
            g = np.fft.rfft(slope)[self.lines]
            gradient += (real * g.imag - imaginary * g.real) * (1.0 / quantity.limit)
        # d value/d u = value·power/(share·limit·mean·N), value in units of the peak share
        return value * peak, gradient * (2.0 * np.pi * value * peak / (mean * self.samples))


def _power(values: NDArray[np.float64], exponent: int) -> NDArray[np.float64]:
    for _ in range(exponent.bit_length() - 1):
        values = values * values
    return values
