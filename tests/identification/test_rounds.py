"""Cross-validation in rounds finds the same best as if all were judged to the end, and folds leave whole runs out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from identification.blackbox.folds import Fold, folds_of
from identification.blackbox.model import Member
from identification.blackbox.rounds import Part, in_rounds
from identification.blackbox.samples import Course
from identification.blackbox.structure import Structure, regressors
from identification.models import motion_from

BEST, CANDIDATES = 3, 12
STRUCTURE = Structure(regressors("v0"), 0)
MEMBER = Member(STRUCTURE, np.zeros(STRUCTURE.size))


def course(frequency_hz: float, samples: int) -> Course:
    """A sine of a dashpot at 200 Hz."""
    x = 0.01 * np.sin(2.0 * np.pi * frequency_hz * np.arange(samples) / 200.0)
    motion = motion_from(x, 200.0)
    return Course(motion, 800.0 * motion.v, np.ones(samples, dtype=np.bool_))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("bounded", [False, True])
def test_what_is_given_up_is_not_among_the_best(seed: int, bounded: bool) -> None:
    random, folds = np.random.default_rng(seed), folds_of([course(1.0, 1200)])
    squares = random.lognormal(sigma=1.5, size=(CANDIDATES, 1)) * random.lognormal(size=(CANDIDATES, len(folds)))
    weights = random.choice([1.0, 1.35], CANDIDATES).tolist()
    number = {id(fold): n for n, fold in enumerate(folds)}
    trained: list[tuple[int, int]] = []

    def work(tasks: Sequence[tuple[int, Fold]]) -> list[Part]:
        numbered = [(k, number[id(fold)]) for k, fold in tasks]
        trained.extend(numbered)
        return [Part(float(squares[one]), 1, MEMBER) for one in numbered]

    errors = weights * squares.sum(axis=1)
    counted = sum(int(one.counted.sum()) for fold in folds for one in fold.after)
    bound = float(np.sort(errors)[BEST - 1]) / counted * (1.0 + 1e-12) if bounded else float("inf")
    shown = in_rounds(folds, weights, BEST, bound, work)
    whole = {k for k, parts in enumerate(shown) if len(parts) == len(folds)}
    assert set(np.argsort(errors)[:BEST].tolist()) <= whole
    assert len(set(trained)) == len(trained) < CANDIDATES * len(folds)


def test_of_three_runs_whole_ones_are_left_out_but_where_one_is_nearly_all_of_the_training() -> None:
    alike = [course(1.0, 400), course(2.0, 400), course(3.0, 800)]
    assert [fold.shown for fold in folds_of(alike)] == [(one,) for one in sorted(alike, key=lambda c: np.std(c.force))]
    uneven = [course(1.0, 150), course(2.0, 150), course(3.0, 1500)]
    assert all(len(fold.shown) == len(uneven) for fold in folds_of(uneven))
