"""Files with samples that no design makes again: stored once, played as the command line plays them, never half."""

from __future__ import annotations

import hashlib
import os
import socket
import time
from collections.abc import AsyncIterator, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import anyio
import httpx
import numpy as np
import pytest

from api.app import create_app
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.store import CampaignStore
from api.cli.main import main
from api.errors import DiskFull, InputError
from api.settings import Settings
from api.store.backup import Folders, back_up
from api.store.check import check
from api.store.database import Database
from api.store.designs import DesignStore
from api.store.restore import restore
from api.store.runs import RunStore
from excitation import Excitation, Test, TestPlan, plan_from_config, read_excitation, write_excitation, write_plan
from excitation.errors import DesignError
from excitation.files import READABLE
from excitation.hdf5 import hdf5_bytes
from excitation.kinds import Kind
from rigctl.runfile import Run, read_run
from tests.api.following import ended, get, resume, rig_of, until
from tests.api.serving import serving
from tests.starting import Started

SINE = {"name": "sine", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2}
BINARY = {"content-type": "application/octet-stream"}
UNKNOWN = "0" * 64


def drive(scale: float = 1.0, samples: int = 600) -> Excitation:
    """What an iteration leaves: no design makes its samples again."""
    t = np.arange(samples) / 1000.0
    fade = np.sin(np.pi * t / t[-1]) ** 2
    return Excitation(
        kind=Kind.CUSTOM,
        sample_rate_hz=1000.0,
        period_samples=0,
        displacement_m=scale * fade * (4e-3 * np.sin(2 * np.pi * 3.0 * t) + 1e-3 * np.sin(2 * np.pi * 7.3 * t)),
        current_a=0.5 + 0.2 * fade,
        design={"drive_for": {"kind": "sine", "amplitude": 0.004}},
        figures={"iteration": 3},
    )


@pytest.fixture
def file(tmp_path: Path) -> Path:
    write_excitation(tmp_path / "road.drive.h5", drive())
    return tmp_path / "road.drive.h5"


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lab") / "data"


@pytest.fixture(scope="module")
def client(data: Path) -> Iterator[httpx.Client]:
    with serving(create_app(Settings(data_dir=data), with_workers=False)) as client:
        client.timeout = httpx.Timeout(90.0)
        yield client


def sent(client: httpx.Client, path: Path, name: str = "", **headers: str) -> httpx.Response:
    query = {"file": path.name, "name": name or f"{path.name} {os.urandom(4).hex()}"}
    return client.post("/v1/designs/file", params=query, content=path.read_bytes(), headers={**BINARY, **headers})


def stored(client: httpx.Client, path: Path) -> dict[str, Any]:
    answer = sent(client, path)
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = client.get(answer.headers["location"]).json()
    return found


def ready(base: str, rig: str) -> None:
    """The rig is known, and its queue goes on."""
    httpx.post(f"{base}/v1/rigs", json={"address": rig}, timeout=30)
    resume(base, rig)


def files_below(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def described(run: Run) -> tuple[Any, ...]:
    return run.test_id, run.excitation_kind, run.design, run.period_samples, run.sample_rate_hz, run.samples


@pytest.mark.parametrize("ending", [".h5", ".csv"])
def test_a_file_of_samples_is_played_and_recorded_as_by_the_command_line(
    ending: str, base: str, lab: Path, rig: str, tmp_path: Path
) -> None:
    file = tmp_path / f"road.drive{ending}"
    write_excitation(file, drive(1.0 if ending == ".h5" else 0.9))
    with httpx.Client(base_url=base, timeout=90) as client:
        [config] = stored(client, file)["configurations"]
        assert (config["name"], config["kind"]) == ("road.drive", "samples")
        body = {"name": "a drive", "rig": rig, "specimen": "damper 7", "tests": [{**config, "dwell": 0.1}]}
        dry = client.post("/v1/campaigns?dry_run=true", json=body)
        assert dry.status_code == 200, dry.text
        assert dry.json()["tests"][0]["displacement_m"] == pytest.approx(np.abs(drive().displacement_m).max(), rel=0.2)
        made = client.post("/v1/campaigns", json=body)
        assert made.status_code == 201, made.text
        ready(base, rig)
        first = until(base, made.json()["id"], ended)
        assert (first["state"], first["reason"]) == ("done", "")
        again = client.post(f"/v1/campaigns/{made.json()['id']}/retry").json()["id"]
        assert until(base, again, ended)["state"] == "done"
        [run] = get(base, f"/v1/campaigns/{again}/runs")["runs"]
    assert main(["run", str(file), "--rig", rig, "-o", str(tmp_path / "runs")]) == 0
    mine = read_run(next((tmp_path / "runs").glob("*.h5")))
    its = read_run(lab / "data" / "runs" / again / "road.drive.h5")
    assert run["id"] == its.run_id
    assert described(its) == described(mine)
    for channel in ("displacement_command", "current_command"):
        np.testing.assert_array_equal(its.channels[channel], mine.channels[channel])
    np.testing.assert_allclose(its.channels["displacement_command"], read_excitation(file).displacement_m, atol=1e-6)


def test_a_plan_has_samples_and_designs_and_a_warm_up_of_samples(
    client: httpx.Client, data: Path, tmp_path: Path
) -> None:
    plan = plan_from_config({"tests": [SINE]})
    tests = (*plan.tests, Test(name="a", excitation=drive(0.5), held_out=True), Test(name="b", excitation=drive(0.5)))
    warm_up = Test(name="warm", excitation=drive(0.7), energy_j=5.0)
    write_plan(tmp_path / "plan.h5", TestPlan(tests=tests, warm_up=warm_up))
    before = files_below(data / "runs")
    found = stored(client, tmp_path / "plan.h5")
    assert [one["kind"] for one in found["configurations"]] == ["sine", "samples", "samples"]
    assert found["configurations"][1]["held_out"] is True
    assert found["configurations"][1]["sha256"] == found["configurations"][2]["sha256"]
    assert (found["warm_up"]["kind"], found["warm_up"]["energy"]) == ("samples", 5.0)
    assert len(files_below(data / "runs")) == len(before) + 2
    body = {"name": "c", "rig": "modbus://127.0.0.1:5020", "specimen": "d", "design": found["id"]}
    checked = client.post("/v1/campaigns/check", json=body)
    assert checked.status_code == 200, checked.text
    assert [one["name"] for one in checked.json()["tests"]] == ["sine", "a", "b"]
    copied = client.post("/v1/designs", json={"name": "copy", "tests": found["configurations"]})
    assert copied.status_code == 201, copied.text
    assert client.get(copied.headers["location"]).json()["configurations"] == found["configurations"]


@pytest.mark.parametrize("ending", READABLE)
def test_every_file_that_the_command_line_plays_is_taken(
    ending: str, client: httpx.Client, data: Path, tmp_path: Path
) -> None:
    file = tmp_path / f"drive{ending}"
    write_excitation(file, drive(0.4))
    [config] = stored(client, file)["configurations"]
    wanted, found = read_excitation(file), read_excitation(stored_file(data, config))
    assert (config["name"], found.sample_rate_hz, found.kind) == ("drive", wanted.sample_rate_hz, wanted.kind)
    np.testing.assert_array_equal(found.displacement_m, wanted.displacement_m)
    np.testing.assert_array_equal(np.asarray(found.current_a), np.asarray(wanted.current_a))


def stored_file(data: Path, config: dict[str, Any]) -> Path:
    return next(one for one in (data / "runs" / "samples").rglob("*.h5") if digest_of(one) == config["sha256"])


def test_what_another_program_changed_in_a_designed_file_is_kept_as_its_samples(
    client: httpx.Client, tmp_path: Path
) -> None:
    [test] = plan_from_config({"tests": [SINE]}).tests
    write_excitation(tmp_path / "as-designed.h5", test.excitation)
    [kept] = stored(client, tmp_path / "as-designed.h5")["configurations"]
    assert kept["kind"] == "sine"
    halved = replace(test.excitation, displacement_m=0.5 * test.excitation.displacement_m)
    write_excitation(tmp_path / "halved.h5", halved)
    [kept] = stored(client, tmp_path / "halved.h5")["configurations"]
    assert kept["kind"] == "samples"
    drawn = client.post("/v1/tests/draw", json={"test": kept}).json()
    assert max(drawn["displacement_m"]) == pytest.approx(np.max(halved.displacement_m), rel=0.01)


def test_the_stored_file_is_an_excitation_file_with_this_sha256_and_is_there_once(
    client: httpx.Client, data: Path, file: Path
) -> None:
    [config] = stored(client, file)["configurations"]
    before = files_below(data / "runs")
    assert stored(client, file)["configurations"] == [config]
    assert files_below(data / "runs") == before
    found, wanted = read_excitation(stored_file(data, config)), drive()
    assert (found.design, found.figures, found.kind) == (wanted.design, wanted.figures, wanted.kind)
    np.testing.assert_array_equal(found.displacement_m, wanted.displacement_m)


def digest_of(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_samples_are_drawn_and_checked_against_the_envelopes(client: httpx.Client, file: Path) -> None:
    [config] = stored(client, file)["configurations"]
    drawn = client.post("/v1/tests/draw", json={"test": config})
    assert drawn.status_code == 200, drawn.text
    np.testing.assert_allclose(drawn.json()["displacement_m"], drive().displacement_m, rtol=1e-5)
    envelope = {"motion": {"max_displacement": 1e-3, "max_velocity": 1.0}}
    body = {"name": "c", "rig": "modbus://127.0.0.1:5020", "specimen": "d", "tests": [config], "envelopes": [envelope]}
    for path in ("/v1/campaigns", "/v1/campaigns/check"):
        refused = client.post(path, json=body)
        assert refused.status_code == 422, refused.text
        assert refused.json()["errors"][0]["pointer"] == "/tests/0"
        assert "the limit is 0.001 m" in refused.json()["detail"]


def test_samples_are_described_like_every_other_kind(client: httpx.Client) -> None:
    described = client.get("/openapi.json").json()["components"]["schemas"]["SamplesTest"]
    assert {"kind", "name", "sha256"} <= set(described["required"])
    assert {"dwell", "before", "limits", "held_out"} <= set(described["properties"])


@pytest.mark.parametrize(
    ("sha256", "words"),
    [
        (UNKNOWN, "samples 000000000000… are not stored here: upload their file"),
        ("../../secret", "should match pattern"),
        (UNKNOWN.upper().replace("0", "A"), "should match pattern"),
        (3, "it must be a valid string"),
    ],
)
def test_a_sha256_that_is_none_of_ours_is_refused_in_one_line(client: httpx.Client, sha256: Any, words: str) -> None:
    test = {"name": "x", "kind": "samples", "sha256": sha256}
    campaign = {"name": "c", "rig": "modbus://127.0.0.1:5020", "specimen": "d", "tests": [test]}
    for path, body in (
        ("/v1/campaigns", campaign),
        ("/v1/campaigns/check", campaign),
        ("/v1/designs", {"name": "d", "tests": [test]}),
        ("/v1/tests/draw", {"test": test}),
    ):
        refused = client.post(path, json=body)
        assert refused.status_code == 422, refused.text
        assert words in refused.json()["detail"]
        assert "\n" not in refused.json()["detail"]
    pointers = [one["pointer"] for one in client.post("/v1/campaigns", json=campaign).json()["errors"]]
    assert pointers == ["/tests/0/sha256"]


def test_the_sha256_of_an_uploaded_run_is_none_of_samples(client: httpx.Client, folder: Path) -> None:
    content = (folder / "reversed.h5").read_bytes()
    run = client.post("/v1/runs", params={"name": "r.h5"}, content=content, headers=BINARY).json()
    refused = client.post("/v1/tests/draw", json={"test": {"name": "x", "kind": "samples", "sha256": run["sha256"]}})
    assert refused.status_code == 422
    assert "are not stored here" in refused.json()["detail"]


def not_finite(place: Path) -> Path:
    import h5py

    write_excitation(place / "bad.h5", drive())
    with h5py.File(place / "bad.h5", "r+") as file:
        file["channels/displacement_command"][7] = np.nan
    return place / "bad.h5"


def too_many(place: Path) -> Path:
    large = Excitation(kind=Kind.CUSTOM, sample_rate_hz=1e4, period_samples=0, displacement_m=np.zeros((64 << 17) + 1))
    write_excitation(place / "bad.h5", large)
    return place / "bad.h5"


def too_much_text(place: Path) -> Path:
    (place / "bad.csv").write_text("name,wave_form\n" + "a,sine\n" * 200_000)
    return place / "bad.csv"


def no_number(place: Path) -> Path:
    (place / "bad.csv").write_text("time (s),displacement_command (m)\n0.0,0.0\n0.001,inf\n0.002,0.0\n")
    return place / "bad.csv"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (not_finite, "channel displacement_command, sample 7 is nan: it must be finite"),
        (too_many, "67108872 bytes as numbers: at most 67108864 are kept of a file"),
        (too_much_text, "a plan as text has at most 1048576 bytes"),
        (no_number, "displacement: sample 1 is inf: every sample must be a finite number"),
    ],
)
def test_a_file_of_samples_that_cannot_be_is_refused_in_one_line_and_leaves_nothing(
    make: Any, words: str, client: httpx.Client, data: Path, tmp_path: Path
) -> None:
    bad = make(tmp_path)
    before = files_below(data)
    refused = sent(client, bad)
    assert refused.status_code == 422, refused.text
    assert words in refused.json()["detail"], refused.text
    assert "\n" not in refused.json()["detail"]
    assert str(data) not in refused.text
    assert [one for one in files_below(data) if one.startswith("runs/")] == [
        one for one in before if one.startswith("runs/")
    ]


def test_a_design_that_is_refused_keeps_no_samples_and_a_repeated_request_has_its_answer(
    client: httpx.Client, data: Path, tmp_path: Path
) -> None:
    first, other = tmp_path / "first.h5", tmp_path / "other.h5"
    write_excitation(first, drive(0.31))
    write_excitation(other, drive(0.32))
    made = sent(client, first, "taken", **{"idempotency-key": "k1"})
    assert made.status_code == 201, made.text
    before = files_below(data / "runs")
    again = sent(client, first, "taken", **{"idempotency-key": "k1"})
    assert (again.status_code, again.json()) == (201, made.json())
    assert again.headers["idempotency-replayed"] == "true"
    assert sent(client, other, "taken").status_code == 409
    assert sent(client, other, "taken", **{"idempotency-key": "k1"}).status_code == 422
    assert files_below(data / "runs") == before


def test_samples_go_with_their_last_design_unless_an_open_campaign_plays_them(tmp_path: Path, file: Path) -> None:
    settings = Settings(data_dir=tmp_path / "lab")
    with serving(create_app(settings, with_workers=False)) as client:
        one, two = stored(client, file), stored(client, file)
        body = {"name": "c", "rig": "modbus://127.0.0.1:5020", "specimen": "d", "design": one["id"]}
        campaign = client.post("/v1/campaigns", json=body).json()
        for design in (one, two):
            assert client.delete(f"/v1/designs/{design['id']}").status_code == 204
            assert len(files_below(settings.runs_dir)) == 1
        assert client.post("/v1/tests/draw", json={"test": one["configurations"][0]}).status_code == 200
        assert client.post(f"/v1/campaigns/{campaign['id']}/abort").status_code == 202
    with serving(create_app(settings, with_workers=False)) as client:
        assert files_below(settings.runs_dir) == []
        refused = client.post(f"/v1/campaigns/{campaign['id']}/retry")
        assert refused.status_code == 422
        assert "are no longer stored: upload it again" in refused.json()["detail"]
        three = stored(client, file)
        assert len(files_below(settings.runs_dir)) == 1
        assert client.delete(f"/v1/designs/{three['id']}").status_code == 204
        assert files_below(settings.runs_dir) == []


@pytest.mark.slow
@pytest.mark.parametrize("harm", ["missing", "changed"])
def test_samples_that_are_missing_or_changed_are_not_played_and_come_again_with_their_file(
    harm: str, base: str, lab: Path, rig: str, tmp_path: Path
) -> None:
    file = tmp_path / "road.h5"
    write_excitation(file, drive(0.6 if harm == "missing" else 0.61))
    with httpx.Client(base_url=base, timeout=90) as client:
        [config] = stored(client, file)["configurations"]
        good = {"name": "good", **{key: value for key, value in SINE.items() if key != "name"}, "current": 0.5}
        body = {"name": "c", "rig": rig, "specimen": "d", "tests": [good, config]}
        ready(base, rig)
        paused = client.post(f"/v1/rigs/{rig_of(base, rig)['id']}/pause", json={"reason": "for the test"})
        assert paused.status_code == 200, paused.text
        accepted = client.post("/v1/campaigns", json=body).json()["id"]
        kept = stored_file(lab / "data", config)
        if harm == "missing":
            kept.unlink()
        else:
            content = bytearray(kept.read_bytes())
            content[-3] ^= 1
            kept.write_bytes(content)
        resume(base, rig)
        after = until(base, accepted, ended)
        assert after["state"] == "failed"
        assert [test["state"] for test in after["tests"]] == ["done", "failed"]
        word = "their file is missing" if harm == "missing" else "their file was changed"
        assert word in after["reason"]
        assert "\n" not in after["reason"]
        assert str(lab) not in after["reason"]
        refused = client.post("/v1/campaigns", json=body)
        assert refused.status_code == 422
        assert word in refused.json()["detail"]
        assert stored(client, file)["configurations"] == [config]
        again = client.post(f"/v1/campaigns/{accepted}/retry").json()["id"]
        assert until(base, again, ended)["state"] == "done"


def test_the_command_submits_a_file_of_samples_once(
    base: str, rig: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("DAMPER_RIG_SERVICE", base)
    file = tmp_path / "bahn, süd.h5"
    write_excitation(file, drive(0.8))
    ready(base, rig)
    before = len(get(base, "/v1/designs?limit=200")["designs"])
    for _ in range(2):
        assert main(["campaign", "submit", str(file), "--rig", rig, "--specimen", "d", "--watch", "--json"]) == 0
        assert '"state": "done"' in capsys.readouterr().out
    assert len(get(base, "/v1/designs?limit=200")["designs"]) == before + 1
    assert main(["campaign", "submit", str(file), "--specimen", "d"]) == 2
    assert "rig is missing: give --rig" in capsys.readouterr().err


def replaying(folder: Path, ending: str) -> Path:
    """A plan of a sine and a replay of a record that lies beside it."""
    write_excitation(folder / "record.h5", drive())
    bounds = {"max_displacement": 0.02, "max_velocity": 0.5}
    replay = {"kind": "replay", "record": str(folder / "record.h5"), "channel": "displacement_command", "fade": 0.1}
    plan = plan_from_config({"tests": [{**replay, "name": "again", "bounds": bounds, "current": 0.5}, SINE]})
    write_plan(folder / f"replays.{ending}", plan)
    return folder / f"replays.{ending}"


@pytest.mark.parametrize("ending", ["toml", "csv", "h5"])
def test_the_command_sends_the_samples_of_the_records_that_a_plan_replays(
    ending: str,
    base: str,
    rig: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("DAMPER_RIG_SERVICE", base)
    file = replaying(tmp_path, ending)
    monkeypatch.chdir("/")
    ready(base, rig)
    name = f"replays {os.urandom(4).hex()}"
    submit = ["campaign", "submit", str(file), "--rig", rig, "--specimen", "d", "--name", name, "--watch", "--json"]
    assert main(submit) == 0, capsys.readouterr().err
    assert '"state": "done"' in capsys.readouterr().out
    design = get(base, "/v1/designs?limit=1")["designs"][0]
    kinds = [one["kind"] for one in get(base, f"/v1/designs/{design['id']}")["configurations"]]
    assert kinds == ["samples", "sine"]


def test_a_plan_that_names_a_file_of_the_service_is_refused_unread(client: httpx.Client, tmp_path: Path) -> None:
    file = replaying(tmp_path, "h5")
    refused = sent(client, file)
    assert refused.status_code == 422, refused.text
    assert "'record.h5' is a file of the computer that sent the plan" in refused.json()["detail"]
    assert str(tmp_path) not in refused.text
    (tmp_path / "record.h5").unlink()
    assert sent(client, file).json()["detail"] == refused.json()["detail"]


@pytest.mark.slow
def test_what_kill_9_leaves_of_an_upload_is_removed_at_the_start(tmp_path: Path, file: Path) -> None:
    place = tmp_path / "lab" / "runs" / "samples"
    with Started(["serve", "--data", str(tmp_path / "lab"), "--port", "0"], tmp_path / "serve.log") as child:
        address = urlsplit(child.wait_until_ready())
        with httpx.Client(base_url=child.url, timeout=90) as client:
            [config] = stored(client, file)["configurations"]
        [kept] = files_below(place)
        with socket.create_connection((address.hostname, address.port)) as connection:
            head = (
                f"POST /v1/designs/file?file=a.h5 HTTP/1.1\r\nHost: {address.netloc}\r\nContent-Length: 1000000\r\n\r\n"
            )
            connection.sendall(head.encode() + file.read_bytes()[:5000])
            ends = time.monotonic() + 60
            while not any(name.endswith("a.h5.part") for name in files_below(place)):
                assert time.monotonic() < ends
                time.sleep(0.01)
            child.kill()
    assert len(files_below(place)) == 3  # the samples, the part and its lock
    with serving(create_app(Settings(data_dir=tmp_path / "lab"), with_workers=False)) as client:
        assert files_below(place) == [kept]
        assert [path.name for path in place.iterdir()] == [kept.split("/")[0]]
        assert client.post("/v1/tests/draw", json={"test": config}).status_code == 200


@pytest.fixture
def runs(database: Database, tmp_path: Path) -> RunStore:
    return RunStore(database, tmp_path / "lab" / "runs", least_free_bytes=0)


async def body_of(content: bytes) -> AsyncIterator[bytes]:
    yield content


def keep(runs: RunStore, database: Database, excitation: Excitation, name: str) -> dict[str, Any]:
    """Store a design of one excitation as the route does; returns the configuration of its test."""

    async def take() -> dict[str, Any]:
        async with runs.samples.receive("a.h5", body_of(hdf5_bytes(excitation))) as found:

            def made() -> None:
                with database.together():
                    found.keep()
                    DesignStore(database).create(name, found.tests, None, 1.0)

            await anyio.to_thread.run_sync(made)
            return found.tests[0]

    return anyio.run(take)


def test_both_databases_keep_samples_once_until_nothing_names_them(
    runs: RunStore, database: Database, tmp_path: Path
) -> None:
    config = keep(runs, database, drive(), "one")
    assert keep(runs, database, drive(), "two") == config
    [name] = files_below(tmp_path / "lab" / "runs")
    np.testing.assert_array_equal(runs.samples.excitation(config["sha256"]).displacement_m, drive().displacement_m)
    assert runs.total_bytes() == (tmp_path / "lab" / "runs" / name).stat().st_size
    designs, campaigns = DesignStore(database), CampaignStore(database)
    body = {"name": "c", "rig": "modbus://127.0.0.1:5020", "specimen": "d", "tests": [config], "warm_up": config}
    new = NewCampaign(**body)
    plan = new.planned(runs.samples.excitations())
    made = campaigns.create(new, plan=plan)
    assert (made.tests[0].total_samples, made.tests[0].duration_s) == (600, 0.6)
    designs.delete("one")
    designs.delete("two")
    runs.samples.remove_unused()
    assert files_below(tmp_path / "lab" / "runs") == [name]
    campaigns.abort(made.id, "for the test")
    runs.samples.put_right()
    assert files_below(tmp_path / "lab" / "runs") == []
    with pytest.raises(InputError, match="no longer stored"):
        campaigns.retry(made.id)
    with pytest.raises(InputError, match="no longer stored"):
        campaigns.create(new, plan=plan)
    with pytest.raises(DesignError, match="are not stored here"):
        runs.samples.excitation(config["sha256"])
    assert keep(runs, database, drive(), "one") == config
    assert campaigns.retry(made.id).tests[0].config == config


def test_samples_that_a_campaign_is_just_naming_are_not_removed(runs: RunStore, database: Database) -> None:
    config = keep(runs, database, drive(), "one")
    new = NewCampaign(name="c", rig="modbus://127.0.0.1:5020", specimen="d", tests=[config])
    plan = new.planned(runs.samples.excitations())
    DesignStore(database).delete("one")
    with ThreadPoolExecutor(1) as pool:
        with database.together():
            CampaignStore(database).create(new, plan=plan)
            removing = pool.submit(runs.samples.remove_unused)
            assert not wait([removing], 0.5).done
        removing.result()
    assert runs.samples.excitation(config["sha256"]).samples == 600


def test_samples_whose_file_is_gone_are_stored_again(runs: RunStore, database: Database, tmp_path: Path) -> None:
    config = keep(runs, database, drive(), "one")
    [name] = files_below(tmp_path / "lab" / "runs")
    (tmp_path / "lab" / "runs" / name).unlink()
    assert keep(runs, database, drive(), "two") == config
    [other] = files_below(tmp_path / "lab" / "runs")
    assert other != name
    assert runs.samples.excitation(config["sha256"]).samples == 600


@pytest.mark.slow
def test_a_backup_with_samples_restores_and_a_check_misses_a_file(
    runs: RunStore, database: Database, database_url: str, tmp_path: Path
) -> None:
    config = keep(runs, database, drive(), "one")
    lab, new = (Folders(tmp_path / name / "runs", tmp_path / name / "reports") for name in ("lab", "new"))
    assert back_up(database_url, lab, tmp_path / "b.zip", tell=lambda *_: None).trouble == ()
    url = f"sqlite:///{tmp_path / 'new' / 'damper-rig.db'}"
    restore(tmp_path / "b.zip", url, new, tell=lambda *_: None)
    assert check(url, new, tell=lambda *_: None).trouble == ()
    with Database(url) as restored:
        found = RunStore(restored, new.runs).samples.excitation(config["sha256"])
        np.testing.assert_array_equal(found.displacement_m, drive().displacement_m)
    next((new.runs / "samples").rglob("*.h5")).unlink()
    assert [one.endswith("is missing") for one in check(url, new, tell=lambda *_: None).trouble] == [True]


def test_below_the_watermark_and_at_the_quota_no_samples_are_taken(database: Database, tmp_path: Path) -> None:
    full = RunStore(database, tmp_path / "full", least_free_bytes=1 << 60)
    with pytest.raises(DiskFull, match="must stay free"):
        keep(full, database, drive(), "one")
    assert not (tmp_path / "full").exists()
    size = len(hdf5_bytes(drive()))
    small = RunStore(database, tmp_path / "small", least_free_bytes=0, most_upload_bytes_total=size + 100)
    config = keep(small, database, drive(), "one")
    assert keep(small, database, drive(), "the same again") == config
    with pytest.raises(DiskFull, match="most_upload_bytes_total"):
        keep(small, database, drive(0.5), "another")
    assert len(files_below(tmp_path / "small")) == 1
