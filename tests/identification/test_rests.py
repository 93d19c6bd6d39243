"""Where a training never rested a network learns rests: its force there lies between those of the passages."""

from __future__ import annotations

import numpy as np
import pytest

from identification.blackbox.model import BlackBox
from identification.blackbox.rests import HELD, PLACES, lacks_rest, rests_of
from identification.blackbox.samples import Course, course_along
from identification.blackbox.structure import Structure, regressors
from identification.blackbox.training import QUICK, scales_of, train_member
from identification.models import motion_from

RATE_HZ, STROKE_M, FRICTION_N = 200.0, 0.02, 300.0


def sine(seconds: float = 4.0, rest_s: float = 0.0) -> Course:
    """A sine of 1 Hz of a dashpot with a friction; its last part may be a rest at a quarter of the stroke."""
    t = np.arange(round((seconds + rest_s) * RATE_HZ)) / RATE_HZ
    turn = 2.0 * np.pi * np.minimum(t, seconds + np.arcsin(0.25) / (2.0 * np.pi))
    x, moving = STROKE_M * np.sin(turn), t <= seconds
    v = np.where(moving, 2.0 * np.pi * STROKE_M * np.cos(turn), 0.0)
    force = 800.0 * v + FRICTION_N * np.tanh(v / 0.01)
    return Course(motion_from(x, RATE_HZ, velocity=v), force, np.ones(t.size, dtype=np.bool_))


def test_a_rest_slows_down_steadily_and_stays_and_its_force_is_the_middle_of_the_passages() -> None:
    rests = rests_of([sine()])
    assert 4 <= len(rests) < PLACES  # at both ends the sine itself comes to rest
    for rest in rests:
        x, v = rest.motion.x, rest.motion.v
        assert np.all(v[-HELD:] == 0.0)
        assert np.ptp(x[-HELD:]) == 0.0
        assert np.max(np.abs(np.diff(x) * RATE_HZ - 0.5 * (v[1:] + v[:-1]))) < 0.01
        assert rest.force[-1] == pytest.approx(0.0, abs=20.0)
        assert np.flatnonzero(rest.counted).tolist() == [x.size - 1]


def test_a_training_that_rested_at_a_place_learns_no_rest_there_and_one_that_began_at_rest_none_at_all() -> None:
    rested = sine(rest_s=1.0)
    place = rested.motion.x[-1]
    assert all(abs(one.motion.x[-1] - place) > 0.05 * STROKE_M for one in rests_of([rested]))
    assert 0 < len(rests_of([rested])) < len(rests_of([sine()]))
    assert lacks_rest([sine()])
    assert not lacks_rest([sine(), begun_at_rest()])


def begun_at_rest() -> Course:
    """The sine after a second at its middle."""
    course, size = sine(), round(RATE_HZ)
    x, v, force = (np.concatenate([np.zeros(size), one]) for one in (course.motion.x, course.motion.v, course.force))
    return Course(motion_from(x, RATE_HZ, velocity=v), force, np.ones(x.size, dtype=np.bool_))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_network_that_never_saw_a_rest_gives_the_middle_of_the_passages_there(seed: int) -> None:
    structure = Structure(regressors("v0 v1 v2 v4 v8 Q0 R0 S0"), 12)
    course, shown = sine(), sine(rest_s=1.0)
    scales = scales_of([course], structure.signals)
    member, trained = train_member(structure, scales, [course], decay=0.002, seed=seed, stages=QUICK, rested=True)
    model = BlackBox(name="", kind="nnoe", dt=1.0 / RATE_HZ, scales=scales, members=(member,))
    assert trained.error < 0.01
    assert np.max(np.abs(model.along(course_along(shown.motion))[-100:])) < 50.0  # without rests 228 to 239 N
