"""The job `identify`: the same models as those of the command, of the same runs, and the same refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

import httpx
import numpy as np
import pytest

from api.cli.main import main
from api.jobs.identify import IDENTIFY, IdentifyRequest
from api.jobs.kind import Task
from identification.blackbox import KINDS
from identification.errors import DataError, IdentificationError
from rigctl.runfile import with_channel, write_run
from tests.api.following import get, reached
from tests.api.measured import MODEL, sent
from tests.identification.hysteretic import hysteretic
from tests.identification.six_axes import by_formula, motion

CONTROLLED = {
    **MODEL,
    "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 900.0, "c_control": 400.0}}]},
}
CHOSEN: dict[str, tuple[dict[str, Any], list[str]]] = {
    "nnoe": ({"regressors": ["F1 v0 v1"], "nodes": 4}, ["--regressors", "F1 v0 v1", "--nodes", "4"]),
    "narx": ({"regressors": ["F1 v0", "v0 v1"]}, ["--regressors", "F1 v0", "--regressors", "v0 v1"]),
    "mlp": ({"layers": "4,3", "activation": "logsig"}, ["--layers", "4,3", "--activation", "logsig"]),
    "arx": ({"rate_hz": 100.0}, ["--rate", "100"]),
    "polynomial": ({"regressors": ["F1 v0"]}, ["--regressors", "F1 v0"]),
    "hybrid": ({"regressors": ["v0 M0"], "base": MODEL}, ["--regressors", "v0 M0", "--base", "base.json"]),
    "inverse": (
        {"regressors": ["F0 v0"], "nodes": 4, "base": CONTROLLED},
        ["--regressors", "F0 v0", "--nodes", "4", "--base", "controlled.json"],
    ),
    "multiaxis": ({"base": MODEL}, ["--base", "base.json"]),
}
ENDS = {"inverse": "_i.h5", "multiaxis": "_six.h5"}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs of a damper with memory, with and without a current."""
    place = tmp_path_factory.mktemp("runs")
    for k, name in enumerate(("learned", "more", "shown")):
        write_run(place / f"{name}.h5", hysteretic(k, 900))
        write_run(place / f"{name}_i.h5", hysteretic(k, 900, current=True))
        write_run(place / f"{name}_six.h5", by_formula(motion(k), name))
    learned, driven = hysteretic(0, 900), hysteretic(0, 900, current=True)
    write_run(place / "two.h5", replace(learned, channels={k: one[:2] for k, one in learned.channels.items()}))
    write_run(place / "dead_i.h5", with_channel(driven, "force", np.full(900, 7.0), "N"))
    write_run(place / "faster.h5", hysteretic(3, 900, rate_hz=500.0))
    (place / "base.json").write_text(json.dumps(MODEL))
    (place / "controlled.json").write_text(json.dumps(CONTROLLED))
    return place


def task_of(place: Path, runs: list[str], held_out: list[str], **options: Any) -> Task:
    request = IdentifyRequest(kind="identify", runs=runs, held_out=held_out, **options)
    return Task(
        request={**request.options, "runs": runs, "held_out": held_out},
        runs=tuple(place / name for name in runs),
        held_out=tuple(place / name for name in held_out),
    )


def test_its_kinds_are_those_of_the_command() -> None:
    assert set(get_args(get_type_hints(IdentifyRequest)["model_kind"])) == {*KINDS, "inverse", "multiaxis"}


@pytest.mark.parametrize(
    "kind", [kind if kind == "arx" else pytest.param(kind, marks=pytest.mark.slow) for kind in CHOSEN]
)
def test_every_kind_gives_the_model_of_the_command(
    runs: Path, tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    options, words = CHOSEN[kind]
    ends = ENDS.get(kind, ".h5")
    task = task_of(runs, [f"learned{ends}", f"more{ends}"], [f"shown{ends}"], model_kind=kind, **options)
    IDENTIFY.check(task)
    told: list[float] = []
    result = IDENTIFY.run(task, tmp_path, lambda done, text: told.append(done))
    assert told
    assert all(0.0 <= one <= 1.0 for one in told)
    monkeypatch.chdir(runs)
    given = [*(path.name for path in task.runs), "--held-out", task.held_out[0].name, *words]
    assert main(["identify", kind, *given, "-o", f"{kind}.json", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "model.json").read_text()) == json.loads((runs / f"{kind}.json").read_text())
    assert json.loads((tmp_path / "figures.json").read_text()) | {"file": f"{kind}.json"} == figures
    assert all(figures[key] == value for key, value in result.items())
    assert not (tmp_path / "search.html").exists()


@pytest.mark.slow
def test_a_search_draws_its_page_over_http_and_other_jobs_have_none(base: str, runs: Path) -> None:
    here = {name: sent(base, runs / f"{name}.h5") for name in ("learned", "shown")}
    given = {"kind": "identify", "runs": [here["learned"]], "held_out": [here["shown"]]}
    searched = {**given, "model_kind": "arx", "select": True, "longest": 1}
    plain = {**given, "model_kind": "arx", "regressors": ["F1 v0"]}
    made = [httpx.post(f"{base}/v1/jobs", json=body, timeout=60) for body in (searched, plain)]
    assert [one.status_code for one in made] == [201, 201], made[0].text + made[1].text
    ended = [reached(base, one.headers["location"], lambda job: job["ended"] is not None, 120.0) for one in made]
    assert [one["state"] for one in ended] == ["done", "done"], ended
    assert list(ended[0]["files"]) == ["model.json", "figures.json", "search.html"]
    assert list(ended[1]["files"]) == ["model.json", "figures.json"]
    assert len(ended[1]["result"]["fit_held_out"]) == 1
    assert "Path of the search" in httpx.get(base + ended[0]["files"]["search.html"], timeout=60).text
    figures = get(base, ended[0]["files"]["figures.json"])
    assert figures["search"]["path"][0]["regressors"] == ["F1", "v1"]
    model = get(base, ended[1]["files"]["model.json"])
    stored = httpx.post(f"{base}/v1/models", json=model, timeout=60)
    assert (stored.status_code, stored.json()["kind"]) == (201, "arx")
    none = httpx.get(f"{base}/v1/jobs/{ended[1]['id']}/files/search.html", timeout=60)
    assert (none.status_code, "it has model.json, figures.json" in none.json()["detail"]) == (404, True)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"model_kind": "spline"}, ["model_kind is 'spline'", "nnoe"]),
        ({}, ["model_kind is missing"]),
        ({"model_kind": "arx", "every": True}, ["every goes with select"]),
        ({"model_kind": "arx", "longest": 3}, ["longest goes with select"]),
        ({"model_kind": "arx", "longest": 0}, ["longest goes with select"]),
        ({"model_kind": "multiaxis", "nodes": 0}, ["leave out regressors, nodes and layers"]),
        ({"model_kind": "arx", "select": True, "regressors": ["F1"]}, ["regressors and select"]),
        ({"model_kind": "inverse", "select": True}, ["an inverse takes regressors"]),
        ({"model_kind": "arx", "rate_hz": 0.0}, ["rate_hz is 0"]),
        ({"model_kind": "hybrid", "base": {**MODEL, "kind": "spline"}}, ["base: kind is 'spline'"]),
        ({"model_kind": "arx", "regressors": ["F1"] * 51}, ["regressors has 51 entries"]),
        ({"model_kind": "inverse"}, ["has no control current"]),
    ],
)
def test_what_cannot_be_identified_is_refused_in_one_line_before_it_is_accepted(
    base: str, runs: Path, options: dict[str, Any], words: list[str]
) -> None:
    before = get(base, "/v1/jobs")
    body = {"kind": "identify", "runs": [sent(base, runs / "learned.h5")], **options}
    answer = httpx.post(f"{base}/v1/jobs", json=body, timeout=60)
    assert answer.status_code == 422, answer.text
    detail = answer.json()["detail"]
    assert "\n" not in detail
    assert all(word in detail for word in words), detail
    assert get(base, "/v1/jobs") == before


@pytest.mark.parametrize(
    ("names", "held_out", "options", "words"),
    [
        (["learned.h5", "faster.h5"], [], {"model_kind": "arx"}, "faster.h5 has 500 Hz"),
        (["learned_i.h5"], ["shown.h5"], {"model_kind": "nnoe"}, "shown.h5 has no current"),
        (["learned.h5"], [], {"model_kind": "nnoe", "regressors": ["F1 F2 v0 v1"], "nodes": 64}, "for 389 weights"),
        (["learned.h5"], [], {"model_kind": "arx", "regressors": ["F1 i0"]}, "current does not vary"),
        (["learned_i.h5"], [], {"model_kind": "inverse", "base": MODEL}, "has no current among its inputs"),
        (["learned_i.h5"], [], {"model_kind": "inverse", "regressors": ["v0"]}, "hold no wanted force F"),
        (["learned.h5"], [], {"model_kind": "arx", "regressors": ["F1 q0"]}, "regressor 'q0'"),
        (["learned.h5"], [], {"model_kind": "nnoe", "nodes": 4}, "nodes are stated without regressors"),
        (["learned.h5"], [], {"model_kind": "arx", "select": True, "longest": 99}, "longest delay is 99"),
        (["learned.h5"], [], {"model_kind": "polynomial", "select": True}, "can be searched for nnoe, narx, mlp, arx"),
        (["learned.h5"], [], {"model_kind": "nnoe", "layers": "14"}, "are for narx and mlp, not for 'nnoe'"),
        (["learned_i.h5"], [], {"model_kind": "inverse", "evolve": True}, "are for narx and mlp, not for 'inverse'"),
        (["learned.h5"], [], {"model_kind": "arx", "base": MODEL}, "only a hybrid builds on one"),
        (["learned.h5"], [], {"model_kind": "nnoe", "regressors": ["v0 M0"]}, "only a hybrid has one"),
        (["learned.h5"], ["two.h5"], {"model_kind": "arx"}, "two.h5: only 2 samples"),
        (["learned_i.h5"], ["dead_i.h5"], {"model_kind": "inverse"}, "dead_i.h5: channel 'force' is frozen at 7"),
        (["learned.h5"], [], {"model_kind": "arx", "rate_hz": 2e5}, "learned.h5 has 200 Hz: at most 20 times its own"),
        (
            ["learned.h5"],
            [],
            {"model_kind": "polynomial", "regressors": [" ".join(f"v{k}" for k in range(257))]},
            "257 regressors have 2895620 products of up to 3 at 900 samples: at most 20000 are tried",
        ),
    ],
)
def test_its_check_names_what_would_end_the_work(
    runs: Path, names: list[str], held_out: list[str], options: dict[str, Any], words: str
) -> None:
    with pytest.raises((DataError, IdentificationError)) as refused:
        IDENTIFY.check(task_of(runs, names, held_out, **options))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
