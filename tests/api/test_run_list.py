"""Runs are listed by what they are, read in parts, and removed; designs and models are stored and named."""

from __future__ import annotations

import asyncio
import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from api.app import create_app
from api.campaigns.samples import samples_of
from api.processes.run_reader import RunReader
from api.settings import Settings
from api.store.designs import DesignStore
from excitation.errors import ExcitationFileError
from rigctl.runfile import read_run
from tests.api.following import ended as has_ended
from tests.api.following import reached
from tests.api.measured import MODEL, NAMES
from tests.api.serving import serving
from tests.hostile_files import HOSTILE

SINE = {"name": "a", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2}
BINARY = {"content-type": "application/octet-stream"}


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> FastAPI:
    return create_app(Settings(data_dir=tmp_path_factory.mktemp("lab")), with_workers=False)


@pytest.fixture(scope="module")
def client(app: FastAPI) -> Iterator[httpx.Client]:
    with serving(app) as client:
        yield client


@pytest.fixture(scope="module")
def uploaded(client: httpx.Client, folder: Path) -> list[str]:
    """Ids of four uploaded runs, in order."""
    ids = []
    for name in NAMES:
        answer = client.post(f"/v1/runs?name={name}", content=(folder / name).read_bytes(), headers=BINARY)
        assert answer.status_code == 201, answer.text
        ids.append(answer.json()["id"])
    return ids


def listed(answer: httpx.Response) -> list[str]:
    assert answer.status_code == 200, answer.text
    return [run["id"] for run in answer.json()["runs"]]


def test_runs_are_listed_in_pages_and_by_what_they_are(client: httpx.Client, uploaded: list[str]) -> None:
    page = client.get("/v1/runs?limit=3")
    seen = listed(page)
    while "next" in page.links:
        page = client.get(page.links["next"]["url"])
        seen += listed(page)
    assert seen == uploaded[::-1]
    [specimen] = client.get("/v1/specimens").json()["specimens"]
    assert specimen["runs"] == 4
    assert listed(client.get("/v1/runs", params={"specimen": specimen["name"]})) == uploaded[::-1]
    for query in (
        "specimen=nobody",
        "rig=nobody",
        "status=aborted",
        "test=none",
        "until=2001-01-01",
        "since=2999-01-01",
    ):
        assert listed(client.get(f"/v1/runs?{query}")) == []
    assert client.get("/v1/runs?since=yesterday").status_code == 422


def test_a_file_has_its_sha256_as_etag_and_is_read_in_ranges(
    client: httpx.Client, uploaded: list[str], folder: Path
) -> None:
    record = client.get(f"/v1/runs/{uploaded[0]}").json()
    whole = client.get(record["file"])
    assert whole.content == (folder / NAMES[0]).read_bytes()
    assert whole.headers["etag"] == f'"{record["sha256"]}"'
    assert client.get(record["file"], headers={"If-None-Match": whole.headers["etag"]}).status_code == 304
    part = client.get(record["file"], headers={"Range": "bytes=8-15", "If-Range": whole.headers["etag"]})
    assert (part.status_code, part.content) == (206, whole.content[8:16])


def test_reduced_data_keep_every_peak_and_ranges_are_the_samples(
    client: httpx.Client, uploaded: list[str], folder: Path
) -> None:
    run = read_run(folder / NAMES[0])
    force = run.channels["force"]
    few = client.get(f"/v1/runs/{uploaded[0]}/data?channels=force&points=7").json()
    assert len(few["time_s"]) <= 7
    assert max(few["channels"]["force"]["highest"]) == force.max()
    assert min(few["channels"]["force"]["lowest"]) == force.min()
    part = client.get(f"/v1/runs/{uploaded[0]}/data?channels=force,displacement&from=10&to=20").json()
    assert part["channels"]["force"]["lowest"] == part["channels"]["force"]["highest"] == force[10:20].tolist()
    assert part["time_s"] == (np.arange(10, 20) / run.sample_rate_hz).tolist()
    table = client.get(f"/v1/runs/{uploaded[0]}/data?channels=force&from=10&to=20&format=csv")
    assert table.headers["content-type"].startswith("text/csv")
    rows = list(csv.reader(io.StringIO(table.text)))
    assert rows[0] == ["time (s)", "force (N)"]
    assert [float(row[1]) for row in rows[1:]] == force[10:20].tolist()
    for wrong in ("channels=smell", "from=999999999", "from=20&to=10", "points=0"):
        assert client.get(f"/v1/runs/{uploaded[0]}/data?{wrong}").status_code == 422


@pytest.mark.parametrize("points", [1, 2, 3, 7, 100, 10_000])
def test_every_sample_lies_within_its_step(folder: Path, points: int) -> None:
    run = read_run(folder / NAMES[1])
    made = samples_of(run, (), 3, None, points)
    assert made.time_s.size <= points
    step = (np.arange(run.samples - 3)) // made.step
    for name, values in run.channels.items():
        assert np.all(made.lowest[name][step] <= values[3:])
        assert np.all(values[3:] <= made.highest[name][step])
        assert np.isin(made.highest[name], values).all()


def test_a_removed_run_leaves_its_record_and_a_run_in_use_is_not_removed(
    client: httpx.Client, app: FastAPI, uploaded: list[str], folder: Path
) -> None:
    content = (folder / NAMES[0]).read_bytes()
    run = client.post("/v1/runs?name=once.h5", content=content, headers=BINARY).json()["id"]
    job = app.state.service.jobs.create(
        kind="fit", name="uses it", campaign_id="", request={"runs": [run], "held_out": []}
    )
    refused = client.delete(f"/v1/runs/{run}")
    assert refused.status_code == 409
    assert job.id in refused.json()["detail"]
    client.post(f"/v1/jobs/{job.id}/cancel")
    assert client.delete(f"/v1/runs/{run}").status_code == 204
    assert client.get(f"/v1/runs/{run}").json()["removed"] is not None
    for path in ("file", "data"):
        assert client.get(f"/v1/runs/{run}/{path}").status_code == 410
    assert client.delete(f"/v1/runs/{run}").status_code == 410
    assert run not in listed(client.get("/v1/runs"))
    assert run in listed(client.get("/v1/runs?removed=true"))
    body = {"kind": "characterise", "runs": [run]}
    assert client.post("/v1/jobs", json=body).status_code == 410


def test_at_the_quota_nothing_is_uploaded_and_no_test_starts(tmp_path: Path, rig: str, body: dict[str, Any]) -> None:
    app = create_app(Settings(data_dir=tmp_path, runs_quota_gb=1e-9))
    with serving(app) as client:
        made = client.post("/v1/campaigns", json={**body, "rig": rig})
        assert made.status_code == 201, made.text
        ended = reached(str(client.base_url).rstrip("/"), made.headers["location"], has_ended)
        assert [test["state"] for test in ended["tests"]] == ["done", "skipped"]
        assert ended["state"] == "failed"
        assert "runs_quota_gb" in ended["reason"]
        for refused in (
            client.post("/v1/campaigns", json={**body, "rig": rig}),
            client.post("/v1/runs?name=x.h5", content=b"x", headers=BINARY),
        ):
            assert refused.status_code == 507
            assert "runs_quota_gb" in refused.json()["detail"]


def test_a_design_with_spoiled_detection_lines_is_stored_and_told_of(
    client: httpx.Client, body: dict[str, Any]
) -> None:
    lines = {"f_min": 0.5, "f_max": 20.0, "lines": "odd-random"}
    test = {
        "name": "both",
        "kind": "multisine",
        "sample_rate": 500.0,
        "period_samples": 1000,
        "displacement": {**lines, "max_displacement": 0.02, "max_velocity": 0.3},
        "current": {**lines, "lines": "all", "min": 0.2, "max": 1.2},
    }
    made = client.post("/v1/designs", json={"name": "spoiled", "tests": [SINE, test]})
    assert made.status_code == 201, made.text
    (warning,) = made.json()["warnings"]
    assert warning.startswith("both: current excites")
    base = {key: value for key, value in body.items() if key != "tests"}
    checked = client.post("/v1/campaigns/check", json={**base, "design": "spoiled"})
    assert checked.json()["warnings"] == [warning]
    test["current"] = {**lines, "min": 0.2, "max": 1.2}
    assert client.post("/v1/designs", json={"name": "kept", "tests": [test]}).json()["warnings"] == []


def test_a_campaign_plays_the_tests_of_a_stored_design(client: httpx.Client, body: dict[str, Any]) -> None:
    design = {"name": "matrix", "tests": [SINE, {**SINE, "name": "b", "held_out": True}], "warm_up": SINE}
    made = client.post("/v1/designs", json=design)
    assert made.status_code == 201, made.text
    assert client.post("/v1/designs", json=design).status_code == 409
    base = {key: value for key, value in body.items() if key != "tests"}
    campaign = client.post("/v1/campaigns", json={**base, "design": "matrix"})
    assert campaign.status_code == 201, campaign.text
    stored = client.get(campaign.headers["location"]).json()
    assert [test["name"] for test in stored["tests"]] == ["a", "b"]
    assert stored["warm_up"]["frequency"] == 4.0
    assert client.post("/v1/campaigns/check", json={**base, "design": made.json()["id"]}).status_code == 200
    assert client.post("/v1/campaigns", json={**base, "design": "none"}).status_code == 404
    assert client.post("/v1/campaigns", json={**body, "design": "matrix"}).status_code == 422
    assert client.delete("/v1/designs/matrix").status_code == 204
    assert client.get("/v1/designs/matrix").status_code == 404


def test_a_plan_file_is_a_design(client: httpx.Client, tmp_path: Path) -> None:
    from excitation import plan_from_config, write_plan

    plan = plan_from_config({"tests": [SINE, {**SINE, "name": "b", "dwell": 3.0}]})
    for ending in (".toml", ".csv", ".h5"):
        write_plan(tmp_path / f"plan{ending}", plan)
        content = (tmp_path / f"plan{ending}").read_bytes()
        made = client.post(f"/v1/designs/file?file=plan{ending}&name=of{ending}", content=content, headers=BINARY)
        assert made.status_code == 201, made.text
        found = client.get(made.headers["location"]).json()
        assert found["tests"] == ["a", "b"]
        assert found["configurations"][1]["dwell"] == 3.0
        wrong = client.post(f"/v1/designs/file?file=plan{ending}", content=b"\x00rubbish", headers=BINARY)
        assert wrong.status_code == 422
        assert "/tmp" not in wrong.text
    assert client.post("/v1/designs/file?file=../x.h5", content=b"x", headers=BINARY).status_code == 422


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"[[tests]]\nname = 2026-11-23\n", "not JSON serializable"),
        (b"[[tests]]\namplitude = nan\n", "NaN"),
        (b"x = " + b"[" * 50_000, "nested too deep"),
        (b"tests = 3\n", "must be a list"),
        (b"tests = []\n", "1 … 500"),
        (b"tests = []\nsecret = 1\n", "secret"),
        (b'[[tests]]\nname = "a"\nkind = "sine"\namplitude = -1.0\n', "sample_rate is missing"),
    ],
    ids=["a date", "no number", "deep", "no list", "no test", "a key that is not read", "a test that cannot be"],
)
def test_a_plan_file_that_cannot_be_is_refused_in_one_line(client: httpx.Client, content: bytes, word: str) -> None:
    answer = client.post("/v1/designs/file?file=plan.toml", content=content, headers=BINARY)
    assert answer.status_code == 422, answer.text
    assert word in answer.json()["detail"]
    assert "\n" not in answer.json()["detail"]
    assert "/tmp" not in answer.text


def test_a_plan_file_that_ends_its_reading_process_is_refused_and_the_service_goes_on(tmp_path: Path) -> None:
    plan = tmp_path / "plan.toml"
    plan.write_text("")
    with pytest.raises(ExcitationFileError, match=r"m\.toml: damaged: it was not read within 0 s: write the plan"):
        asyncio.run(RunReader(deadline_s=0.0).read_plan(plan, "m.toml"))


@pytest.mark.parametrize("kind", ["external storage", "soft link"])
def test_a_hostile_file_is_no_design(client: httpx.Client, kind: str, tmp_path: Path) -> None:
    write, expected = HOSTILE[next(name for name in HOSTILE if kind in name)]
    write(tmp_path / "bad.h5")
    content = (tmp_path / "bad.h5").read_bytes()
    answer = client.post("/v1/designs/file?file=bad.h5", content=content, headers=BINARY)
    assert answer.status_code == 422, answer.text
    assert expected in answer.json()["detail"]


def test_designs_are_kept_by_both_databases(database: Any) -> None:
    designs = DesignStore(database)
    made = designs.create("d", [SINE], None, 0.5)
    assert designs.one("d") == designs.one(made.id) == made
    designs.delete("d")
    assert designs.newest(limit=5) == ()


def test_models_are_stored_as_the_reader_accepts_them(client: httpx.Client) -> None:
    made = client.post("/v1/models", json=MODEL)
    assert made.status_code == 201, made.text
    assert client.get(made.json()["file"]).json() == MODEL
    assert client.get(made.headers["location"]).json()["model"] == MODEL
    assert [one["id"] for one in client.get("/v1/models").json()["models"]] == [made.json()["id"]]
    broken = json.loads(json.dumps(MODEL))
    broken["format"] = "other"
    assert client.post("/v1/models", json=broken).status_code == 422
    assert client.delete(made.headers["location"]).status_code == 204
    assert client.get(made.headers["location"]).status_code == 404
