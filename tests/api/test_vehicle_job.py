"""The job ``vehicle`` and the notebook's functions give what the command line gives."""

from __future__ import annotations

import json
from pathlib import Path

import httpx
import pytest

import damper_rig as dr
from api.cli.main import main
from tests.api.following import get, reached

MODEL = Path("examples/models/passive.json")
KEYS = {"seconds": 5.0, "period": 2.0, "road_class": "B"}
CONFIG = 'seconds = 5.0\nperiod = 2.0\nroad_class = "B"\n'


def test_a_vehicle_job_needs_no_runs_and_answers_as_the_command(
    base: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    body = {"kind": "vehicle", "models": [json.loads(MODEL.read_text())], "vehicle": "car", "study": KEYS}
    answer = httpx.post(f"{base}/v1/jobs", json=body, timeout=120)
    assert answer.status_code == 201, answer.text
    job = reached(base, answer.headers["location"], lambda one: one["ended"] is not None, 300.0)
    assert job["state"] == "done", job
    (tmp_path / "study.toml").write_text(CONFIG)
    page = tmp_path / "study.html"
    given = [str(MODEL), "--config", str(tmp_path / "study.toml"), "-o", str(page), "--json"]
    assert main(["study", "vehicle", *given]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["answers"] == job["result"]["answers"] == get(base, job["files"]["study.json"])["answers"]
    assert set(job["files"]) == {"study.html", "study.json"}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"vehicle": "ship"}, "vehicle is 'ship': use car, seat, bogie"),
        ({"study": {"sped": 1.0}}, "sped"),
        ({"models": []}, "models has 0 entries"),
        ({"without": ["nothing"]}, "has no element 'nothing'"),
        ({"vehicle": "seat"}, "does not depend on a current"),
    ],
)
def test_a_vehicle_job_that_cannot_begin_is_refused_when_it_is_sent(
    base: str, change: dict[str, object], said: str
) -> None:
    body = {"kind": "vehicle", "models": [json.loads(MODEL.read_text())]} | change
    answer = httpx.post(f"{base}/v1/jobs", json=body, timeout=120)
    assert answer.status_code in (400, 422), answer.text
    assert said in answer.text


def test_a_notebook_drives_a_model_and_asks_what_an_effect_is_worth(tmp_path: Path) -> None:
    found = dr.study.vehicle([MODEL], KEYS)
    assert "weighted acceleration" in repr(found)
    assert found.save(tmp_path / "page.html").stat().st_size > 1000
    assert found.data()["answers"][0]["figures"]
    worth = dr.study.worth("examples/models/railway.json", without=["series_compliance"], asked=KEYS)
    assert "series_compliance" in worth.sentence
    assert "in this vehicle" in worth._repr_html_()
    assert dr.study.realtime(MODEL, 0.001, seconds=0.5)["worst"] > 0.0
