"""Explaining over HTTP: the service whole, its job a process of its own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.cli.main import main
from api.jobs.held_job import LEFT_OPEN
from tests.api.browser import browser
from tests.api.following import ended as campaign_ended
from tests.api.following import get, post, reached, until
from tests.api.measured import MODEL, NAMES, sent
from tests.starting import Started


def asked(base: str, body: dict[str, Any]) -> httpx.Response:
    return httpx.post(f"{base}/v1/explanations", json=body, timeout=120)


def ended(base: str, explanation_id: str, within_s: float = 300.0) -> dict[str, Any]:
    return reached(base, f"/v1/explanations/{explanation_id}", lambda one: one["ended"] is not None, within_s)


def test_uploaded_runs_are_explained_as_on_the_command_line(base: str, folder: Path, tmp_path: Path) -> None:
    ids = [sent(base, folder / name) for name in NAMES]
    answer = asked(base, {"model": MODEL, "runs": ids[:3], "held_out": ids[3:]})
    assert answer.status_code == 201, answer.text
    assert answer.json()["report"] is None
    early = httpx.get(f"{base}/v1/explanations/{answer.json()['id']}/report.json", timeout=60)
    assert early.status_code in (200, 409)
    done = ended(base, answer.json()["id"])
    assert (done["state"], done["verdict"], done["done"]) == ("done", "explained", 1.0)
    assert [e["element"] for e in done["effects"]] == ["coulomb_friction"]
    paths = [str(folder / name) for name in NAMES]
    given = [str(folder / "model.json"), *paths[:3], "--held-out", paths[3]]
    assert main(["explain", *given, "-o", str(tmp_path / "report")]) == 0
    assert get(base, done["report"]) == json.loads((tmp_path / "report" / "report.json").read_text())
    assert get(base, done["model"]) == json.loads((tmp_path / "report" / "model.json").read_text())
    page = httpx.get(base + done["report_html"], timeout=60)
    assert page.headers["content-type"].startswith("text/html")
    assert "Coulomb friction" in page.text
    downloaded = tmp_path / "downloaded"
    downloaded.mkdir()
    for name, route in (("report.json", done["report"]), ("evidence.h5", done["evidence"])):
        (downloaded / name).write_bytes(httpx.get(base + route, timeout=60).content)
    assert main(["report", str(downloaded)]) == 0
    assert (downloaded / "report.html").read_text(encoding="utf-8") == page.text
    assert done in get(base, "/v1/explanations")["explanations"]
    late = httpx.post(f"{base}/v1/explanations/{done['id']}/cancel", timeout=60)
    assert (late.status_code, late.json()["detail"].count(done["id"])) == (409, 1)


def test_what_the_command_line_refuses_is_refused_in_its_words_before_it_is_accepted(
    base: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = get(base, "/v1/explanations")
    answer = asked(base, {"model": MODEL, "runs": [sent(base, folder / n) for n in (NAMES[0], "reversed.h5")]})
    assert answer.status_code == 422
    paths = [str(folder / n) for n in (NAMES[0], "reversed.h5")]
    assert main(["explain", str(folder / "model.json"), *paths, "-o", str(tmp_path / "report")]) == 2
    assert capsys.readouterr().err == f"damper-rig: {answer.json()['detail']}\n"
    assert get(base, "/v1/explanations") == before


@pytest.mark.parametrize(
    ("change", "status", "words"),
    [
        ({"runs": []}, 422, ["at least one measured run"]),
        ({"runs": ["nobody"]}, 404, ["nobody"]),
        ({"runs": [], "campaign": "nobody"}, 404, ["nobody"]),
        ({"runs": [], "rig": "modbus://127.0.0.1:9"}, 422, ["modbus://127.0.0.1:9", "no complete training run"]),
        ({"campaign": "x"}, 422, ["campaign and runs"]),
        ({"specimen": "x"}, 422, ["specimen goes with rig"]),
        ({"simulated": True}, 422, ["either a model"]),
        ({"model": None}, 422, ["either a model"]),
        ({"model": {**MODEL, "kind": "spline"}}, 422, ["model: kind is 'spline'"]),
        ({"runz": []}, 422, ["runz", "not a known key", "held_out"]),
    ],
)
def test_a_wrong_question_is_refused_in_one_line(
    base: str, change: dict[str, Any], status: int, words: list[str]
) -> None:
    answer = asked(base, {"model": MODEL, "runs": ["x"], **change})
    assert answer.status_code == status, answer.text
    detail = answer.json()["detail"]
    assert "\n" not in detail
    assert all(word in detail for word in words), detail


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("torn.h5", b"not HDF5", ["torn.h5: damaged or not an HDF5 file"]),
        ("empty.h5", b"", ["empty.h5: damaged"]),
        ("../up.h5", b"x", ["'../up.h5'", "letters"]),
        ("run.csv", b"x", ["'run.csv'"]),
    ],
)
def test_a_file_that_is_no_run_is_refused_and_not_kept(
    base: str, lab: Path, name: str, content: bytes, words: list[str]
) -> None:
    before = sorted(lab.rglob("*.h5"))
    answer = httpx.post(f"{base}/v1/runs", params={"name": name}, content=content, timeout=60)
    assert answer.status_code == 422
    assert all(word in answer.json()["detail"] for word in words), answer.text
    assert sorted(lab.rglob("*.h5")) == before


@pytest.mark.slow
def test_an_explanation_that_runs_or_waits_can_be_cancelled(base: str, folder: Path) -> None:
    body = {"model": MODEL, "runs": [sent(base, folder / name) for name in NAMES]}
    running, waiting = (asked(base, body).json()["id"] for _ in range(2))
    for one in (waiting, running):
        assert httpx.post(f"{base}/v1/explanations/{one}/cancel", timeout=60).status_code == 202
    assert [ended(base, one)["state"] for one in (running, waiting)] == ["cancelled", "cancelled"]
    answer = httpx.get(f"{base}/v1/explanations/{running}/report.html", timeout=60)
    assert answer.status_code == 409
    assert "over HTTP" in answer.json()["detail"]


@pytest.mark.slow
def test_work_begins_anew_after_a_stop_of_the_service_and_is_said_to_be_lost_after_kill_9(
    service: Started, folder: Path, tmp_path: Path
) -> None:
    body = {"model": MODEL, "runs": [sent(service.url, folder / name) for name in NAMES]}
    one = str(asked(service.url, body).json()["id"])
    reached(service.url, f"/v1/explanations/{one}", lambda one: one["phase"])
    assert service.stop() == 0
    arguments = ["serve", "--data", str(tmp_path / "lab"), "--port", "0"]
    with Started(arguments, tmp_path / "again.log") as second:
        reached(second.wait_until_ready(), f"/v1/explanations/{one}", lambda one: one["phase"])
        second.kill()
    with Started(arguments, tmp_path / "third.log") as third:
        left = ended(third.wait_until_ready(), one)
    assert (left["state"], left["reason"], left["report"]) == ("failed", LEFT_OPEN, None)


@pytest.mark.slow
@pytest.mark.browser
def test_a_test_engineer_asks_in_the_browser_and_reads_the_report(
    service: Started, fresh_rig: str, chromium: Path, tmp_path: Path
) -> None:
    sine = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "cycles": 3, "current": 0.8}
    tests = [{"name": "sine", **sine}, {"name": "faster", **sine, "frequency": 3.0, "held_out": True}]
    campaign = post(service.url, {"name": "check", "rig": fresh_rig, "specimen": "damper 7", "tests": tests})
    until(service.url, campaign["id"], campaign_ended)
    (tmp_path / "model.json").write_text(json.dumps(MODEL))
    with browser(chromium, tmp_path / "profile") as page:
        page.open(service.url + "/")
        page.wait_for("document.querySelector('#ask') && !document.querySelector('#ask').disabled")
        document = page.call("DOM.getDocument")["root"]["nodeId"]
        field = page.call("DOM.querySelector", nodeId=document, selector="#model")["nodeId"]
        page.call("DOM.setFileInputFiles", nodeId=field, files=[str(tmp_path / "model.json")])
        page.evaluate("document.querySelector('#ask').click()")
        page.wait_for("document.querySelectorAll('#explanations a').length === 4", within_s=300.0)
        page.evaluate("document.querySelector('#explanations').scrollIntoView()")
        assert len(page.picture(tmp_path / "page.png")) > 20_000
        link = page.evaluate("document.querySelector('#explanations a').href")
        page.open(link)
        page.wait_for("document.querySelectorAll('.verdict, .js-plotly-plot').length > 1")
        assert page.complaints == []
