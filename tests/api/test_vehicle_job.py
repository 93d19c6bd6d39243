"""The job ``vehicle`` and the notebook's functions give what the command line gives."""

from __future__ import annotations

import json
import os
from contextlib import closing
from pathlib import Path

import httpx
import pytest

import damper_rig as dr
from api.cli.main import main
from api.jobs.__main__ import _do
from api.jobs.kind import Task
from api.jobs.records import Job, JobState
from api.jobs.results import Results, remove_old_results
from api.jobs.store import JobStore
from api.jobs.vehicle import VEHICLE, VehicleRequest
from api.store.database import Database
from identification.studies.journal import kept
from tests.api.following import get, reached

MODEL = Path("examples/models/passive.json")
KEYS = {"seconds": 5.0, "period": 2.0, "road_class": "B"}
CONFIG = 'seconds = 5.0\nperiod = 2.0\nroad_class = "B"\n'


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_notebook_drives_a_model_and_asks_what_an_effect_is_worth(tmp_path: Path) -> None:
    found = dr.study.vehicle([MODEL], KEYS)
    assert "weighted acceleration" in repr(found)
    assert found.save(tmp_path / "page.html").stat().st_size > 1000
    assert found.data()["answers"][0]["figures"]
    worth = dr.study.worth("examples/models/railway.json", without=["series_compliance"], asked=KEYS)
    assert "series_compliance" in worth.sentence
    assert "in this vehicle" in worth._repr_html_()
    assert dr.study.realtime(MODEL, 0.001, seconds=0.5)["worst"] > 0.0


@pytest.mark.slow
def test_a_job_that_is_sent_again_goes_on_where_it_was_interrupted(tmp_path: Path) -> None:
    asked = VehicleRequest(
        kind="vehicle", models=[json.loads(MODEL.read_text())], study=KEYS | {"step": 0.004, "sines": [2.0, 3.0]}
    )
    [task, again] = [job_of(asked, number) for number in (1, 2)]
    journal = Results(tmp_path).journal(task)
    assert Results(tmp_path).journal(again) == journal
    journal.parent.mkdir()

    def interrupt(done: float, text: str) -> None:
        if done > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), kept(journal):
        VEHICLE.run(Task(request=asked.options, runs=(), held_out=()), tmp_path, interrupt)
    assert journal.stat().st_size > 1000
    given = {"kind": "vehicle", "request": asked.options, "runs": [], "held_out": [], "folder": str(tmp_path / "b")}
    result = _do(given | {"journal": str(journal)})
    assert not journal.exists()
    whole = VEHICLE.run(Task(request=asked.options, runs=(), held_out=()), tmp_path, lambda done, text: None)
    assert result == whole


def job_of(asked: VehicleRequest, number: int) -> Job:
    return Job(
        number=number, id=f"{number}", kind="vehicle", name="", campaign_id="", request=asked.options, result={},
        state=JobState.ACCEPTED, phase="", done=0.0, reason="", created_at_s=float(number), started_at_s=None,
        ended_at_s=None, removed_at_s=None,
    )  # fmt: skip


def test_what_an_interrupted_job_has_kept_goes_when_it_is_as_old_as_results_that_go(tmp_path: Path) -> None:
    (tmp_path / "journals").mkdir()
    old, young = (tmp_path / "journals" / f"{name}.journal" for name in ("old", "young"))
    for one in (old, young):
        one.write_bytes(b"")
    os.utime(old, (0.0, 0.0))
    with closing(Database(f"sqlite:///{tmp_path / 'store.db'}")) as database:
        remove_old_results(JobStore(database), Results(tmp_path), keep_s=1000.0)
    assert (old.exists(), young.exists()) == (False, True)
