"""Results show themselves in a line or a table, as a picture, and as a file."""

from __future__ import annotations

import json
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import plotly.graph_objects as go
import pytest

import damper_rig as dr
from damper_rig.progress import in_notebook, progress
from identification.errors import ModelError
from identification.models import model_from_json
from identification.physical.model import Model
from tests.api.measured import MODEL, a_run

EXAMPLES = Path(__file__).parents[2] / "examples"
RUNS = dr.Runs(tuple(a_run(k, f) for k, f in enumerate((0.5, 1.0, 2.5))))


class Balanced(HTMLParser):
    """Checks that every element that is opened is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag != "script", "a notebook that is not trusted runs none"
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def words_of(result: object) -> str:
    parsed = Balanced(result._repr_html_())  # type: ignore[attr-defined]
    assert parsed.open == []
    return " ".join(parsed.words)


@pytest.fixture(scope="module")
def model() -> Model:
    read = model_from_json(MODEL)
    assert isinstance(read, Model)
    return read


def test_an_explanation_shows_its_verdict_its_names_with_confidence_and_the_ladder(model: Model) -> None:
    found = dr.explain(model, RUNS)
    shown = words_of(found)
    for due in (found.verdict.replace("_", " "), *found.names, f"{found.rows()[0]['confidence']:.2f}"):
        assert due in shown
        assert due in repr(found)
    assert all(step in shown for step in ("as given", "parameters refitted", "with what is named", "noise floor"))
    assert len(repr(found)) < 1000
    assert isinstance(dr.plot(found), go.Figure)


def test_fits_comparisons_sheets_and_runs_show_their_figures(model: Model) -> None:
    fitted = dr.fit(model, RUNS)
    for result, due in (
        (fitted, "viscous_damping.c"),
        (dr.compare({"given": model, "fitted": fitted.model}, RUNS), "given"),
        (dr.characterise(RUNS), "run 1"),
        (RUNS, "run 2"),
        (dr.elements(), "Coulomb"),
    ):
        assert due in words_of(result)
        assert due in repr(result)
        assert len(repr(result)) < 10_000
        if not isinstance(result, dr.Elements):
            assert isinstance(dr.plot(result), go.Figure)


def test_what_a_file_says_is_never_html() -> None:
    run = a_run(0, 1.0)
    named = dr.Runs((replace(run, specimen="<script>x</script>"),))
    assert "<script>" not in named._repr_html_()


def test_a_design_is_drawn_and_saved(tmp_path: Path) -> None:
    config = {"sample_rate": 100.0, "levels": [1.0]}
    with pytest.raises(ValueError, match="period_samples"):
        dr.design("random-phase", config)
    plan = dr.design("harmonic", EXAMPLES / "first_sines.toml")
    assert isinstance(plan, dr.TestPlan)
    assert isinstance(dr.plot(plan), go.Figure)
    assert dr.save(plan, tmp_path / "plan.toml").is_file()


def test_a_run_and_a_model_are_saved(model: Model, tmp_path: Path) -> None:
    dr.save(RUNS[0], tmp_path / "run.h5")
    dr.save(model, tmp_path / "model.json")
    assert dr.load(tmp_path / "run.h5").rows()[0] == {**RUNS.rows()[0], "run": "run.h5"}
    assert json.loads((tmp_path / "model.json").read_text())["name"] == model.name


def test_an_element_that_does_not_exist_is_refused_with_the_nearest() -> None:
    name = next(iter(dr.elements()))
    with pytest.raises(ModelError, match=name):
        dr.elements(name[:-1])


def test_a_script_shows_no_progress(capsys: pytest.CaptureFixture[str]) -> None:
    assert not in_notebook()
    with progress("working") as tell:
        tell(0.5, "half")
    assert capsys.readouterr() == ("", "")
