"""An iteration ends for a reason, keeps the drive that is best now, and follows a specimen that changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.drive import IterationSettings
from rigctl.errors import NotFollowing
from rigctl.iterate import Iterated, Outcome, iterate
from rigctl.limits import Limits
from rigctl.runfile import Run, write_run

RATE = 1000.0
N = 1024
F = np.fft.rfftfreq(N, 1 / RATE)


def a_target(seed: int = 1, periods: int = 4) -> Excitation:
    """Motion to 40 Hz and current to 80 Hz, both of many lines."""
    random = np.random.default_rng(seed)

    def multisine(top_hz: float) -> np.ndarray:
        spectrum = np.where((F > 0) & (top_hz > F), np.exp(2j * np.pi * random.uniform(size=F.size)), 0)
        x = np.fft.irfft(spectrum, n=N)
        return np.tile(x / np.max(np.abs(x)), periods)

    return Excitation(
        kind=Kind.MULTISINE,
        sample_rate_hz=RATE,
        period_samples=N,
        displacement_m=0.02 * multisine(40.0),
        current_a=1.0 + 0.5 * multisine(80.0),
    )


@dataclass
class LinearRig:
    """Answers with a delay and a lag, a change of the specimen between rounds, and noise; `play` keeps a run file."""

    folder: Path
    noise: float = 0.0  # of the range of a channel
    change: Callable[[int], float] = lambda number: 0.0  # added to the gain of the motion in round k, per 10 Hz
    sign: Callable[[int], float] = lambda number: 1.0
    played: list[Excitation] = field(default_factory=list)

    def play(self, test: Test) -> Path:
        number, x = len(self.played), test.excitation
        self.played.append(x)
        answer = np.exp(-2j * np.pi * F * 0.004) / (1 + 1j * F / 60.0) * (1 + self.change(number) * F / 10.0)
        random = np.random.default_rng(number)
        channels = {
            "displacement": self._answer(x.displacement_m, self.sign(number) * answer, 0.02, random),
            "current": self._answer(x.current_a, 1 / (1 + 1j * F / 300.0), 0.5, random),
        }
        run = Run(
            run_id=str(number),
            created="2026-01-01T00:00:00+00:00",
            specimen="",
            sample_rate_hz=RATE,
            period_samples=N,
            excitation_kind="multisine",
            status="complete",
            channels=channels,
            units={"displacement": "m", "current": "A"},
            rig="a linear rig at nowhere",
        )
        path = self.folder / f"{number}.h5"
        write_run(path, run)
        return path

    def _answer(
        self, x: np.ndarray | None, answer: np.ndarray, scale: float, random: np.random.Generator
    ) -> np.ndarray:
        assert x is not None
        y = np.fft.irfft(np.fft.rfft(x.reshape(-1, N)) * answer, n=N).ravel()
        return y + self.noise * scale * random.standard_normal(y.size)


def iterated(rig: LinearRig, seed: int = 1, limits: Limits | None = None, **more: float) -> Iterated:
    test = Test(name="wanted", excitation=a_target(seed))
    return iterate(rig.play, test, settings=IterationSettings(**more), limits=limits)  # type: ignore[arg-type]


@settings(max_examples=15)
@given(st.integers(0, 99), st.floats(1e-4, 3e-2))
def test_it_ends_where_the_error_that_is_left_is_noise(
    tmp_path_factory: pytest.TempPathFactory, seed: int, noise: float
) -> None:
    found = iterated(LinearRig(tmp_path_factory.mktemp("noisy"), noise=noise), seed, tolerance=1e-9)
    assert found.outcome is Outcome.NO_GAIN
    for error, repeated in zip(found.best.errors, found.repeatability, strict=True):
        assert error < 1.6 * repeated
    floor = noise * 0.02 / np.std(found.target.displacement_m)
    assert floor == pytest.approx(found.repeatability[0], rel=0.3)


@settings(max_examples=15)
@given(st.integers(0, 99), st.floats(0.02, 0.1), st.integers(1, 2))
def test_a_specimen_that_changes_once_is_followed_and_its_old_drive_is_not_the_one_that_is_kept(
    tmp_path_factory: pytest.TempPathFactory, seed: int, change: float, at: int
) -> None:
    rig = LinearRig(
        tmp_path_factory.mktemp("changed"), noise=3e-4, change=lambda number: change if number >= at else 0.0
    )
    found = iterated(rig, seed, tolerance=4e-3, gain=0.7 if at == 2 else 1.0)
    if found.outcome is not Outcome.CONVERGED:  # a change just seen may make the next round seem not to pay
        assert found.outcome is Outcome.NO_GAIN
        assert max(found.best.errors) < 2 * max(found.repeatability) < 0.1 * change
    assert found.best is found.steps[-1]
    assert found.drifts[0] > 0.5 * change, "the change is seen as one"
    assert len(found.steps) <= 6


def test_a_specimen_that_changes_all_the_time_ends_the_iteration_at_what_the_rounds_differ_by(tmp_path: Path) -> None:
    rig = LinearRig(tmp_path, noise=1e-4, change=lambda number: 0.02 * number)
    found = iterated(rig, tolerance=1e-6, most=12)
    assert found.outcome is Outcome.NO_GAIN
    assert found.best is found.steps[-1]
    assert found.best.errors[0] < 2 * found.repeatability[0]
    assert found.repeatability[0] > 0.01, "what drifts is counted"


def test_a_specimen_that_changes_faster_than_it_is_followed_ends_it_after_two_worse_rounds(tmp_path: Path) -> None:
    rig = LinearRig(tmp_path, noise=1e-4, change=lambda number: (0.0, 0.0, 0.05, 0.3)[number])
    found = iterated(rig, tolerance=1e-9)
    assert found.outcome is Outcome.DIVERGED
    assert len(found.steps) == 4
    assert found.steps[1].error < found.steps[2].error < found.steps[3].error


@settings(max_examples=10)
@given(st.integers(0, 99), st.floats(1.2, 1.5))
def test_the_current_of_every_drive_is_within_its_limits(
    tmp_path_factory: pytest.TempPathFactory, seed: int, most_a: float
) -> None:
    rig, limits = LinearRig(tmp_path_factory.mktemp("limited")), Limits(current_max_a=most_a)
    iterated(rig, seed, limits=limits)
    drives = [one.current_a for one in rig.played[1:]]
    assert drives
    assert all(drive is not None and drive.min() >= 0 and drive.max() <= most_a for drive in drives)


@settings(max_examples=10)
@given(st.integers(0, 99), st.floats(0.3, 1.0))
def test_a_round_removes_what_was_expected_of_it(
    tmp_path_factory: pytest.TempPathFactory, seed: int, gain: float
) -> None:
    found = iterated(LinearRig(tmp_path_factory.mktemp("expected"), noise=1e-4), seed, gain=gain, most=1)
    first, second = found.steps
    assert second.expected is not None
    np.testing.assert_allclose(second.errors, second.expected, rtol=0, atol=0.06 * max(first.errors))


def test_the_motion_alone_leaves_the_current_as_commanded(tmp_path: Path) -> None:
    rig = LinearRig(tmp_path)
    found = iterate(rig.play, Test(name="m", excitation=a_target()), settings=IterationSettings(motion_only=True))
    assert found.outcome is Outcome.CONVERGED
    assert found.channels == ("displacement",)
    for one in rig.played:
        np.testing.assert_array_equal(one.current_a, a_target().current_a)


def test_a_rig_that_stops_following_ends_it_at_once_and_the_best_drive_is_that_of_the_sound_rig(tmp_path: Path) -> None:
    rig = LinearRig(tmp_path, noise=1e-4, sign=lambda number: 1.0 if number < 2 else -6.0)
    found = iterated(rig, tolerance=1e-9, gain=0.7)
    assert found.outcome is Outcome.RUNAWAY
    assert len(rig.played) == 3
    assert found.best is found.steps[1]


def test_a_channel_that_is_measured_with_the_wrong_sign_is_not_iterated(tmp_path: Path) -> None:
    rig = LinearRig(tmp_path, sign=lambda number: -1.0)
    with pytest.raises(NotFollowing, match=r"measured displacement differs .* check sign, scale and zero"):
        iterated(rig)
    assert len(rig.played) == 1
