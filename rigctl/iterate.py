"""The drive-file iteration on a rig: play, compare, correct, repeat."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.atomic import written_whole
from excitation.errors import ExcitationFileError
from excitation.hdf5 import write_hdf5
from excitation.plan import Test
from excitation.signal import JSON, Excitation
from rigctl.drive import (
    IterationSettings,
    Response,
    corrected,
    frequency_response,
    inverse,
    natural_bandwidth_hz,
    relative_error,
)
from rigctl.errors import IterationError, LimitError
from rigctl.runfile import read_run

__all__ = ["Iterated", "Outcome", "Step", "iterate", "write_drive"]

SMALLEST_GAIN = 1 / 32  # of the gain that was asked for: with less there is no useful correction


class Outcome(StrEnum):
    """How an iteration ended."""

    CONVERGED = "converged"
    MOST = "not converged in the iterations allowed"
    LIMITS = "no correction fits the limits"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One run of an iteration; step 0 is the plain command."""

    run: Path
    drive_m: NDArray[np.float64]  # (N,)
    measured_m: NDArray[np.float64]  # (N,)
    error: float  # rms over rms of the target, where the motion is steady
    gain: float  # of the correction of the best step before; 0 for the plain command


@dataclass(frozen=True, slots=True, kw_only=True)
class Iterated:
    """The steps of an iteration and how it ended."""

    target: Excitation
    steps: tuple[Step, ...]
    outcome: Outcome
    settings: IterationSettings
    bandwidth_hz: float
    response: Response

    @property
    def best(self) -> Step:
        return min(self.steps, key=lambda step: step.error)

    @property
    def drive(self) -> Excitation:
        """The drive of the best step, as an excitation whose design states its origin."""
        figures: Mapping[str, JSON] = {
            "iteration_errors": [step.error for step in self.steps],
            "iteration_outcome": str(self.outcome),
            "iteration_bandwidth": self.bandwidth_hz,
        }
        design: Mapping[str, JSON] = {"drive_for": self.target.design}
        return replace(self.target, displacement_m=self.best.drive_m, design=design, figures=figures)


def iterate(
    play: Callable[[Test], str | os.PathLike[str]],
    test: Test,
    *,
    settings: IterationSettings | None = None,
    on_step: Callable[[Step], None] = lambda step: None,
) -> Iterated:
    """Iterate the drive of a test until its measured displacement is the wanted one.

    `play` plays a test and returns its run file (:func:`rigctl.player.play` with everything else filled in). Every
    drive is checked against the limits before it moves anything; one that exceeds them is made again with less gain.

    Raises
    ------
    IterationError
        When the target does not move, or the plain command was stopped.
    RigError
        As `play` does.
    """
    iteration = _Iteration(play, test, settings or IterationSettings(), on_step)
    return iteration.run()


class _Iteration:
    def __init__(
        self,
        play: Callable[[Test], str | os.PathLike[str]],
        test: Test,
        settings: IterationSettings,
        on_step: Callable[[Step], None],
    ) -> None:
        self._play, self._test, self._settings, self._on_step = play, test, settings, on_step
        target = test.excitation
        if np.ptp(target.displacement_m) == 0:
            raise IterationError(f"test {test.name!r}: the displacement is constant, there is nothing to iterate")
        self._target = target.displacement_m
        self._period = target.period_samples if target.samples >= 2 * target.period_samples else 0
        block = self._block(self._target)
        self._bandwidth_hz = settings.bandwidth_hz or natural_bandwidth_hz(block, target.sample_rate_hz)
        self._steps: list[Step] = []

    def run(self) -> Iterated:
        first = self._step(self._target.copy(), 0.0)
        if first is None:
            raise IterationError(
                f"test {self._test.name!r}: stopped in the plain command, before the response was measured"
            )
        rate = self._test.excitation.sample_rate_hz
        response = frequency_response(
            self._block(first.drive_m), self._block(first.measured_m), rate, periodic=bool(self._period)
        )
        outcome = self._improve(inverse(response, self._settings, self._bandwidth_hz))
        return Iterated(
            target=self._test.excitation,
            steps=tuple(self._steps),
            outcome=outcome,
            settings=self._settings,
            bandwidth_hz=self._bandwidth_hz,
            response=response,
        )

    def _improve(self, inverted: NDArray[np.complex128]) -> Outcome:
        gain = self._settings.gain
        while self._best.error > self._settings.tolerance:
            if len(self._steps) > self._settings.most:
                return Outcome.MOST
            if gain < SMALLEST_GAIN * self._settings.gain:
                return Outcome.LIMITS
            before = self._best
            try:
                step = self._step(self._corrected(before, inverted, gain), gain)
            except LimitError:
                gain /= 2  # nothing has moved
                continue
            if step is None:
                return Outcome.STOPPED
            if step.error >= before.error:
                gain /= 2  # again from the best one, with a smaller correction
        return Outcome.CONVERGED

    @property
    def _best(self) -> Step:
        return min(self._steps, key=lambda step: step.error)

    def _step(self, drive_m: NDArray[np.float64], gain: float) -> Step | None:
        """Play a drive; None where the run was stopped."""
        number = len(self._steps)
        excitation = replace(
            self._test.excitation, displacement_m=drive_m, design={"drive_for": self._test.excitation.design}
        )
        name = f"{self._test.name} iteration {number}"
        path = Path(self._play(replace(self._test, name=name, excitation=excitation)))
        run = read_run(path)
        if run.status != "complete":
            return None
        measured, skip = run.channels["displacement"], self._period
        step = Step(
            run=path,
            drive_m=drive_m,
            measured_m=measured,
            error=relative_error(measured[skip:], self._target[skip:]),
            gain=gain,
        )
        self._steps.append(step)
        self._on_step(step)
        return step

    def _corrected(self, before: Step, inverted: NDArray[np.complex128], gain: float) -> NDArray[np.float64]:
        error = self._block(self._target) - self._block(before.measured_m)
        block = corrected(self._block(before.drive_m), error, inverted, gain)
        return np.resize(block, self._target.size)  # repeats it: period after period

    def _block(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the block for the DFT: the mean of the steady periods, or the whole record."""
        if not self._period:
            return values
        whole = values.size // self._period * self._period
        mean: NDArray[np.float64] = values[self._period : whole].reshape(-1, self._period).mean(axis=0)
        return mean


def write_drive(path: Path, iterated: Iterated) -> None:
    """Store the iterated drive as an excitation file, its target beside it in channel ``displacement_target``.

    Raises ExcitationFileError where the place cannot be written.
    """
    with written_whole(path, ExcitationFileError) as temporary:
        write_hdf5(temporary, iterated.drive)
        with h5py.File(temporary, "r+") as file:
            target = file.create_dataset("channels/displacement_target", data=iterated.target.displacement_m)
            target.attrs["unit"] = "m"
            target.attrs["description"] = "the motion that the drive makes"
