"""Models beside each other: the figures are those of simulate and score, the page opens offline."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.errors import DataError, OutputError, SimulationError
from identification.models import Comparison, Motion, compare, comparison_data, score_signals, simulate_run
from identification.models.comparison_page import comparison_html, cost_and_error, write_comparison
from identification.physical.model import Model, element
from tests.identification.polynomial import Polynomial
from tests.identification.specimens import AS_SIMULATED, between_samples, run

VISCOUS = Model(name="viscous", elements=(element("viscous_damping", {"c": 1200.0}),))
CUBIC = Polynomial(name="cubic <b>", coefficients=(0.0, 1400.0, 0.0, -500.0), trained_m_s=0.1)
RUNS = [run("none", k, seed=3) for k in (2, 4)]
RUNS.append(replace(between_samples(run("none", 3, seed=5)), run_id="free"))


class Failing(Polynomial):
    """A polynomial that can't run where it is fast."""

    def force(self, motion: Motion) -> np.ndarray:
        if np.max(np.abs(motion.v)) > 0.1:
            raise SimulationError("too fast for <me>")
        return super().force(motion)


def ticking(step_ns: int) -> Iterator[int]:
    """A clock on which every look takes `step_ns`."""
    now = 0
    while True:
        now += step_ns
        yield now


@pytest.fixture(scope="module")
def found() -> Comparison:
    clock = ticking(16_000)
    failing = Failing(name="failing", coefficients=(0.0, 1.0), trained_m_s=1.0)
    return compare([VISCOUS, AS_SIMULATED, CUBIC, failing], RUNS, clock=lambda: next(clock))


def test_the_figures_are_those_of_simulate_and_score(found: Comparison) -> None:
    for row, model in zip(found.rows, (VISCOUS, AS_SIMULATED, CUBIC), strict=False):
        for cell, measured in zip(row.cells, RUNS, strict=True):
            assert cell.score == score_signals(measured.channels["force"], simulate_run(model, measured))
    assert [row.label for row in found.best_first()] == ["as simulated today", "cubic <b>", "viscous", "failing"]


def test_the_figures_over_all_runs_are_those_of_the_runs_end_to_end(found: Comparison) -> None:
    row = found.rows[1]
    errors = [r.channels["force"] - simulate_run(AS_SIMULATED, r) for r in RUNS]
    assert row.rms == pytest.approx(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
    centred = [r.channels["force"] - np.mean(r.channels["force"]) for r in RUNS]
    ratio = np.linalg.norm(np.concatenate(errors)) / np.linalg.norm(np.concatenate(centred))
    assert row.rrmsse == pytest.approx(100 * ratio)
    assert row.fit == pytest.approx(100 - 100 * ratio)


def test_the_cost_is_the_median_time_of_a_simulation_over_its_samples(found: Comparison) -> None:
    assert [cell.cost_ns for cell in found.rows[0].cells] == [16_000 / r.samples for r in RUNS]


def test_a_model_says_how_many_parameters_it_has_and_where_it_leaves_its_training(found: Comparison) -> None:
    viscous, _, cubic, _ = found.rows
    assert (viscous.free, viscous.parameters, viscous.ranged) == (1, 2, False)
    assert viscous.cells[0].left is None
    assert (cubic.free, cubic.parameters, cubic.ranged) == (4, 4, True)
    fast, slow = cubic.cells[0].left, cubic.cells[1].left
    assert fast is not None
    assert 0.3 < fast["velocity"] < 0.7  # a sine of 0.15 m/s
    assert slow == {}


def test_a_model_that_fails_on_one_run_has_figures_on_the_others_and_none_over_all(found: Comparison) -> None:
    failing = found.rows[3]
    assert [cell.score is None for cell in failing.cells] == [True, False, True]
    assert failing.cells[0].failure == "too fast for <me>"
    assert failing.rms is failing.fit is failing.cost_ns is None


def test_a_model_that_fails_on_every_run_has_no_word_on_its_range() -> None:
    failing = Failing(name="failing", coefficients=(0.0, 1.0), trained_m_s=1.0)
    page = comparison_html(compare([failing], [RUNS[0]]))
    assert "fails on 1 of 1 run" in page
    assert "kept on every run" not in page


def test_the_noise_is_what_the_periods_differ_by(found: Comparison) -> None:
    assert found.courses[0].noise == pytest.approx(3.0, rel=0.05)
    assert found.courses[2].noise is None


def test_the_data_is_json_of_finite_numbers_with_a_row_for_every_model(found: Comparison) -> None:
    data = json.loads(json.dumps(comparison_data(found), allow_nan=False))
    assert [model["kind"] for model in data["models"]] == ["physical", "physical", "polynomial", "polynomial"]
    assert data["models"][0]["training_range"] == "not stated"
    assert data["models"][3]["runs"][0] | {"outside_training": {}} == {
        "run": "none-3-2", "rms": None, "rrmsse": None, "fit": None, "eearth": None, "cost_ns_per_sample": None,
        "coverage_90": None, "outside_training": {}, "failure": "too fast for <me>",
    }  # fmt: skip


def test_the_page_opens_offline_and_shows_every_model_and_run(found: Comparison, tmp_path: Path) -> None:
    write_comparison(tmp_path / "page.html", found)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page == comparison_html(found)
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=", page)
    for word in ("4 models on 3 runs", "none-3-2", "free", "cubic &lt;b&gt;", "fails: too fast for &lt;me&gt;",
                 "not stated", "left on 2 of 3 runs", "fails on 2 of 3 runs",
                 "as simulated today</b> has the smallest error"):  # fmt: skip
        assert word in page, word
    assert "<me>" not in page
    with pytest.raises(OutputError, match="cannot be written"):
        write_comparison(tmp_path / "absent" / "page.html", found)


def test_a_page_on_which_no_model_has_an_error_over_all_runs_says_so_in_place_of_an_empty_chart(
    found: Comparison,
) -> None:
    page = comparison_html(compare([Failing(name="f", coefficients=(0.0, 1400.0), trained_m_s=0.1)], RUNS[2:]))
    assert "<h2>Error and cost</h2><p>No model has an error over all runs.</p>" in page
    assert "figure-1" not in page
    assert "figure-1" in comparison_html(found)


def test_names_of_models_alike_do_not_cover_each_other_in_the_chart_of_error_and_cost(found: Comparison) -> None:
    rows = [row for row in found.best_first() if row.rms is not None]
    points = cost_and_error(rows, dict.fromkeys([row.label for row in rows], "#000000")).data
    assert [point.mode for point in points] == ["markers"] * len(rows)
    assert all(point.showlegend for point in points)


def test_a_share_that_is_little_is_not_shown_as_none_and_one_that_is_most_not_as_all(found: Comparison) -> None:
    row = found.rows[0]
    cell = replace(row.cells[0], left={"current": 0.0008, "velocity": 0.08, "displacement": 1.0}, covered=0.9999)
    page = comparison_html(replace(found, rows=(replace(row, cells=(cell, *row.cells[1:])),)))
    assert "current: under 1 % outside training" in page
    assert "velocity: 8 % outside training" in page
    assert "displacement: 100 % outside training" in page
    assert "90 % band holds over 99 %" in page


def test_models_of_one_name_are_numbered() -> None:
    found = compare([VISCOUS, VISCOUS], RUNS[1:2])
    assert [row.label for row in found.rows] == ["viscous (1)", "viscous (2)"]


@pytest.mark.parametrize(
    ("models", "runs", "words"),
    [
        ([], RUNS, "no model was given"),
        ([VISCOUS], [], "no run was given"),
        ([VISCOUS], [replace(RUNS[0], channels={"displacement": np.ones(9)})], "no channel 'force'"),
        ([VISCOUS, AS_SIMULATED],
         [replace(RUNS[0], channels={n: RUNS[0].channels[n] for n in ("displacement", "force")})],
         "none-3-2 has no control current, which 'valve_damping' needs"),
        ([VISCOUS], [replace(RUNS[0], channels={**RUNS[0].channels, "force": np.ones(RUNS[0].samples)})],
         "the measured force is constant"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared_is_refused_before_anything_is_simulated(
    models: list[Model], runs: list, words: str
) -> None:
    with pytest.raises(DataError, match=words):
        compare(models, runs, on_progress=lambda done, text: pytest.fail("simulates"))
