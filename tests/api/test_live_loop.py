"""The points of a running test: even, without gaps, with a velocity that a person can trust."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from api.campaigns.live_loop import LiveLoop, LoopPoints
from rigctl.progress import joined
from rigctl.transport import CaptureBlock

RATE_HZ = 1000.0
SAMPLES = 2000


def sine(frequency_hz: float, rate_hz: float = RATE_HZ) -> tuple[np.ndarray, np.ndarray]:
    phase = 2 * np.pi * frequency_hz * np.arange(SAMPLES) / rate_hz
    return 0.01 * np.sin(phase), 100.0 * np.cos(phase)


def points_of(cuts: list[int], frequency_hz: float = 4.0, rate_hz: float = RATE_HZ) -> list[LoopPoints]:
    x, force = sine(frequency_hz, rate_hz)
    loop, ends = LiveLoop(rate_hz=rate_hz), [0, *sorted(cuts), SAMPLES]
    made = (loop.take(a, x[a:b], force[a:b]) for a, b in pairwise(ends))
    return [points for points in made if points is not None]


@given(cuts=st.lists(st.integers(0, SAMPLES), max_size=30))
def test_however_the_samples_come_the_points_are_the_same(cuts: list[int]) -> None:
    [whole], found = points_of([]), points_of(cuts)
    assert [x for points in found for x in points.displacement_m] == list(whole.displacement_m)
    assert [v for points in found for v in points.velocity_m_s] == pytest.approx(list(whole.velocity_m_s), abs=1e-12)
    assert all(after.first == before.next for before, after in pairwise(found))


@pytest.mark.parametrize(("rate_hz", "step"), [(100.0, 1), (500.0, 1), (1000.0, 2), (4000.0, 8)])
def test_there_are_at_most_five_hundred_points_a_second(rate_hz: float, step: int) -> None:
    [points] = points_of([], frequency_hz=1.0, rate_hz=rate_hz)
    assert points.step == step
    assert rate_hz / points.step <= 500.0


def test_the_velocity_of_25_hz_is_too_small_by_as_much_as_derived() -> None:
    [points] = points_of([], frequency_hz=25.0)
    numbers = points.first + points.step * np.arange(len(points.velocity_m_s))
    truth = 0.01 * 2 * np.pi * 25.0 * np.cos(2 * np.pi * 25.0 * numbers / RATE_HZ)
    too_small = 1 - np.array(points.velocity_m_s) @ truth / (truth @ truth)
    assert too_small == pytest.approx((2 * np.pi * 25.0 / RATE_HZ) ** 2 * 17 / 30, rel=0.02)
    assert too_small < 0.015


def test_the_velocity_of_a_noisy_displacement_is_as_noisy_as_derived() -> None:
    noise = 2e-6 * np.random.default_rng(1).standard_normal(20000)
    points = LiveLoop(rate_hz=RATE_HZ).take(0, noise, noise)
    assert points is not None
    assert np.std(points.velocity_m_s) == pytest.approx(2e-6 * RATE_HZ / np.sqrt(10), rel=0.05)


def test_samples_that_are_missing_are_seen_by_their_numbers() -> None:
    x, force = sine(4.0)
    loop = LiveLoop(rate_hz=RATE_HZ)
    before, after = loop.take(0, x[:500], force[:500]), loop.take(600, x[600:], force[600:])
    assert before is not None
    assert after is not None
    assert after.first > before.next + 90
    assert after.velocity_m_s[0] == pytest.approx(
        0.01 * 8 * np.pi * np.cos(8 * np.pi * after.first / RATE_HZ), rel=0.01
    )


def test_a_few_samples_make_no_point() -> None:
    assert LiveLoop(rate_hz=RATE_HZ).take(0, np.zeros(3), np.zeros(3)) is None


def test_a_report_has_every_sample_since_the_report_before() -> None:
    values = np.arange(50.0).reshape(10, 5)

    def block(first: int, last: int) -> CaptureBlock:
        return CaptureBlock(run_id=1, first_index=first, values=values[first:last])

    assert joined([]) is None
    whole = joined([block(0, 3), block(3, 4), block(4, 10)])
    assert whole is not None
    assert (whole.first_index, whole.samples) == (0, 10)
    np.testing.assert_array_equal(whole.values, values)
    after_gap = joined([block(0, 3), block(5, 7), block(7, 10)])
    assert after_gap is not None
    assert (after_gap.first_index, after_gap.samples) == (5, 5)
