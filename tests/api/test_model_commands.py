"""The commands that take a model: one loader, one refusal, and models beside each other."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from identification.physical.model import Model, element
from identification.physical.modelfile import write_model
from rigctl.runfile import Run, write_run

EXAMPLES = Path(__file__).parents[2] / "examples"


def made(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a run, a model, a design and a rig, in which the commands run."""
    t = np.arange(2000) / 1000.0
    noise = np.random.default_rng(1).normal(0, 1, t.size)
    run = Run(
        run_id="r1",
        created="2026-11-21T00:00:00+00:00",
        specimen="damper 7",
        sample_rate_hz=1000.0,
        period_samples=500,
        excitation_kind="sine",
        status="complete",
        channels={"displacement": 0.01 * np.sin(4 * np.pi * t), "force": 100.0 * np.cos(4 * np.pi * t) + noise},
        units={"displacement": "m", "force": "N"},
    )
    write_run(tmp_path / "run.h5", run)
    write_model(tmp_path / "model.json", Model(name="m", elements=(element("viscous_damping", {"c": 700.0}),)))
    for example, name in (("random_phase.toml", "good.toml"), ("rig_25kn.toml", "rig.toml")):
        shutil.copy(EXAMPLES / example, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


TAKE_A_MODEL = {
    "simulate": ["simulate", "MODEL", "run.h5", "-o", "out.h5"],
    "fit": ["fit", "MODEL", "run.h5", "-o", "out.json"],
    "explain": ["explain", "MODEL", "run.h5", "-o", "report"],
    "compare": ["compare", "MODEL", "--runs", "run.h5", "-o", "page.html"],
    "characterise": ["characterise", "run.h5", "--model", "MODEL", "-o", "sheet.html"],
    "autopilot": ["autopilot", "MODEL", "run.h5", "--rig", "modbus://127.0.0.1:9", "-o", "found"],
    "design": ["design", "random-phase", "good.toml", "--envelope", "rig.toml", "--model", "MODEL", "-o", "out.h5"],
}


@pytest.mark.parametrize("command", TAKE_A_MODEL)
@pytest.mark.parametrize(
    ("file", "words"),
    [
        (
            "unknown.json",
            "unknown.json: kind is 'magic': this program reads 'physical' or 'nnoe' or",
        ),
        ("broken.json", "broken.json: line 1, column 2: no JSON"),
        ("absent.json", "absent.json: can't be read"),
        ("late.json", "late.json: format_version is 2: this program reads up to 1"),
    ],
)
def test_every_command_that_takes_a_model_refuses_it_in_the_same_line(
    place: Path,
    command: str,
    file: str,
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    good = json.loads(Path("model.json").read_text())
    Path("unknown.json").write_text(json.dumps({**good, "kind": "magic"}))
    Path("broken.json").write_text("{")
    Path("late.json").write_text(json.dumps({**good, "format_version": 2}))
    before = made(place)
    assert main([file if word == "MODEL" else word for word in TAKE_A_MODEL[command]]) == 2
    said = capsys.readouterr()
    assert said.err.startswith(f"damper-rig: {words}")
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert made(place) == before


@pytest.mark.parametrize("command", ["fit", "autopilot"])
def test_a_command_that_needs_named_elements_refuses_an_fmu(
    place: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("damper.fmu").write_bytes(b"")
    assert main(["damper.fmu" if word == "MODEL" else word for word in TAKE_A_MODEL[command]]) == 2
    line = "damper-rig: damper.fmu: kind is 'fmu': here a model of kind 'physical' is needed\n"
    assert capsys.readouterr().err == line


def test_compare_tells_models_apart_and_writes_one_page(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("soft.json").write_text(Path("model.json").read_text().replace("700.0", "500.0"))
    before = made(place)
    given = ["compare", "soft.json", "model.json", "--runs", "run.h5", "run.h5", "-o", "page.html"]
    assert main(given) == 0
    told = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in told] == ["model", "model.json", "soft.json", "page.html"]
    assert made(place) == before | {"page.html"}
    assert main([*given, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [(m["model"], m["free_parameters"], len(m["runs"])) for m in data["models"]] == [
        ("soft.json", 1, 2),
        ("model.json", 1, 2),
    ]
    assert main(["simulate", "soft.json", "run.h5", "-o", "out.h5"]) == 0
    capsys.readouterr()
    assert main(["score", "out.h5"]) == 0
    assert json.loads(capsys.readouterr().out)["rms"] == data["models"][0]["runs"][0]["rms"]
