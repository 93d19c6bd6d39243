"""Jobs of every kind over HTTP, and the process of a job."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.cli.main import main
from api.jobs.kinds import KINDS
from api.jobs.process import JobProcess
from identification.physical.modelfile import model_to_json
from rigctl.runfile import write_run
from tests.api.following import get, reached
from tests.api.measured import MODEL, NAMES, a_run, sent
from tests.identification.maxwell_runs import VARIED, maxwell, sine_runs
from tests.identification.multisine_runs import multisine_run

FIGURES = ("kind", "parameters", "free_parameters", "rms", "rrmsse", "fit", "eearth")  # all but the cost, which varies


def submit(base: str, body: dict[str, Any]) -> httpx.Response:
    return httpx.post(f"{base}/v1/jobs", json=body, timeout=300)


def done(base: str, body: dict[str, Any]) -> dict[str, Any]:
    answer = submit(base, body)
    assert answer.status_code == 201, answer.text
    assert (answer.json()["kind"], answer.json()["files"]) == (body["kind"], {})
    path = answer.headers["location"]
    ended = reached(base, path, lambda job: job["ended"] is not None, 300.0)
    assert ended["state"] == "done", ended
    assert list(ended["files"].values()) == [f"{path}/files/{name}" for name in KINDS[body["kind"]].files]
    return ended


def test_a_fit_is_that_of_the_command_line(base: str, folder: Path, tmp_path: Path) -> None:
    job = done(base, {"kind": "fit", "model": MODEL, "runs": [sent(base, folder / name) for name in NAMES[:3]]})
    assert job["name"] == "fit of as simulated"
    paths = [str(folder / name) for name in ("model.json", *NAMES[:3])]
    assert main(["fit", *paths, "-o", str(tmp_path / "fitted.json")]) == 0
    assert get(base, job["files"]["model.json"]) == json.loads((tmp_path / "fitted.json").read_text())
    assert job["result"]["converged"] is True
    assert job["result"]["gap_n"] > 0.0
    assert job in get(base, "/v1/jobs?kind=fit")["jobs"]
    assert get(base, "/v1/explanations") == {"explanations": [], "next_before": None, "next_cursor": None}


@pytest.mark.slow
def test_a_flood_of_jobs_is_sent_away_and_everybody_else_is_answered(base: str, folder: Path) -> None:
    body = {"kind": "characterise", "runs": [sent(base, folder / NAMES[0])]}
    with ThreadPoolExecutor(8) as pool:
        flood = [pool.submit(submit, base, body) for _ in range(8)]
        assert httpx.get(f"{base}/v1/rigs", timeout=120).status_code == 200
        answers = [one.result() for one in flood]
    assert {one.status_code for one in answers} == {201, 503}, [one.text for one in answers]
    assert all(int(one.headers["retry-after"]) > 0 for one in answers if one.status_code == 503)


@pytest.mark.slow
def test_a_sheet_is_that_of_the_command_line(
    base: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job = done(base, {"kind": "characterise", "name": "sheet", "runs": [sent(base, folder / n) for n in NAMES]})
    assert (job["name"], len(job["result"]["tests"])) == ("sheet", 4)
    page = httpx.get(base + job["files"]["sheet.html"], timeout=60)
    assert page.headers["content-type"].startswith("text/html")
    given = [*(str(folder / n) for n in NAMES), "-o", str(tmp_path / "sheet.html"), "--json"]
    assert main(["characterise", *given]) == 0
    assert json.loads(capsys.readouterr().out)["tests"] == job["result"]["tests"]
    assert all(name in page.text for name in NAMES)


@pytest.mark.slow
def test_an_analysis_is_that_of_the_command_line(
    base: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "multisine.h5"
    write_run(path, multisine_run())
    job = done(base, {"kind": "analyse", "runs": [sent(base, path)]})
    assert set(job["files"]) == {"analysis.html", "analysis.json"}
    assert main(["analyse", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["force"] == job["result"]["force"]
    both = done(base, {"kind": "analyse", "runs": [sent(base, path), sent(base, folder / NAMES[0])]})
    assert len(both["result"]["levels"]) == 2  # a sine beside the multisine
    write_run(tmp_path / "once.h5", replace(multisine_run(), period_samples=0, channels=_half_a_period()))
    refused = submit(base, {"kind": "analyse", "runs": [sent(base, tmp_path / "once.h5")]})
    assert (refused.status_code, "no period" in refused.text) == (422, True), refused.text


def _half_a_period() -> dict[str, Any]:
    return {name: values[:500] for name, values in multisine_run().channels.items()}


@pytest.mark.slow
def test_an_exploration_is_a_job_with_a_page_and_its_figures(base: str, tmp_path: Path) -> None:
    runs = []
    for k, run in enumerate(sine_runs(maxwell())):
        write_run(tmp_path / f"{k}.h5", run)
        runs.append(sent(base, tmp_path / f"{k}.h5"))
    study = {"samples": 16, "points": 200, "vary": list(VARIED)}
    body = {"kind": "explore", "model": model_to_json(maxwell()), "study": study, "runs": runs}
    job = done(base, body)
    assert job["result"]["samples"] == 16
    assert get(base, job["files"]["exploration.json"])["feasible"] == job["result"]["feasible"]
    nothing = submit(base, {**body, "study": {"vary": ["nothing.k"]}})
    assert (nothing.status_code, "has no parameter 'nothing.k'" in nothing.text) == (422, True)


@pytest.mark.slow
def test_a_comparison_is_that_of_the_command_line(
    base: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = [folder / "model.json", tmp_path / "stiffer.json"]
    models = [
        MODEL,
        {**MODEL, "name": "stiffer", "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 700.0}}]}},
    ]
    paths[1].write_text(json.dumps(models[1]))
    sent_runs = [sent(base, folder / n) for n in NAMES[:2]]
    job = done(base, {"kind": "compare", "models": models, "runs": sent_runs, "rate_hz": 500.0})
    assert job["name"] == "comparison of 2 models"
    runs = [str(folder / name) for name in NAMES[:2]]
    given = [*map(str, paths), "--runs", *runs, "-o", str(tmp_path / "comparison.html"), "--rate", "500", "--json"]
    assert main(["compare", *given]) == 0
    here, there = json.loads(capsys.readouterr().out), get(base, job["files"]["comparison.json"])
    assert there["runs"] == here["runs"]
    assert {one["sample_rate"] for one in here["runs"]} == {500.0}
    for sent_model, given_model in zip(there["models"], here["models"], strict=True):
        assert {key: sent_model[key] for key in FIGURES} == {key: given_model[key] for key in FIGURES}
    assert job["result"]["models"][1] == {"model": "stiffer"} | {
        k: there["models"][1][k] for k in ("rms", "fit", "eearth")
    }
    page = httpx.get(base + job["files"]["comparison.html"], timeout=60)
    assert page.headers["content-type"].startswith("text/html")
    assert "stiffer" in page.text


def test_an_explanation_can_be_seen_and_cancelled_as_a_job(base: str, folder: Path) -> None:
    body = {"kind": "explain", "model": MODEL, "runs": [sent(base, folder / name) for name in NAMES]}
    job = submit(base, body).json()
    assert httpx.post(f"{base}/v1/jobs/{job['id']}/cancel", timeout=60).status_code == 202
    ended = reached(base, f"/v1/explanations/{job['id']}", lambda one: one["ended"] is not None)
    assert (ended["state"], ended["runs"]) == ("cancelled", body["runs"])
    answer = httpx.get(f"{base}/v1/jobs/{job['id']}/files/report.json", timeout=60)
    assert (answer.status_code, "over HTTP" in answer.json()["detail"]) == (409, True)
    answer = httpx.get(f"{base}/v1/jobs/{job['id']}/files/sheet.html", timeout=60)
    assert (answer.status_code, "it has report.json" in answer.json()["detail"]) == (404, True)


@pytest.mark.parametrize(
    ("body", "status", "words"),
    [
        ({"runs": ["x"]}, 422, ["kind is missing", "explain, fit, characterise, compare, identify"]),
        ({"kind": "export", "runs": ["x"]}, 422, ["kind is 'export'", "explain, fit, characterise, compare, identify"]),
        ({"kind": 7}, 422, ["kind is", "explain, fit, characterise, compare, identify"]),
        ({"kind": "fit", "runs": ["x"]}, 422, ["model is missing"]),
        ({"kind": "fit", "model": MODEL, "runs": []}, 422, ["at least one measured run"]),
        ({"kind": "fit", "model": MODEL, "runs": ["nobody"]}, 404, ["nobody"]),
        ({"kind": "fit", "model": MODEL, "runs": ["x"], "starts": 0}, 422, ["starts is 0"]),
        ({"kind": "fit", "model": MODEL, "runs": ["x"], "robust": -1.0}, 422, ["robust is -1"]),
        ({"kind": "fit", "model": {**MODEL, "kind": "spline"}, "runs": ["x"]}, 422, ["model: kind is 'spline'"]),
        ({"kind": "fit", "model": MODEL, "held_out": ["x"]}, 422, ["held_out", "not a known key", "starts"]),
        ({"kind": "characterise", "rig": "x", "runs": ["x"]}, 422, ["rig and runs"]),
        ({"kind": "characterise", "model": MODEL}, 422, ["model", "not a known key", "specimen"]),
        ({"kind": "compare", "runs": ["x"]}, 422, ["models is missing"]),
        ({"kind": "compare", "models": [], "runs": ["x"]}, 422, ["models has 0 entries"]),
        ({"kind": "compare", "models": [MODEL, {**MODEL, "kind": "fmu"}], "runs": ["x"]}, 422, ["models.1: kind is"]),
        ({"kind": "compare", "models": [MODEL], "runs": ["nobody"]}, 404, ["nobody"]),
        ({"kind": "compare", "models": [MODEL]}, 422, ["at least one measured run"]),
        ({"kind": "explore", "model": MODEL, "study": {"samples": 0}, "runs": ["x"]}, 422, ["samples is 0"]),
        ({"kind": "sensitivity", "model": MODEL, "study": {"level": 2}, "runs": ["x"]}, 422, ["level", "levels"]),
        ({"kind": "complexity", "model": MODEL, "plan": {"step": []}, "runs": ["x"]}, 422, ["no step"]),
    ],
)
def test_a_wrong_request_is_refused_in_one_line(base: str, body: dict[str, Any], status: int, words: list[str]) -> None:
    before = get(base, "/v1/jobs")
    answer = submit(base, body)
    assert answer.status_code == status, answer.text
    assert "\n" not in answer.json()["detail"]
    assert all(word in answer.json()["detail"] for word in words), answer.text
    assert get(base, "/v1/jobs") == before


@pytest.mark.parametrize("path", ["/v1/jobs/nobody", "/v1/jobs/nobody/files/x", "/v1/jobs?limit=0"])
def test_what_is_not_there_is_said_in_one_line(base: str, path: str) -> None:
    answer = httpx.get(base + path, timeout=60)
    assert answer.status_code in (404, 422)
    assert "\n" not in answer.json()["detail"]


def test_what_the_command_line_refuses_is_refused_before_it_is_accepted(
    base: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_run(tmp_path / "one.h5", a_run(9, 2.0))
    fixed = {"value": 600.0, "fixed": True}
    model = {**MODEL, "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": fixed}}]}}
    answer = submit(base, {"kind": "fit", "model": model, "runs": [sent(base, tmp_path / "one.h5")]})
    assert answer.status_code == 422
    (tmp_path / "model.json").write_text(json.dumps(model))
    given = [str(tmp_path / "model.json"), str(tmp_path / "one.h5")]
    assert main(["fit", *given, "-o", str(tmp_path / "fitted.json")]) == 2
    assert capsys.readouterr().err == f"damper-rig: {answer.json()['detail']}\n"


def test_the_description_for_programs_types_every_kind(base: str) -> None:
    schema = get(base, "/openapi.json")
    body = schema["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]["application/json"]["schema"]
    assert set(body["discriminator"]["mapping"]) == set(KINDS)
    fit = schema["components"]["schemas"][body["discriminator"]["mapping"]["fit"].rsplit("/", 1)[1]]
    assert {"model", "starts", "robust", "refine", "runs"} <= set(fit["properties"])
    page = httpx.get(f"{base}/docs", timeout=60).text
    typed = {"fit": "starts: integer", "explain": "held_out: array of string", "compare": "models: array of object"}
    for kind, words in typed.items():
        assert f"kind: {kind}" in page
        assert words in page


def test_a_process_that_is_killed_is_said_to_have_ended_without_an_answer(folder: Path, tmp_path: Path) -> None:
    request = {"model": MODEL, "runs": ["x"], "held_out": []}
    with JobProcess("explain", request, [folder / NAMES[0]], [], folder=tmp_path / "report") as process:
        os.kill(process.pid, signal.SIGKILL)
        assert process.ended(60.0)
        failure = process.answer().failure
        assert "ended without an answer (-9): it was killed, most often because the memory" in failure


@pytest.mark.skipif(not hasattr(os, "getpriority"), reason="priorities are those of POSIX")
def test_a_job_runs_at_lower_priority_than_rig_control(folder: Path, tmp_path: Path) -> None:
    request = {"model": MODEL, "runs": ["x"], "held_out": []}
    paths = [folder / name for name in NAMES]
    with JobProcess("explain", request, paths, [], folder=tmp_path / "report") as process:
        while process.progress[1] == "starting":
            assert not process.ended(0.05)
        assert os.getpriority(os.PRIO_PROCESS, process.pid) > os.getpriority(os.PRIO_PROCESS, 0)


def test_a_service_that_loads_every_kind_loads_none_of_their_work() -> None:
    heavy = tuple(f"identification.{name}" for name in ("discrepancy", "fitting", "sheet", "models.comparison_page"))
    code = f"import sys, api.jobs.kinds; print([name for name in {heavy} if name in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"
