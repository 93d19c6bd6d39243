"""Chooses the terms of a polynomial NARX model: regressors, degree and number by cross-validation in free run."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.band import LeftOut
from identification.blackbox.folds import Fold, folds_of, stretch_of
from identification.blackbox.leftout import left_out_of
from identification.blackbox.polynomial import (
    PolynomialNarx,
    Term,
    products,
    ranked,
    regressors_of,
    terms_of,
)
from identification.blackbox.samples import Course, Samples, samples_of
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import FORCE, Structure, regressors
from identification.compute import run
from identification.errors import DataError

Floats = NDArray[np.float64]

# From here on a further term of the usual libraries lowers the prediction error and makes the free run unstable.
COUNTS = (4, 6, 9, 13, 19, 28, 40)
DEGREES = (2, 3)
# Products of regressors that are ranked: those of 47 regressors. Half: 37 regressors; double: 60, and twice the time.
MOST_PRODUCTS = 20_000
# Numbers in the table of these products, a row a sample: 4 GB, held twice. Half and double: the longest training.
MOST_NUMBERS = 500_000_000
RIDGE = 1e-6  # of the samples: what near-dependent terms share is shared evenly

# Places over the first half of a course from which a free run is tried: a reversal on the way could catch every start
# before it, and none after it. Half: a polynomial that is lost from one place in eight is taken more often; double:
# twice the time.
_STARTS = 8
_DEFAULT = ("F1 v0 v1 i0", "F1 F2 v0 v1 x0 i0", "F1 F2 F3 v0 v1 v2 i0")


@dataclass(frozen=True, slots=True)
class Polynomial:
    """What is tried: a structure, the highest degree, and how many terms."""

    structure: Structure
    degree: int
    terms: int

    def __str__(self) -> str:
        names = " ".join(map(str, self.structure.regressors))
        return f"{names}, {self.terms} terms of up to degree {self.degree}"


def default_structures(absent: Sequence[str]) -> list[Structure]:
    """The regressors that are tried, without those of the `absent` signals."""
    chosen = (tuple(one for one in regressors(text) if one.signal not in absent) for text in _DEFAULT)
    return list(dict.fromkeys(Structure(one, 0) for one in chosen))


def check_products(structures: Sequence[Structure], samples: int) -> None:
    """Raise DataError where the products of the regressors of a structure are too many to be ranked."""
    for one in structures:
        count = len(one.regressors)
        products_of = math.comb(count + max(DEGREES), max(DEGREES))
        if products_of > MOST_PRODUCTS or products_of * samples > MOST_NUMBERS:
            raise DataError(
                f"{count} regressors have {products_of} products of up to {max(DEGREES)} at {samples} samples: at most "
                f"{min(MOST_PRODUCTS, MOST_NUMBERS // samples)} are tried; give fewer regressors, or shorter runs"
            )


def judge_polynomials(
    structures: Sequence[Structure],
    courses: Sequence[Course],
    scales: Scales,
    dt: float,
    *,
    tell: Callable[[int, int], None] | None = None,
) -> list[tuple[Polynomial, float]]:
    """What is tried with its mean square scaled error in free run on what was left out, the smallest first.

    A squared error is cut at that of the mean force, as for networks.
    """
    folds = folds_of(courses)
    pairs = list(product(structures, DEGREES))
    found = run(partial(_errors, scales=scales, dt=dt), list(product(pairs, folds)), on_done=tell)
    judged = []
    for k, (structure, degree) in enumerate(pairs):
        of_pair = found[k * len(folds) : (k + 1) * len(folds)]
        samples = sum(size for _, size in of_pair)
        for n, count in enumerate(COUNTS):
            judged.append((Polynomial(structure, degree, count), sum(e[n] for e, _ in of_pair) / samples))
    return sorted(judged, key=lambda pair: (pair[1], pair[0].terms))


def _errors(task: tuple[tuple[Structure, int], Fold], scales: Scales, dt: float) -> tuple[list[float], int]:
    """Sum of the squared scaled errors of each number of terms on what a fold shows, and of how many samples."""
    (structure, degree), fold = task
    order = ranking(structure, degree, fold.learned, scales)
    sums = []
    for count in COUNTS:
        model = polynomial_of(structure, order[:count], fold.learned, scales, dt)
        sums.append(sum(_squares(model, course, scales) for course in fold.shown))
    return sums, sum(int(course.counted.sum()) for course in fold.shown)


def _squares(model: PolynomialNarx, course: Course, scales: Scales) -> float:
    error = (course.force - model.along(course))[course.counted] / scales[FORCE].size
    spread = (course.force[course.counted] - scales[FORCE].centre) / scales[FORCE].size
    return min(float(error @ error), float(spread @ spread))


def left_out(best: Polynomial, courses: Sequence[Course], scales: Scales, dt: float) -> list[LeftOut]:
    """Errors, N, on each part of the polynomial that was not fitted to it; the spread of one model is 0."""
    parts = []
    for fold in folds_of(courses):
        terms = ranking(best.structure, best.degree, fold.learned, scales)[: best.terms]
        model = within(polynomial_of(best.structure, terms, fold.learned, scales, dt), fold.learned)
        parts.append(left_out_of(partial(_alone, model), best.structure.signals, fold))
    return parts


def _alone(model: PolynomialNarx, course: Course) -> tuple[Floats, float]:
    """The force of one model, (N,), N, which has no spread."""
    return model.along(course), 0.0


def on_all(one: Polynomial, courses: Sequence[Course], scales: Scales, dt: float) -> PolynomialNarx:
    """The polynomial of what was tried, on all courses."""
    kept = {name: scales[name] for name in (FORCE, *one.structure.signals)}
    terms = ranking(one.structure, one.degree, courses, scales)[: one.terms]
    return polynomial_of(one.structure, terms, courses, kept, dt)


def best_on_all(models: Iterable[tuple[float, PolynomialNarx]], courses: Sequence[Course]) -> int | None:
    """Index of the best of some models on all courses, with the error of each in cross-validation, the smallest first.

    Its error is the larger of that and the one of its free run on the courses: what was fitted to parts of them may be
    lost once it is fitted to all. None: no free run forgets its start wherever it begins on a course.
    """
    begun = [
        stretch_of(one, k * one.force.size // (2 * _STARTS), one.force.size) for one in courses for k in range(_STARTS)
    ]
    least, best = math.inf, None
    for k, (judged, model) in enumerate(models):
        if judged >= least:
            break  # as all that follow
        error = max(judged, mean_square_on(model, courses))
        if error < least and all(math.isfinite(model.memory(one)) for one in begun):
            least, best = error, k
    return best


def mean_square_on(model: PolynomialNarx, courses: Sequence[Course]) -> float:
    """Mean square scaled error in free run on what counts of some courses, cut as in cross-validation."""
    squares = sum(_squares(model, course, model.scales) for course in courses)
    return squares / sum(int(course.counted.sum()) for course in courses)


def ranking(structure: Structure, degree: int, courses: Sequence[Course], scales: Scales) -> list[Term]:
    """The terms by their error reduction ratio, the highest first."""
    phi, y, every = _problem(structure, degree, samples_of(courses, structure, scales))
    return [one.term for one in ranked(products(phi, every), y, every, max(COUNTS))]


def _problem(structure: Structure, degree: int, samples: Samples) -> tuple[Floats, Floats, list[Term]]:
    phi = regressors_of(samples, structure.fed_back)
    return phi, samples.force[samples.counted], terms_of(len(structure.regressors), degree)


def polynomial_of(
    structure: Structure, terms: Sequence[Term], courses: Sequence[Course], scales: Scales, dt: float, name: str = ""
) -> PolynomialNarx:
    """The polynomial of some terms, its coefficients by least squares of the prediction from measured forces."""
    samples = samples_of(courses, structure, scales)
    columns = products(regressors_of(samples, structure.fed_back), terms)
    y = samples.force[samples.counted]
    gram = columns.T @ columns + RIDGE * y.size * np.eye(len(terms))
    coefficients = np.asarray(np.linalg.solve(gram, columns.T @ y), dtype=np.float64)
    return PolynomialNarx(
        name=name, dt=dt, scales=scales, structure=structure, terms=tuple(terms), coefficients=coefficients
    )


def within(model: PolynomialNarx, courses: Sequence[Course]) -> PolynomialNarx:
    """A polynomial that sees past forces as near to each other as on these courses.

    It is chosen without: a form whose free run needs that on what it learned is worse than it looks.
    """
    changes = np.concatenate([np.diff(one.force) for one in courses])
    return replace(model, steps=(float(np.min(changes)), float(np.max(changes))))
