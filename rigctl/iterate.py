"""The drive-file iteration on a rig: play, compare, correct, repeat."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from excitation.plan import Test
from excitation.signal import JSON, Excitation
from rigctl.blocks import Blocks, blocks_of
from rigctl.drive import IterationSettings, correction, natural_bandwidth_hz, relative_error, roll_off
from rigctl.errors import IterationError, LimitError, NotFollowing
from rigctl.estimate import Estimate, Records
from rigctl.limits import Limits
from rigctl.response import Response
from rigctl.runfile import Run, read_run

__all__ = ["Channel", "Iterated", "Outcome", "Step", "iterate"]

SMALLEST_GAIN = 1 / 32  # of the gain that was asked for: with less there is no useful correction
# Error of round 0 above which nothing is corrected. A channel that lags its command by 60° everywhere has an error of
# 1, one that is measured with the wrong sign 2: at 1 a fast target would be refused, at 3 a wrong sign be played.
MOST_ERROR = 1.5
# A round that is so many times worse than round 0, and worse than that share of the target, ends the iteration at once:
# a changed specimen makes less, a jammed valve or a loose sensor makes 0.5 … 1. At half a stiffer specimen is refused,
# at double a jammed valve is played against for another round.
RUNAWAY_TIMES = 3.0
RUNAWAY_SHARE = 0.3
WORSE_IN_A_ROW = 2  # rounds: one may be a specimen that changed once; the second had half the gain or a new estimate


class Channel(StrEnum):
    """A channel that the rig drives and measures."""

    MOTION = "displacement"
    CURRENT = "current"


OTHERWISE = {Channel.MOTION: "", Channel.CURRENT: ", or iterate the motion only"}


class Outcome(StrEnum):
    """How an iteration ended."""

    UNFINISHED = "unfinished"
    CONVERGED = "converged"
    MOST = "not converged in the iterations allowed"
    NO_GAIN = "not converged: a further round would gain less than rounds of one drive differ by"
    DIVERGED = "diverged: two rounds in a row made the error larger"
    RUNAWAY = "the rig no longer follows: the error is several times that of round 0"
    LIMITS = "no correction fits the limits"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """One round of an iteration; round 0 plays the plain command, or a stored drive."""

    run: Path
    drive: NDArray[np.float64]  # (N, C): m and A
    measured: NDArray[np.float64]  # (N, C)
    errors: tuple[float, ...]  # of each channel: rms over rms of the target, where the motion is steady
    expected: tuple[float, ...] | None  # the errors that its correction was to leave; None for round 0
    gain: float  # of its correction; 0 for round 0

    @property
    def error(self) -> float:
        """Root mean square of the channels' errors."""
        return float(np.sqrt(np.mean(np.square(self.errors))))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Iterated:
    """The rounds of an iteration and how it ended."""

    target: Excitation
    channels: tuple[Channel, ...]
    steps: tuple[Step, ...]
    drifts: tuple[float, ...]  # of each step: rms by which the channels have changed since, beyond what steps explain
    outcome: Outcome
    settings: IterationSettings
    bandwidth_hz: tuple[float, ...]
    repeatability: tuple[float, ...]  # of each channel, relative: rms by which two rounds of one drive differ
    response: Response
    rig: str  # vendor, model and serial

    @property
    def best(self) -> Step:
        """The step whose drive is expected to make the smallest error now, on a rig that still follows."""
        drifts = (0.0,) * len(self.steps) if self.outcome is Outcome.RUNAWAY else self.drifts
        return self.steps[_least(self.steps, drifts)]

    @property
    def drive(self) -> Excitation:
        """The drive of the best step, as an excitation whose design states its origin."""
        figures: Mapping[str, JSON] = {
            "iteration_channels": [str(channel) for channel in self.channels],
            "iteration_errors": [list(step.errors) for step in self.steps],
            "iteration_outcome": str(self.outcome),
            "iteration_bandwidth": list(self.bandwidth_hz),
            "iteration_repeatability": list(self.repeatability),
            "iteration_rig": self.rig,
        }
        design: Mapping[str, JSON] = {"drive_for": self.target.design}
        return replace(_played(self.target, self.channels, self.best.drive), design=design, figures=figures)

    def within(self, step: Step) -> bool:
        """Whether every channel of a step is within the tolerance."""
        return max(step.errors) <= self.settings.tolerance


def iterate(
    play: Callable[[Test], str | os.PathLike[str]],
    test: Test,
    *,
    settings: IterationSettings | None = None,
    start: Excitation | None = None,
    limits: Limits | None = None,
    on_step: Callable[[Iterated], None] = lambda so_far: None,
) -> Iterated:
    """Iterate the drive of a test until what is measured is what is wanted, in motion and current.

    A channel whose target is constant is played as it is. Every drive is checked against the limits before it moves
    anything; one that exceeds them is made again with less gain.

    Parameters
    ----------
    play : plays a test and returns its run file (:func:`rigctl.player.play` with everything else filled in)
    start : the drive of round 0, for example a stored one; default: the plain command
    limits : of the machine; the current's correction is cut off there, where a target may lie on the limit
    on_step : told after every round, with all rounds until then

    Raises
    ------
    IterationError
        When the target does not move, the stored drive is of another size, or round 0 was stopped.
    NotFollowing
        When a channel hardly follows its command in round 0.
    RigError
        As `play` does; what `on_step` was told last is the state until then.
    """
    return _Iteration(play, test, settings or IterationSettings(), start, limits, on_step).run()


class _Iteration:
    def __init__(
        self,
        play: Callable[[Test], str | os.PathLike[str]],
        test: Test,
        settings: IterationSettings,
        start: Excitation | None,
        limits: Limits | None,
        on_step: Callable[[Iterated], None],
    ) -> None:
        self._play, self._test, self._settings, self._on_step = play, test, settings, on_step
        excitation = test.excitation
        self._channels = moving_channels(excitation, motion_only=settings.motion_only)
        if not self._channels:
            raise IterationError(f"test {test.name!r}: the target is constant, there is nothing to iterate")
        if test.before:
            raise IterationError(
                f"test {test.name!r} has steps before it, which an iteration does not do: take them out"
            )
        self._target = _values(excitation, self._channels)
        self._start = self._target if start is None else _values(start, self._channels)
        if self._start.shape != self._target.shape:
            raise IterationError(f"test {test.name!r}: the drive to start from is of another size than the target")
        self._scale = self._target.std(axis=0)
        self._limits = limits
        count = len(self._channels)
        rate = excitation.sample_rate_hz
        self._blocks: Blocks = blocks_of(excitation.samples, excitation.period_samples, rate, count)
        band = [
            settings.bandwidth_hz or natural_bandwidth_hz(column, rate) for column in self._blocks.block(self._target).T
        ]
        self._bandwidth_hz = np.array(band)
        self._roll = roll_off(self._blocks.lines.frequency_hz, self._bandwidth_hz)
        self._estimate = Estimate(self._blocks, self._bandwidth_hz)
        self._steps: list[Step] = []
        self._rig = ""

    def run(self) -> Iterated:
        if self._round(self._start.copy(), 0.0, None) is None:
            raise IterationError(f"test {self._test.name!r}: stopped in round 0, before the response was measured")
        for channel, error in zip(self._channels, self._steps[0].errors, strict=True):
            if error > MOST_ERROR:
                raise NotFollowing(
                    f"test {self._test.name!r}: in round 0 the measured {channel} differs from its target by "
                    f"{100 * error:.0f} % rms: check sign, scale and zero of its sensor{OTHERWISE[channel]}"
                )
        return self._so_far(self._improve())

    def _improve(self) -> Outcome:
        gain, worse = self._settings.gain, 0
        while True:
            base = self._base
            before = self._steps[base]
            if max(before.errors) <= self._settings.tolerance:
                return Outcome.CONVERGED
            if len(self._steps) > self._settings.most:
                return Outcome.MOST
            if gain < SMALLEST_GAIN * self._settings.gain:
                return Outcome.LIMITS
            drive = self._corrected(base, gain)
            if not self._pays(base, drive):
                return Outcome.NO_GAIN
            try:
                step = self._round(drive, gain, base)
            except LimitError:
                gain /= 2  # nothing has moved
                continue
            if step is None:
                return Outcome.STOPPED
            if self._ran_away(step):
                return Outcome.RUNAWAY
            worse = worse + 1 if self._is_worse(step, self._steps[-2]) else 0
            if worse == WORSE_IN_A_ROW:
                return Outcome.DIVERGED
            if self._base != len(self._steps) - 1:
                gain /= 2  # again from the better one, with a smaller correction

    @property
    def _base(self) -> int:
        return _least(tuple(self._steps), self._estimate.drifts)

    def _is_worse(self, step: Step, before: Step) -> bool:
        """Whether an error is larger by more than the noise of the records."""
        noise = float(np.mean(self._estimate.history.noise[-1]))
        return step.error**2 > before.error**2 + noise

    def _ran_away(self, step: Step) -> bool:
        first = self._steps[0]
        pairs = zip(step.errors, first.errors, strict=True)
        return any(error > max(RUNAWAY_TIMES * before, RUNAWAY_SHARE) for error, before in pairs)

    def _pays(self, base: int, drive: NDArray[np.float64]) -> bool:
        """Whether a channel that is not within the tolerance gains more than rounds of one drive differ by."""
        removable = self._estimate.removable(base, self._relative(drive))
        return any(
            error > self._settings.tolerance and self._estimate.history.pays(channel, float(removable[channel]))
            for channel, error in enumerate(self._steps[base].errors)
        )

    def _round(self, drive: NDArray[np.float64], gain: float, base: int | None) -> Step | None:
        """Play a drive; None where the run was stopped."""
        excitation = replace(
            _played(self._test.excitation, self._channels, drive), design={"drive_for": self._test.excitation.design}
        )
        expected = None if base is None else self._expected(base, drive)
        name = f"{self._test.name} iteration {len(self._steps)}"
        path = Path(self._play(replace(self._test, name=name, excitation=excitation)))
        run = read_run(path)
        if run.status != "complete":
            return None
        measured = self._measured(run)
        steady = self._blocks.steady
        pairs = zip(measured[steady].T, self._target[steady].T, strict=True)
        self._rig = run.rig.split(" at ")[0]
        step = Step(
            run=path,
            drive=drive,
            measured=measured,
            errors=tuple(relative_error(one, wanted) for one, wanted in pairs),
            expected=expected,
            gain=gain,
        )
        self._steps.append(step)
        records = Records(*(self._relative(values) for values in (drive, measured, self._target - measured)))
        self._estimate.add(records, base)
        self._on_step(self._so_far(Outcome.UNFINISHED))
        return step

    def _measured(self, run: Run) -> NDArray[np.float64]:
        missing = [channel for channel in self._channels if channel not in run.channels]
        if missing:
            raise IterationError(f"{run.path}: the rig measures no {missing[0]}: there is nothing to iterate it with")
        return np.stack([run.channels[channel] for channel in self._channels], axis=1)

    def _expected(self, base: int, drive: NDArray[np.float64]) -> tuple[float, ...]:
        removable = self._estimate.removable(base, self._relative(drive))
        left = np.square(self._steps[base].errors) - removable
        return tuple(float(value) for value in np.sqrt(np.maximum(left, 0.0)))

    def _corrected(self, base: int, gain: float) -> NDArray[np.float64]:
        """The drive of a step and a share of its correction; the current within its limits."""
        error = self._estimate.errors[base].error
        step = correction(self._estimate.response, error, self._settings.regularisation, self._roll)
        drive: NDArray[np.float64] = self._steps[base].drive + gain * self._blocks.record(step) * self._scale
        if self._limits is not None and Channel.CURRENT in self._channels:
            column = drive[:, self._channels.index(Channel.CURRENT)]
            np.clip(column, self._limits.current_min_a, self._limits.current_max_a, out=column)
        return drive

    def _relative(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(values / self._scale, dtype=np.float64)

    def _so_far(self, outcome: Outcome) -> Iterated:
        history, count = self._estimate.history, len(self._channels)
        return Iterated(
            target=self._test.excitation,
            channels=self._channels,
            steps=tuple(self._steps),
            drifts=self._estimate.drifts,
            outcome=outcome,
            settings=self._settings,
            bandwidth_hz=tuple(float(value) for value in self._bandwidth_hz),
            repeatability=tuple(float(np.sqrt(history.repeatability(channel))) for channel in range(count)),
            response=self._estimate.response,
            rig=self._rig,
        )


def moving_channels(excitation: Excitation, *, motion_only: bool = False) -> tuple[Channel, ...]:
    """Channels whose target is not constant."""
    found = [Channel.MOTION] if np.ptp(excitation.displacement_m) > 0 else []
    if not motion_only and excitation.current_a is not None and np.ptp(excitation.current_a) > 0:
        found.append(Channel.CURRENT)
    return tuple(found)


def _values(excitation: Excitation, channels: tuple[Channel, ...]) -> NDArray[np.float64]:
    """Set-points of the channels, (N, C)."""
    columns = {Channel.MOTION: excitation.displacement_m, Channel.CURRENT: excitation.current_a}
    found = [values for channel in channels if (values := columns[channel]) is not None]
    if len(found) < len(channels):
        raise IterationError("the drive to start from has no current, and the target has one")
    return np.stack(found, axis=1)


def _played(excitation: Excitation, channels: tuple[Channel, ...], drive: NDArray[np.float64]) -> Excitation:
    """The excitation with the channels replaced by a drive."""
    motion, current = excitation.displacement_m, excitation.current_a
    for column, channel in zip(drive.T, channels, strict=True):
        if channel is Channel.MOTION:
            motion = column
        else:
            current = column
    return replace(excitation, displacement_m=motion, current_a=current)


def _least(steps: tuple[Step, ...], drifts: tuple[float, ...]) -> int:
    """Number of the step with the smallest error expected now: what was measured, and what has drifted since."""
    expected = [step.error**2 + drift**2 for step, drift in zip(steps, drifts, strict=True)]
    return len(expected) - 1 - int(np.argmin(expected[::-1]))
