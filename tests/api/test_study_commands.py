"""`damper-rig study`: the answer of a study at the command line, as a job and in a notebook; what it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import damper_rig as dr
from api.cli.main import main
from api.errors import InputError
from api.jobs.complexity import COMPLEXITY, ComplexityRequest
from api.jobs.explore import EXPLORE, ExploreRequest
from api.jobs.kind import Task
from api.jobs.realtime import REALTIME, RealtimeRequest
from api.jobs.sensitivity import SENSITIVITY, SensitivityRequest
from api.jobs.service_range import RANGE, RangeRequest
from excitation import read_envelope
from identification.errors import DataError
from identification.physical.modelfile import model_to_json, write_model
from rigctl.runfile import read_run, write_run
from tests.identification.maxwell_runs import VARIED, maxwell, sine_runs

KEYS = {"samples": 20, "points": 200, "vary": list(VARIED)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("studies")
    write_model(place / "model.json", maxwell())
    for k, run in enumerate(sine_runs(maxwell())):
        write_run(place / f"run_{k}.h5", run)
    vary = ", ".join(f'"{name}"' for name in VARIED)
    (place / "study.toml").write_text(f"samples = 20\npoints = 200\nvary = [{vary}]\n")
    return place


def paths(folder: Path) -> list[str]:
    return [str(folder / name) for name in ("model.json", "run_0.h5", "run_1.h5", "run_2.h5")]


def said(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    answer.pop("file")
    return answer


@pytest.mark.slow
def test_an_exploration_is_the_same_at_the_command_line_as_a_job_and_in_a_notebook(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    config = ["--config", str(folder / "study.toml")]
    assert main(["study", "explore", *paths(folder), "-o", str(page), *config, "--json"]) == 0
    answer = said(capsys)
    assert page.exists()
    assert not list(tmp_path.glob("*.part"))
    asked = ExploreRequest(kind="explore", model=model_to_json(maxwell()), study=dict(KEYS), runs=["a"])
    task = Task(request=asked.options, runs=tuple(Path(p) for p in paths(folder)[1:]), held_out=())
    EXPLORE.check(task)
    result = EXPLORE.run(task, tmp_path, lambda done, text: None)
    assert {name for name in EXPLORE.files if (tmp_path / name).exists()} == set(EXPLORE.files)
    assert json.loads((tmp_path / "exploration.json").read_text())["feasible_set"] == answer["feasible_set"]
    found = dr.study.explore(maxwell(), [read_run(Path(p)) for p in paths(folder)[1:]], KEYS)
    assert found.data() == answer
    assert len(found.rows()) == answer["feasible"] == result["feasible"]
    assert "feasible" in found._repr_html_()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--vary", "nothing.k"], ["has no parameter 'nothing.k'", "relaxing_compliance.k1"]),
        (["--samples", "0"], ["samples is 0"]),
        (["--sampling", "grid"], ["sampling", "grid", "sobol"]),
    ],
)
def test_an_exploration_that_cannot_be_right_is_refused_in_one_line_before_the_work(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], given: list[str], words: list[str]
) -> None:
    assert main(["study", "explore", *paths(folder), "-o", str(tmp_path / "page.html"), *given]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(word in error for word in words), error
    assert not list(tmp_path.iterdir())


def test_the_page_of_a_study_is_a_web_page(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "explore", *paths(folder), "-o", str(tmp_path / "page.pdf")]) == 2
    assert ".html" in capsys.readouterr().err


SHARES = {"vary": list(VARIED), "levels": [0.5, 1.0, 1.5], "networks": 1, "base_samples": 16}


def test_a_sensitivity_is_the_same_at_the_command_line_as_a_job_and_in_a_notebook(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config, run = tmp_path / "study.toml", str(folder / "run_1.h5")
    vary = ", ".join(f'"{name}"' for name in VARIED)
    config.write_text(f"vary = [{vary}]\nlevels = [0.5, 1.0, 1.5]\nnetworks = 1\nbase_samples = 16\n")
    given = ["--config", str(config), "--at", run, "-o", str(tmp_path / "page.html"), "--json"]
    assert main(["study", "sensitivity", str(folder / "model.json"), *given]) == 0
    answer = said(capsys)
    asked = SensitivityRequest(kind="sensitivity", model=model_to_json(maxwell()), study=dict(SHARES), runs=["a"])
    task = Task(request=asked.options, runs=(Path(run),), held_out=())
    SENSITIVITY.check(task)
    assert SENSITIVITY.run(task, tmp_path, lambda done, text: None)["orders"] == answer["orders"]
    assert json.loads((tmp_path / "sensitivity.json").read_text()) == answer
    point = {key: answer["asked"][key] for key in ("amplitude", "frequency", "current")}
    found = dr.study.sensitivity(maxwell(), SHARES | point)
    assert found.data() == answer
    assert "Garson" in found._repr_html_()


SIMPLE = {
    "format": "damper-rig/model", "format_version": 1, "name": "simple", "kind": "physical",
    "paths": {"core": [
        {"element": "viscous_damping", "parameters": {"c": 40_000.0}},
        {"element": "linear_stiffness", "parameters": {"k": 1000.0}},
    ]},
}  # fmt: skip
PLAN = {"step": [{"name": "stroke", "output": "stroke", "seconds": 3.0}]}


@pytest.mark.slow
def test_a_complexity_study_is_the_same_at_the_command_line_as_a_job_and_in_a_notebook(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "simple.json").write_text(json.dumps(SIMPLE))
    (tmp_path / "plan.toml").write_text('[[step]]\nname = "stroke"\noutput = "stroke"\nseconds = 3.0\n')
    files = paths(folder)[1:]
    given = ["--plan", str(tmp_path / "plan.toml"), "-o", str(tmp_path / "page.html"), "--json"]
    more = ["--simplified", str(tmp_path / "smaller.json"), "--beside", str(folder / "model.json")]
    assert main(["study", "complexity", str(tmp_path / "simple.json"), *files, *given, *more]) == 0
    answer = said(capsys)
    assert json.loads((tmp_path / "smaller.json").read_text()) == answer["simplified"]
    beside = [json.loads((folder / "model.json").read_text())]
    asked = ComplexityRequest(kind="complexity", model=dict(SIMPLE), plan=dict(PLAN), beside=beside, runs=["a"])
    task = Task(request=asked.options, runs=tuple(Path(p) for p in files), held_out=())
    COMPLEXITY.check(task)
    result = COMPLEXITY.run(task, tmp_path, lambda done, text: None)
    assert result["indicators"] == answer["indicators"]
    assert {name for name in COMPLEXITY.files if (tmp_path / name).exists()} == set(COMPLEXITY.files)
    found = dr.study.complexity(tmp_path / "simple.json", [read_run(Path(p)) for p in files], PLAN)
    assert found.rows() == answer["indicators"]
    assert found.model.ids == found.result.simplified.ids
    assert "stroke" in found._repr_html_()


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        ('[[step]]\nname = "comfort"\n', ["output", "missing"]),
        ('[[step]]\nname = "comfort"\noutput = "noise"\n', ["output", "noise", "stroke"]),
        ("matters = 0.1\n", ["step", "missing"]),
    ],
)
def test_a_plan_that_cannot_be_right_is_refused_in_one_line(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], plan: str, words: list[str]
) -> None:
    (tmp_path / "plan.toml").write_text(plan)
    given = ["--plan", str(tmp_path / "plan.toml"), "-o", str(tmp_path / "page.html")]
    assert main(["study", "complexity", *paths(folder), *given]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(word in error for word in words), error
    assert not (tmp_path / "page.html").exists()


def test_an_empty_feasible_set_states_no_uncertainty(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty = {"study": "exploration", "parameters": [{"name": "arctan_damping.S"}], "feasible_set": []}
    (tmp_path / "empty.json").write_text(json.dumps(empty))
    (tmp_path / "plan.toml").write_text('[[step]]\nname = "stroke"\noutput = "stroke"\n')
    given = ["--plan", str(tmp_path / "plan.toml"), "-o", str(tmp_path / "page.html")]
    assert main(["study", "complexity", *paths(folder), *given, "--feasible", str(tmp_path / "empty.json")]) == 2
    assert "0 feasible samples" in capsys.readouterr().err


def test_the_training_runs_of_a_chart_are_all_taken_as_such_and_the_job_and_the_notebook_say_the_same(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    service, *trained = paths(folder)[1:]
    (tmp_path / "rig.toml").write_text("[motion]\nmax_displacement = 0.0005\nmax_velocity = 9.0\n")
    given = ["--trained", *trained, "--envelope", str(tmp_path / "rig.toml"), "-o", str(tmp_path / "chart.html")]
    assert main(["study", "range", service, *given, "--json"]) == 0
    answer = said(capsys)
    assert answer["service"]["name"] == "run_0.h5"
    asked = RangeRequest(
        kind="range",
        runs=["a"],
        trained=["b", "c"],
        envelope={"motion": {"max_displacement": 0.0005, "max_velocity": 9.0}},
    )
    task = Task(request=asked.options, runs=(Path(service),), held_out=tuple(Path(p) for p in trained))
    RANGE.check(task)
    result = RANGE.run(task, tmp_path, lambda done, text: None)
    assert {name for name in RANGE.files if (tmp_path / name).exists()} == set(RANGE.files)
    rig = read_envelope(tmp_path / "rig.toml")
    found = dr.study.range(read_run(Path(service)), [read_run(Path(p)) for p in trained], envelope=rig).data()
    for one in (result, found):
        assert {key: one[key] for key in ("trained", "limits", "share_outside_training")} == {
            key: answer[key] for key in ("trained", "limits", "share_outside_training")
        }
    assert answer["limits"][0]["share_outside"] > 0.1


def test_a_run_against_the_clock_is_a_page_a_job_and_an_object(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, page = Path("examples/models/passive.json"), tmp_path / "clock.html"
    assert main(["study", "realtime", str(model), "--seconds", "0.5", "-o", str(page), "--json"]) == 0
    answer = said(capsys)
    assert "Duration of each step" in page.read_text(encoding="utf-8")
    asked = RealtimeRequest(kind="realtime", model=json.loads(model.read_text()), seconds=0.5)
    task = Task(request=asked.options, runs=(), held_out=())
    REALTIME.check(task)
    result = REALTIME.run(task, tmp_path, lambda done, text: None)
    assert {name for name in REALTIME.files if (tmp_path / name).exists()} == set(REALTIME.files)
    found = dr.study.realtime(model, seconds=0.5)
    for one in (answer, found.data()):
        assert {key: one[key] for key in ("steps", "recovery", "finite")} == {
            key: result[key] for key in ("steps", "recovery", "finite")
        }
    assert found.save(tmp_path / "notebook.html").stat().st_size > 1000


@pytest.mark.parametrize(
    ("change", "words"),
    [({"step": 0.0}, "step is 0 s"), ({"stroke": -1.0}, "stroke is -1 m"), ({"seconds": 1e9}, r"seconds is 1e\+09")],
)
def test_a_run_against_the_clock_that_cannot_begin_is_refused(change: dict[str, float], words: str) -> None:
    model = json.loads(Path("examples/models/passive.json").read_text())
    with pytest.raises((DataError, InputError), match=words):
        REALTIME.check(
            Task(request=RealtimeRequest(kind="realtime", model=model, **change).options, runs=(), held_out=())  # type: ignore[arg-type]
        )
