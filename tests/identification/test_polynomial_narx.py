"""Polynomial NARX models: terms by orthogonal least squares, free runs that stay bounded, and the file."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.blackbox import Identified, PolynomialNarx, Structure, identify, regressors, write_identified
from identification.blackbox.polynomial import products, ranked, terms_of
from identification.blackbox.polynomialfile import polynomial_to_json
from identification.blackbox.preparation import course_of
from identification.blackbox.samples import course_along, samples_of
from identification.blackbox.scaling import MARGIN
from identification.blackbox.terms import best_on_all, mean_square_on
from identification.blackbox.training import scales_of
from identification.errors import ModelFileError
from identification.models import load_model, motion_from, motion_of
from tests.identification.hysteretic import hysteretic
from tests.identification.random_black_boxes import DT, SCALES


@cache
def found() -> Identified:
    structure = Structure(regressors("F1 v0 v1"), 0)
    return identify(
        "polynomial", [hysteretic(1, 1200)], held_out=[hysteretic(k, 800) for k in (2, 3, 4)], structures=[structure]
    )


def model() -> PolynomialNarx:
    polynomial = found().model
    assert isinstance(polynomial, PolynomialNarx)
    return polynomial


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_the_terms_of_a_polynomial_are_found_and_their_ratios_add_up_to_what_they_explain(seed: int) -> None:
    rng = np.random.default_rng(seed)
    every = terms_of(3, 3)
    columns = products(rng.standard_normal((400, 3)), every)
    true = [every[k] for k in rng.choice(len(every), 3, replace=False)]
    y = columns[:, [every.index(term) for term in true]] @ rng.choice([-1.0, 1.0], 3)
    order = ranked(columns, y + 1e-6 * rng.standard_normal(400), every, 8)
    assert set(true) <= {one.term for one in order}
    assert all(one.ratio >= 0.0 for one in order)
    assert sum(one.ratio for one in order) == pytest.approx(1.0, abs=1e-6)


def test_a_dependent_term_is_never_chosen() -> None:
    rng = np.random.default_rng(0)
    column = rng.standard_normal((100, 1))
    order = ranked(np.hstack([column, 2.0 * column, column**2]), column[:, 0], [(0,), (1,), (2,)], 3)
    assert [one.term for one in order] in ([(0,), (2,)], [(1,), (2,)])


def test_a_free_run_is_stable_and_as_good_as_was_said_beforehand() -> None:
    shown = np.mean(list(found().shown.values()))  # of a model of few terms one run differs from the next by 5 %
    assert abs(shown - found().predicted) < 3.0
    assert shown > 50.0  # no polynomial of a few terms is a friction
    assert found().stable
    assert len(model().names()) == len(model().terms)


def test_the_first_polynomial_that_forgets_its_start_is_taken() -> None:
    structure = Structure(regressors("F1 v0"), 0)
    course = course_of(hysteretic(1, 1200), ())
    scales, dt = scales_of([course], structure.signals), course.motion.dt
    sums, forgets, lags = (
        PolynomialNarx(
            name="", dt=dt, scales=scales, structure=structure, terms=((0,), (1,)), coefficients=np.array([own, 1e-3])
        )
        for own in (1.0, 0.9, 0.5)
    )
    assert best_on_all([(0.1, sums), (0.2, forgets), (0.3, lags)], [course]) == 1
    assert best_on_all([(0.1, lags), (0.2, sums)], [course]) == 0
    assert best_on_all([(0.1, sums), (0.2, sums)], [course]) is None


def test_a_polynomial_is_no_better_than_its_free_run_on_what_it_learned() -> None:
    course = course_along(motion_from(0.005 * np.sin(np.arange(300) * 0.02), 1.0 / DT))
    structure = Structure(regressors("v0"), 0)
    true, near, far = (
        PolynomialNarx(
            name="", dt=DT, scales=SCALES, structure=structure, terms=((0,),), coefficients=np.array([slope])
        )
        for slope in (0.8, 0.9, -0.1)
    )
    course = replace(course, force=true.along(course))
    near_error, far_error = (mean_square_on(model, [course]) for model in (near, far))
    assert far_error > 10.0 * near_error
    assert best_on_all([(0.0, far), (0.9 * far_error, near)], [course]) == 1
    assert best_on_all([(0.0, far), (1.1 * far_error, near)], [course]) == 0


def of_force(*coefficients: float) -> PolynomialNarx:
    """F(t) = Σ_k c_k·F(t − 1)ᵏ, k = 1, 2, 3, of a force scaled by a third of the highest trained one."""
    structure, terms = Structure(regressors("F1 v0"), 0), ((0,), (0, 0), (0, 0, 0))
    return PolynomialNarx(
        name="", dt=DT, scales=SCALES, structure=structure, terms=terms, coefficients=np.array(coefficients)
    )


def seen_within(model: PolynomialNarx) -> PolynomialNarx:
    """The same in a training whose force changed by up to 300 N from a sample to the next."""
    return replace(model, steps=(-300.0, 300.0))


def test_a_free_run_that_is_beyond_every_trained_force_comes_back() -> None:
    course = course_along(motion_from(np.linspace(0.0, 0.01, 400), 1.0 / DT))
    model = of_force(0.2, 0.0, 0.05)  # at twice the trained force it grows, within it falls
    assert model.memory(course) == math.inf
    assert seen_within(model).memory(course) < 20 * DT


def test_a_free_run_does_not_go_to_and_fro_between_forces_that_no_training_had_side_by_side() -> None:
    structure, terms = Structure(regressors("F1 F2 v0"), 0), ((0,), (1,))  # F(t) = −F(t − 1) is a free motion of it
    model = PolynomialNarx(
        name="", dt=DT, scales=SCALES, structure=structure, terms=terms, coefficients=np.array([-0.4, 0.6])
    )
    samples = samples_of([course_along(motion_from(np.linspace(0.0, 0.01, 400), 1.0 / DT))], structure, SCALES)
    samples.force[:2] = (3.0, -3.0)
    forces = {one: np.empty(samples.force.size) for one in ("as it is", "within")}
    model.prepared(samples)(forces["as it is"])
    seen_within(model).prepared(samples)(forces["within"])
    last = {name: 500.0 * np.ptp(force[-50:]) for name, force in forces.items()}
    assert last["as it is"] > 2000.0
    assert last["within"] < 301.0


def test_a_free_run_that_stays_where_no_other_start_leads_never_forgets() -> None:
    course = course_along(motion_from(np.linspace(0.0, 0.01, 400), 1.0 / DT))
    assert of_force(0.0, 0.5, 0.0).memory(course) == math.inf  # from both edges to the highest force, from 0 to 0


@given(
    st.lists(st.sampled_from([math.nan, math.inf, 1e300, -1e300, 0.0, 1.0, -3.0]), min_size=50, max_size=50),
)
@settings(max_examples=40, deadline=None)
def test_the_force_is_finite_and_bounded_whatever_the_input(values: list[float]) -> None:
    motion = motion_of(hysteretic(2, 800)).head(250)
    motion.v[:] = np.repeat(values, 5)
    force, scale = model().force(motion), model().scales["force"]
    margin = MARGIN * (scale.high - scale.low) * (1.0 + 1e-9)
    assert np.all((force >= scale.low - margin) & (force <= scale.high + margin))


def test_a_polynomial_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "polynomial.json"
    write_identified(path, model())
    again = load_model(path)
    assert isinstance(again, PolynomialNarx)
    motion = motion_of(hysteretic(2, 800))
    assert np.array_equal(again.force(motion), model().force(motion))
    assert list(again.names()) == list(model().names())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"terms": []}, "terms must be a list of 1 … 1000 terms"),
        ({"terms": [{"term": ["F9"], "coefficient": 1.0}]}, r"terms\[0\]\.term: 'F9' is none of F1 v0 v1"),
        ({"terms": [{"term": ["v0"] * 5, "coefficient": 1.0}]}, "it must be up to 4 numbers"),
        ({"terms": [{"term": ["v0"], "coefficient": "x"}]}, r"terms\[0\]\.coefficient is 'x'"),
        ({"regressors": ["F1", "M0"]}, "is missing, or not for a polynomial"),
        ({"signals": {}}, r"signals\.\w+ is missing"),
    ],
)
def test_a_broken_file_is_refused_with_the_place(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(polynomial_to_json(model()) | change))
    with pytest.raises(ModelFileError, match=message):
        load_model(path)
