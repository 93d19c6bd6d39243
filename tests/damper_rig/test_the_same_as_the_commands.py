"""What a notebook calls gives what the command of that name prints, on the same files."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import damper_rig as dr
from api.cli.main import main
from rigctl.runfile import read_run, write_run
from tests.api.measured import MODEL, NAMES, a_run

ROOT = Path(__file__).parents[2]
Said = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Sines of one damper with dry friction, and a model that lacks it."""
    folder = tmp_path_factory.mktemp("laboratory")
    for k, name in enumerate(NAMES):
        write_run(folder / name, a_run(k, (0.5, 1.0, 2.5, 2.0)[k]))
    (folder / "model.json").write_text(json.dumps(MODEL))
    return folder


def said(capsys: Said, *words: object) -> Any:  # Any: JSON
    assert main([*map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def as_json(value: object) -> Any:  # Any: JSON
    return json.loads(json.dumps(value))


def test_a_fit(laboratory: Path, tmp_path: Path, capsys: Said) -> None:
    files = [laboratory / name for name in NAMES[:3]]
    told = said(capsys, "fit", laboratory / "model.json", *files, "-o", tmp_path / "fitted.json")
    found = dr.fit(laboratory / "model.json", dr.load(*files))
    assert {"file": told.pop("file"), **told} == {"file": str(tmp_path / "fitted.json"), **as_json(found.data())}
    assert found.save(tmp_path / "again.json").read_bytes() == (tmp_path / "fitted.json").read_bytes()


def test_an_explanation(laboratory: Path, tmp_path: Path, capsys: Said) -> None:
    files, check = [laboratory / name for name in NAMES[:3]], laboratory / NAMES[3]
    told = said(capsys, "explain", laboratory / "model.json", *files, "--held-out", check, "-o", tmp_path / "report")
    found = dr.explain(laboratory / "model.json", dr.load(*files), held_out=dr.load(check))
    assert told == as_json(found.data())
    assert found.names == tuple(effect["element"] for effect in told["effects"]) != ()
    assert found.save(tmp_path / "again") == tmp_path / "again" / "report.html"
    for name in ("report.json", "model.json"):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "report" / name).read_bytes()


def test_a_sheet(laboratory: Path, tmp_path: Path, capsys: Said) -> None:
    files = [laboratory / name for name in NAMES]
    told = said(capsys, "characterise", *files, "-o", tmp_path / "sheet.html")
    found = dr.characterise(dr.load(*files))
    mine = as_json(found.data())
    assert {key: told[key] for key in mine} == mine
    assert "Damper characteristics" in found.save(tmp_path / "again.html").read_text()


def test_a_comparison(laboratory: Path, tmp_path: Path, capsys: Said) -> None:
    file, model = laboratory / NAMES[0], laboratory / "model.json"
    told = said(capsys, "compare", model, "--runs", file, "-o", tmp_path / "comparison.html")
    (mine,), (theirs,) = dr.compare([model], dr.load(file)).data()["models"], told["models"]
    assert (mine["model"], mine["rms"], mine["eearth"]) == (theirs["model"], theirs["rms"], theirs["eearth"])


def test_a_simulation(laboratory: Path, tmp_path: Path) -> None:
    file, model = laboratory / NAMES[0], laboratory / "model.json"
    for words, options in (((), {}), (("--tolerance", "1e-4"), {"tolerance": 1e-4})):
        assert main(["simulate", str(model), str(file), "-o", str(tmp_path / "out.h5"), *words]) == 0
        (mine,) = dr.simulate(model, dr.load(file), **options)
        assert np.array_equal(
            read_run(tmp_path / "out.h5").channels["force_simulated"], mine.channels["force_simulated"]
        )


def test_a_score(laboratory: Path, tmp_path: Path, capsys: Said) -> None:
    file, out = laboratory / NAMES[0], tmp_path / "out.h5"
    assert main(["simulate", str(laboratory / "model.json"), str(file), "-o", str(out)]) == 0
    capsys.readouterr()
    told = said(capsys, "score", out)
    found = dr.score(dr.simulate(laboratory / "model.json", dr.load(file)))
    assert told == as_json(found.data())[NAMES[0]]
    assert repr(found).startswith(f"{NAMES[0]}: rms ")
    assert "<table>" in found._repr_html_()


def test_a_black_box(laboratory: Path, tmp_path: Path, capsys: Said) -> None:
    files, shown = [laboratory / name for name in NAMES[:2]], laboratory / NAMES[2]
    words = ("--held-out", shown, "--regressors", "F1 v0 v1", "--rate", "100", "-o", tmp_path / "arx.json")
    told = said(capsys, "identify", "arx", *files, *words)
    found = dr.identify(
        "arx", dr.load(*files), held_out=dr.load(shown), regressors=["F1 v0 v1"], rate_hz=100.0, name="arx"
    )
    assert told == {"file": str(tmp_path / "arx.json"), **as_json(found.data())}
    assert found.save(tmp_path / "again.json").read_bytes() == (tmp_path / "arx.json").read_bytes()
    assert "by cross-validation" in repr(found)
    assert "<table>" in found._repr_html_()
    with pytest.raises(ValueError, match="nodes are stated without regressors"):
        dr.identify("nnoe", dr.load(*files), nodes=4)


def test_a_design(tmp_path: Path) -> None:
    config = ROOT / "examples" / "first_run.toml"
    assert main(["design", "random-phase", str(config), "-o", str(tmp_path / "command.csv")]) == 0
    made = dr.design("random-phase", config)
    assert dr.save(made, tmp_path / "mine.csv").read_bytes() == (tmp_path / "command.csv").read_bytes()


def test_the_elements(capsys: Said) -> None:
    assert said(capsys, "elements") == as_json(dr.elements().rows())
    name = next(iter(dr.elements()))
    assert main(["elements", name]) == 0
    assert capsys.readouterr().out == f"{dr.elements(name)!r}\n"


def test_an_import(tmp_path: Path, capsys: Said) -> None:
    file = ROOT / "examples" / "dyno.csv"
    assert main(["import", str(file), "-o", str(tmp_path), "--split", "--flip", "force"]) == 0
    told = capsys.readouterr().err.splitlines()
    with pytest.warns(dr.DataWarning) as seen:
        runs = dr.load(file, split=True, flip=["force"])
    assert len(runs) > 1
    assert len(seen) == len(told) > 0
    assert all(str(mine.message).split(": ", 1)[1] in theirs for mine, theirs in zip(seen, told, strict=True))
    for run in runs:
        assert run.path is not None
        written = read_run(tmp_path / run.path.name)
        assert written.sample_rate_hz == run.sample_rate_hz
        assert written.excitation_kind == run.excitation_kind
        assert all(np.array_equal(written.channels[name], run.channels[name]) for name in run.channels)


def test_the_same_run_given_twice_is_refused(laboratory: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", dr.DataWarning)
        runs = dr.load(laboratory / NAMES[0], laboratory / NAMES[0])
    with pytest.raises(ValueError, match="same measurement"):
        dr.fit(laboratory / "model.json", runs)
