"""The confidence that is fitted to judged names says how often they are true."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest

from benchmarks.explain.calibrate import PARTS, JudgedName, cases_of, fitted, left_out, names_in, reliability, shown
from benchmarks.explain.summary import expected_calibration_error
from identification.discrepancy.confidence import DOUBTS, Features, Table, confidence


def drawn(rng: np.random.Generator, truth: Table, seed: int) -> JudgedName:
    """A name with features at random that is true as often as the table says."""
    f = Features(
        spread=rng.exponential(0.1), runs=int(rng.integers(1, 7)), left_beside=rng.uniform() ** 3,
        left_held_out=rng.uniform() ** 3,
        margin=rng.uniform(0.0, 5.0), own_share=rng.uniform(0.05, 1.0), beside_curve=bool(rng.random() < 0.3),
        beside_loop=False,
    )  # fmt: skip
    return JudgedName(seed=seed, features=f, stated=0.5, true=bool(rng.random() < confidence(f, truth)))


WEIGHTS = {**dict.fromkeys(DOUBTS, 0.0), "scatter": 1.5, "few_runs": 4.0}
TRUTH = Table(without_doubt=6.0, weights=WEIGHTS, most=(1.0, 1.0), sure_from=0.9, names=1)
RNG = np.random.default_rng(5)
NAMES = [drawn(RNG, TRUTH, seed) for seed in range(3000)]


def test_the_fit_comes_back_to_what_the_names_were_drawn_from() -> None:
    table = fitted(NAMES)
    assert table.weights["scatter"] == pytest.approx(1.5, abs=0.3)
    assert table.weights["few_runs"] == pytest.approx(4.0, abs=1.0)
    assert all(w >= 0.0 for w in table.weights.values())
    assert table.names == len(NAMES)
    several = [n for n in NAMES if n.features.runs > 2]
    said = [confidence(n.features, replace(table, sure_from=0.9)) for n in several]
    assert expected_calibration_error(said, [n.true for n in several]) < 0.02
    sure = [n.true for n in NAMES if confidence(n.features, table) >= 0.9]
    assert len(sure) > 100
    assert np.mean(sure) >= 0.99


def test_a_doubt_that_only_right_names_have_gets_no_weight() -> None:
    upside_down = [JudgedName(seed=n.seed, features=n.features, stated=n.stated, true=not n.true) for n in NAMES]
    assert fitted(upside_down).weights["scatter"] == 0.0


def test_few_cases_limit_the_confidence() -> None:
    single = [n for n in NAMES if n.features.runs == 1 and n.true][:8]
    many = [n for n in NAMES if n.features.runs > 2]
    table = fitted([*single, *many])
    assert table.most[0] <= 9 / 10
    assert all(confidence(n.features, table) <= 9 / 10 for n in single)


def test_a_stronger_penalty_gives_smaller_weights() -> None:
    few = NAMES[:100]
    free, held = (sum(fitted(few, penalty).weights.values()) for penalty in (0.1, 100.0))
    assert held < free


def test_each_name_is_judged_by_a_table_that_no_name_of_its_seed_was_fitted_to() -> None:
    few = [replace(n, seed=n.seed % 40) for n in NAMES[:400]]
    others = fitted([n for n in few if n.seed % PARTS != 3])
    said = left_out(few)
    assert [c for n, c in zip(few, said, strict=True) if n.seed % PARTS == 3] == [
        confidence(n.features, others) for n in few if n.seed % PARTS == 3
    ]


def test_the_names_are_shown_as_stated_and_by_tables_fitted_without_them() -> None:
    lines = shown(NAMES[:400]).splitlines()
    assert [line.split("  ")[0] for line in lines[1:]] == ["as stated", "cross-validated"]


def test_reliability_counts_right_names() -> None:
    words = reliability([0.95, 0.95, 0.6, 0.1], [True, False, True, True]).split()
    assert words[:6] == ["2", "of", "3", "1", "of", "2"]


def test_names_that_were_withheld_are_read_too() -> None:
    said = [
        {"name": name, "stated": stated, "confidence": 0.3, **asdict(NAMES[0].features), "strengths": [None, 1.0]}
        for name, stated in (("free_play", True), ("gas_spring", False))
    ]
    read = names_in([{"seed": 4, "true": ["free_play"], "judged": said}, {"seed": 5, "true": [], "error": "none"}])
    assert [n.true for n in read] == [True, False]
    assert read[0].features == NAMES[0].features


def test_cases_are_asked_for_with_their_number_of_runs() -> None:
    asked = cases_of(["single:3:5:2", "null:7:8"])
    assert [(kind, seed, c.runs) for kind, seed, c in asked] == [("single", 3, 2), ("single", 4, 2), ("null", 7, None)]
