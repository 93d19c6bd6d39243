"""Confidence in a name falls with everything that speaks against it, and its table is read or refused."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.discrepancy.confidence import DOUBTS, Features, Table, confidence, confidence_without_rival, doubts
from identification.discrepancy.confidence_table import fitted_table, read_table, table_to_json
from identification.errors import ConfidenceTableError

SHARES = st.floats(0.0, 1.0)
AMOUNTS = st.floats(0.0, 50.0)
FEATURES = st.builds(
    Features, spread=AMOUNTS, runs=st.integers(0, 30), left_beside=SHARES, left_held_out=SHARES, own_share=SHARES,
    margin=st.floats(-1.0, 20.0) | st.just(inf), beside_curve=st.booleans(), beside_loop=st.booleans(),
)  # fmt: skip
TABLES = st.builds(
    Table, without_doubt=st.floats(-10.0, 10.0), names=st.integers(0, 1000),
    most=st.tuples(SHARES, SHARES).map(lambda most: (min(most), max(most))),
    weights=st.fixed_dictionaries({d: st.floats(0.0, 10.0) for d in DOUBTS}), sure_from=st.floats(0.9, 1.0),
)  # fmt: skip
EVERY_DOUBT = Table(without_doubt=5.0, weights=dict.fromkeys(DOUBTS, 0.3), most=(0.7, 0.9), sure_from=0.9, names=100)
SURE = Features(
    spread=0.01, runs=6, left_beside=0.01, left_held_out=0.01, margin=5.0, own_share=0.8, beside_curve=False,
    beside_loop=False,
)  # fmt: skip


@given(FEATURES, TABLES)
def test_confidence_is_a_probability(f: Features, table: Table) -> None:
    assert 0.0 <= confidence(f, table) <= 1.0
    assert all(d >= 0.0 for d in doubts(f).values())


@given(FEATURES, TABLES, AMOUNTS)
@pytest.mark.parametrize("name", ["spread", "left_held_out"])
def test_more_scatter_and_less_gain_never_raise_it(name: str, f: Features, table: Table, more: float) -> None:
    assert confidence(replace(f, **{name: getattr(f, name) + more}), table) <= confidence(f, table)


@given(FEATURES, TABLES, AMOUNTS, st.integers(0, 20))
def test_more_runs_a_larger_margin_and_more_of_its_own_never_lower_it(
    f: Features, table: Table, more: float, runs: int
) -> None:
    now = confidence(f, table)
    assert confidence(replace(f, runs=f.runs + runs), table) >= now
    assert confidence(replace(f, margin=f.margin + more), table) >= now
    assert confidence(replace(f, own_share=f.own_share + more), table) >= now


@given(FEATURES, TABLES)
@pytest.mark.parametrize("name", ["beside_curve", "beside_loop"])
def test_what_acts_beside_another_of_its_sort_is_never_more_certain(name: str, f: Features, table: Table) -> None:
    beside, alone = replace(f, **{name: True}), replace(f, **{name: False})
    assert confidence(beside, table) <= confidence(alone, table)


@given(FEATURES, TABLES)
def test_nothing_is_more_certain_than_what_has_no_rival(f: Features, table: Table) -> None:
    assert confidence_without_rival(f.runs, table) >= confidence(f, table)


@pytest.mark.parametrize(
    "worse",
    [
        {"spread": 0.3}, {"runs": 1}, {"left_held_out": 0.5}, {"margin": 0.0},
        {"own_share": 0.1}, {"beside_curve": True}, {"beside_loop": True},
    ],
)  # fmt: skip
def test_every_doubt_counts(worse: dict[str, float]) -> None:
    assert confidence(replace(SURE, **worse), EVERY_DOUBT) < confidence(SURE, EVERY_DOUBT)


@given(FEATURES, TABLES, SHARES)
def test_what_else_is_missing_on_the_fitted_runs_says_nothing_of_a_name(
    f: Features, table: Table, other: float
) -> None:
    assert confidence(replace(f, left_beside=other), table) == confidence(f, table)


def test_the_same_scatter_is_less_of_a_doubt_the_more_runs_show_it() -> None:
    scattered = replace(SURE, spread=0.16, runs=4)
    assert doubts(replace(scattered, runs=16))["scatter"] < doubts(scattered)["scatter"]
    assert doubts(replace(scattered, runs=16))["scatter"] == pytest.approx(
        doubts(replace(scattered, spread=0.08))["scatter"]
    )


def test_one_run_gives_no_more_confidence_than_the_table_says() -> None:
    table = Table(without_doubt=50.0, weights=dict.fromkeys(DOUBTS, 0.0), most=(0.7, 0.9), sure_from=0.9, names=100)
    assert [confidence(replace(SURE, runs=runs), table) for runs in (0, 1, 2, 3)] == [0.7, 0.7, 0.9, 1.0]


def test_a_name_is_called_sure_only_from_where_such_names_were_right() -> None:
    table = Table(without_doubt=5.0, weights={**dict.fromkeys(DOUBTS, 0.0), "left_held_out": 5.0}, most=(1.0, 1.0),
                  sure_from=0.95, names=100)  # fmt: skip
    said = [confidence(replace(SURE, left_held_out=left), table) for left in np.linspace(0.0, 1.5, 200)]
    assert not any(0.9 <= c < 0.95 for c in said)
    assert sum(c == pytest.approx(0.89) for c in said) > 2
    assert max(said) > 0.95


def test_a_table_comes_back_from_its_file(tmp_path: Path) -> None:
    (tmp_path / "table.json").write_text(json.dumps(table_to_json(EVERY_DOUBT)))
    assert read_table(tmp_path / "table.json") == EVERY_DOUBT


def test_the_table_in_use_can_be_read() -> None:
    assert fitted_table().names > 0
    assert confidence(SURE, fitted_table()) > 0.9


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"format": "another"}, "format must be damper-rig/confidence-table"),
        ({"format_version": 1}, "version 2"),
        ({"form_tolerance": 0.05}, "form_tolerance is 0.05 and not 0.06: fit the table again"),
        ({"weights": {"scatter": 1.0}}, "weights of scatter: they must be of scatter"),
        ({"weights": None}, "weights must be an object"),
        ({"sure_from": 0.5}, "sure_from is 0.5: it must be from 0.9 to 1"),
        ({"sure_from": None}, "sure_from is None: it must be a number"),
        (
            {"weights": {**EVERY_DOUBT.weights, "rivalry": -1.0}},
            "weight of rivalry is -1.0: it must be finite and not neg",
        ),
        ({"weights": {**EVERY_DOUBT.weights, "rivalry": "much"}}, "weights.rivalry is 'much': it must be a number"),
        ({"without_doubt": float("nan")}, "without_doubt is nan"),
        ({"without_doubt": True}, "without_doubt is True: it must be a number"),
        ({"most": [0.9, 0.7]}, "most is (0.9, 0.7): it must be two probabilities"),
        ({"most": [0.9]}, "most must be a list of two numbers"),
        ({"names": None}, "names is None"),
    ],
)
def test_a_broken_table_is_refused_in_one_line(tmp_path: Path, change: dict[str, object], says: str) -> None:
    path = tmp_path / "table.json"
    path.write_text(json.dumps({**table_to_json(EVERY_DOUBT), **change}))
    with pytest.raises(ConfidenceTableError) as refused:
        read_table(path)
    assert says in str(refused.value)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "3", '{"format": 1}'])
def test_what_is_no_table_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "table.json"
    path.write_text(text)
    with pytest.raises(ConfidenceTableError, match="table") as refused:
        read_table(path)
    assert "\n" not in str(refused.value)


def test_a_table_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfidenceTableError, match="no table of confidence"):
        read_table(tmp_path / "none.json")
