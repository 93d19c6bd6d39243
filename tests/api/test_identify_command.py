"""`damper-rig identify`, and what the other commands do with the model that it writes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from identification.physical.model import Model, element
from identification.physical.modelfile import write_model
from rigctl.runfile import read_run, with_channel, write_run
from tests.identification.hysteretic import hysteretic


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two runs of a damper with memory, in which the commands run."""
    for name, seed in (("learned.h5", 1), ("shown.h5", 2)):
        write_run(tmp_path / name, hysteretic(seed, 900))
    write_run(tmp_path / "faster.h5", hysteretic(3, 900, rate_hz=500.0))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_model_is_identified_simulated_scored_and_compared(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chosen = ["--regressors", "F1 F2 v0 v1", "--nodes", "4", "--regressors", "v0 v1"]
    given = ["identify", "nnoe", "learned.h5", "--held-out", "shown.h5", *chosen, "-o", "n.json", "--json"]
    assert main(given) == 0
    said = capsys.readouterr()
    figures = json.loads(said.out)
    assert figures["fit_held_out"]["shown.h5"] > 90.0
    assert figures["stable"]
    assert figures["candidates"][0]["regressors"] == ["F1", "F2", "v0", "v1"]
    assert main(["simulate", "n.json", "shown.h5", "-o", "out.h5"]) == 0
    made = read_run(Path("out.h5")).channels
    held = (made["force_low"] <= made["force"]) & (made["force"] <= made["force_high"])
    assert np.mean(held) == pytest.approx(figures["coverage_90_held_out"]["shown.h5"])
    assert 0.7 < figures["coverage_90_predicted"] < 1.0
    assert main(["simulate", "n.json", "shown.h5", "--band", "30", "-o", "narrow.h5"]) == 2
    assert "band of 30 %: it must lie within 50 … 99 %" in capsys.readouterr().err
    capsys.readouterr()
    assert main(["score", "out.h5"]) == 0
    assert json.loads(capsys.readouterr().out)["fit"] == pytest.approx(figures["fit_held_out"]["shown.h5"])
    assert main(["identify", "arx", "learned.h5", "-o", "a.json"]) == 0
    assert "fit in free run" in capsys.readouterr().out
    assert main(["compare", "n.json", "a.json", "--runs", "shown.h5", "-o", "page.html"]) == 0
    assert capsys.readouterr().out.splitlines()[1].startswith("n.json")


def test_a_search_for_regressors_is_told_drawn_and_kept(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--select", "--longest", "1", "--nodes", "2", "--search", "search.json", "--page", "search.html"]
    given = ["identify", "nnoe", "learned.h5", *asked, "-o", "n.json", "--json"]
    assert main(given) == 0
    figures = json.loads(capsys.readouterr().out)["search"]
    assert figures["path"][0]["regressors"] == ["F1", "v1"]
    assert figures["without_each"]["v"]["rrmsse"] > figures["path"][-1]["rrmsse"]
    assert "Path of the search" in Path("search.html").read_text()
    assert json.loads(Path("search.json").read_text())["format"] == "damper-rig/selection"
    for wrong, message in (
        (["nnoe", "--search", "search.json"], "--search needs --select"),
        (["nnoe", "--select", "--regressors", "F1 v0"], "give one of them"),
        (["polynomial", "--select"], "can be searched for nnoe, narx, mlp, arx"),
    ):
        assert main(["identify", wrong[0], "learned.h5", *wrong[1:], "-o", "m.json"]) == 2
        assert message in capsys.readouterr().err
    assert not Path("m.json").exists()


def test_a_run_that_cannot_be_shown_is_refused_before_regressors_are_searched(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["--select", "--search", "search.json", "--held-out", "faster.h5"]
    assert main(["identify", "nnoe", "learned.h5", *asked, "-o", "n.json"]) == 2
    assert "faster.h5 has 500 Hz, learned.h5 200 Hz" in capsys.readouterr().err
    assert not (place / "search.json").exists()


def test_a_hybrid_builds_on_a_given_model(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    viscous = Model(name="v", elements=(element("viscous_damping", {"c": 900.0}),))
    write_model(Path("base.json"), viscous)
    chosen = ["--regressors", "F1 v0 v1 M0", "--nodes", "4", "--base", "base.json"]
    given = ["identify", "hybrid", "learned.h5", "--held-out", "shown.h5", *chosen, "-o", "h.json"]
    assert main(given) == 0
    assert "the base alone explains" in capsys.readouterr().out
    assert main(["compare", "h.json", "base.json", "--runs", "shown.h5", "-o", "page.html"]) == 0
    assert capsys.readouterr().out.splitlines()[1].startswith("h.json")
    assert main(["identify", "arx", "learned.h5", "--base", "base.json", "-o", "a.json"]) == 2
    assert "only a hybrid builds on one" in capsys.readouterr().err


def test_identify_says_where_and_how_far_a_held_out_run_leaves_the_training(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = read_run(Path("shown.h5"))
    write_run(Path("far.h5"), with_channel(shown, "displacement", 3.0 * shown.channels["displacement"], "m"))
    words = ["identify", "arx", "learned.h5", "--regressors", "F1 v0", "-o", "a.json", "--held-out"]
    assert main([*words, "far.h5"]) == 0
    assert "\n  far.h5: velocity leaves the training range [" in capsys.readouterr().out
    assert main([*words, "far.h5", "--json"]) == 0
    (sentence,) = json.loads(capsys.readouterr().out)["outside_training"]
    assert sentence.startswith("far.h5: velocity leaves the training range [")


def test_simulate_says_where_and_how_far_a_run_leaves_the_training(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", "arx", "learned.h5", "--regressors", "F1 v0", "-o", "a.json"]) == 0
    shown = read_run(Path("shown.h5"))
    write_run(Path("far.h5"), with_channel(shown, "displacement", 3.0 * shown.channels["displacement"], "m"))
    capsys.readouterr()
    assert main(["simulate", "a.json", "far.h5", "-o", "out.h5"]) == 0
    told = capsys.readouterr().err
    assert told.startswith("damper-rig: far.h5: velocity leaves the training range [")
    assert np.all(np.isfinite(read_run(Path("out.h5")).channels["force_simulated"]))


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["spline", "learned.h5"], ["kind is 'spline'", "nnoe, narx, mlp, arx"]),
        (["arx", "learned.h5", "faster.h5"], ["faster.h5 has 500 Hz", "learned.h5 200 Hz", "--rate"]),
        (["nnoe", "learned.h5", "--nodes", "4"], ["nodes are stated without regressors"]),
        (["nnoe", "learned.h5", "--regressors", "F1 q0"], ["regressor 'q0'"]),
        (["nnoe", "learned.h5", "--regressors", "F1 F2 v0 v1", "--nodes", "64"], ["samples for 389 weights"]),
        (["arx", "absent.h5"], ["absent.h5"]),
        (["arx", "learned.h5", "--rate", "0"], ["rate is 0 Hz"]),
        (["arx", "learned.h5", "--rate", "77.777"], ["200 Hz can't be brought to 77.777 Hz", "77.7777777778 Hz, 7/18"]),
    ],
)
def test_what_cannot_be_identified_is_refused_in_one_line_and_leaves_no_file(
    place: Path, words: list[str], parts: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(path.name for path in place.iterdir())
    assert main(["identify", *words, "-o", "model.json"]) == 2
    said = capsys.readouterr().err.splitlines()[-1]  # after what the data checks found
    assert all(part in said for part in parts), said
    assert sorted(path.name for path in place.iterdir()) == before
