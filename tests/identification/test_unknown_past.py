"""The motion before a record is not known: what a force remembers of it is no error of a network, and not learned."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.blackbox.choose import errors_on
from identification.blackbox.folds import folds_of
from identification.blackbox.model import Member
from identification.blackbox.samples import LEAD, Course
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import FORCE, Structure, regressors
from identification.blackbox.training import FULL, scales_of, train_member
from identification.models import motion_from

DT, POLE, FORGOTTEN = 0.005, 0.97, 400
STRUCTURE = Structure(regressors("F1 v0"), 0)


def relaxing(samples: int, seed: int = 1) -> Course:
    """F(t) = 0.97·F(t − 1) + 30 N·s/m·v(t) along a random motion that began long before the course."""
    rng = np.random.default_rng(seed)
    v = lfilter([0.02], [1.0, -0.98], rng.standard_normal(FORGOTTEN + samples))
    force = lfilter([30.0], [1.0, -POLE], v)[FORGOTTEN:]
    motion = motion_from(np.cumsum(v[FORGOTTEN:]) * DT, 1.0 / DT, velocity=v[FORGOTTEN:])
    return Course(motion, force, np.ones(samples, dtype=np.bool_))


def exact(scales: Scales) -> Member:
    """The law itself in scaled signals."""
    force, v = scales[FORCE], scales["velocity"]
    bias = (30.0 * v.centre - (1.0 - POLE) * force.centre) / force.size
    return Member(STRUCTURE, np.array([POLE, 30.0 * v.size / force.size, bias]))


def test_the_law_itself_has_no_error_on_any_part_that_is_left_out_after_a_motion_that_is_known() -> None:
    course = relaxing(1800)
    scales = scales_of([course], STRUCTURE.signals)
    for k, fold in enumerate(folds_of([course])):
        squares, count = errors_on([exact(scales)], fold.after, scales, DT)
        assert count == (600 if k else 600 - LEAD)
        assert squares / count < 1e-4


def test_a_short_course_of_a_force_that_relaxes_for_as_long_teaches_its_law() -> None:
    course = relaxing(120)
    scales = scales_of([course], STRUCTURE.signals)
    member, trained = train_member(STRUCTURE, scales, [course], decay=1e-9, seed=1, stages=FULL)
    assert trained.error < 1e-6
    assert member.weights == pytest.approx(exact(scales).weights, abs=1e-3)
