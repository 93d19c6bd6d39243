"""What the rounds of an iteration say about the rig: its response, the error of every drive, and what repeats. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigctl.blocks import Blocks
from rigctl.repeatability import ErrorState, History, after_round, first_round, noise_above, noise_of_periods
from rigctl.response import Evidence, Response, forget, learn, measure, response

__all__ = ["Estimate", "Records"]


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """One round, (N, C) each, relative channels."""

    drive: NDArray[np.float64]
    measured: NDArray[np.float64]
    error: NDArray[np.float64]  # wanted − measured


class Estimate:
    """Estimates that every round improves: :meth:`add` takes one after the other."""

    def __init__(self, blocks: Blocks, bandwidth_hz: NDArray[np.float64]) -> None:
        self._blocks, self._bandwidth_hz = blocks, bandwidth_hz
        self._records: list[Records] = []
        self._noises: list[NDArray[np.float64]] = []  # (K, C) of each round: variance of a block's spectra
        self._evidence: Evidence | None = None
        self._drifted: list[float] = []  # of each round: mean square over the channels since then
        self.errors: list[ErrorState] = []  # of each round's drive
        self.history = History()

    @property
    def response(self) -> Response:
        assert self._evidence is not None, "no round yet"
        return response(self._blocks.lines, self._evidence)

    @property
    def drifts(self) -> tuple[float, ...]:
        """Rms by which the channels have changed since each round, beyond what the steps explain."""
        return tuple(float(np.sqrt(value)) for value in self._drifted)

    def removable(self, base: int, drive: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean square of a drive's error that another one, (N, C), is to remove, (C,)."""
        error = self.errors[base].error
        before, after = (self._blocks.record(one) for one in (error, error - self._effect(base, drive)))
        removed: NDArray[np.float64] = np.mean(before**2 - after**2, axis=0)
        return removed

    def add(self, records: Records, base: int | None) -> None:
        """Learn from a round whose drive was made from that of round `base`; None for the first round."""
        self._noises.append(self._noise(records))
        self.history.noise.append(self._blocks.mean_square(self._noises[-1]) * self._averaged)
        noise = np.asarray(np.mean(self._noises, axis=0), dtype=np.float64)
        measured = self._blocks.spectra(records.error)
        if base is None:
            drive, answer = (self._blocks.tapered(values) for values in (records.drive, records.measured))
            self._evidence = measure(self._blocks.lines, drive, answer)
            self.errors.append(first_round(self._blocks.lines, measured, noise))
        else:
            drifted = self._learned(records, base, noise)
            effect = self._effect(base, records.drive)
            self.errors.append(after_round(self.errors[base], effect, measured, noise, drifted))
            unexplained = self._blocks.mean_square(drifted)
            self.history.add(unexplained, self._blocks.mean_square(np.abs(effect) ** 2))
            self._drifted = [value + float(np.mean(unexplained)) for value in self._drifted]
        self._records.append(records)
        self._drifted.append(0.0)

    def _learned(self, records: Records, base: int, noise: NDArray[np.float64]) -> NDArray[np.float64]:
        """Improve the response by a round; return the power of what its step does not explain, (K, C)."""
        assert self._evidence is not None
        lines, before = self._blocks.lines, self._records[base]
        step = self._blocks.tapered(records.drive - before.drive)
        change = self._blocks.tapered(records.measured - before.measured)
        power = np.maximum(lines.power(_left(self.response, step, change)), 2 * noise)
        evidence = learn(self._evidence, lines, step, change, power)
        left = lines.power(_left(response(lines, evidence), step, change))
        count = lines.count[:, None]
        left *= count / np.maximum(count - step.shape[1], 0.5)  # the degrees of freedom that the response took
        drifted = np.maximum(left - 2 * noise, 0.0)
        self._evidence = forget(evidence, drifted)
        return drifted

    def _effect(self, base: int, drive: NDArray[np.float64]) -> NDArray[np.complex128]:
        """What the response says that a drive changes, from that of round `base`, (K, C)."""
        step = self._blocks.spectra(drive - self._records[base].drive)
        effect: NDArray[np.complex128] = np.einsum("kic,kc->ki", self.response.gain, step)
        return effect

    def _noise(self, records: Records) -> NDArray[np.float64]:
        """Variance of the block's spectra by noise, (K, C)."""
        blocks = self._blocks
        if blocks.period and (periods := blocks.periods(records.measured)).shape[0] > 1:
            return noise_of_periods(blocks.lines, np.fft.rfft(periods, axis=1) / blocks.padded)
        return noise_above(blocks.lines, blocks.tapered(records.measured), self._bandwidth_hz)

    @property
    def _averaged(self) -> int:
        """Periods in a block's mean: the noise of a record is so much larger."""
        return self._blocks.samples // self._blocks.period - 1 if self._blocks.period else 1


def _left(found: Response, step: NDArray[np.complex128], change: NDArray[np.complex128]) -> NDArray[np.complex128]:
    left: NDArray[np.complex128] = change - np.einsum("kic,kc->ki", found.gain, step)
    return left
