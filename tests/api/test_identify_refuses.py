"""What the issue of black boxes names as bad input: each is refused in one line, with exit status 2 and no file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from identification.physical.model import Model, element
from identification.physical.modelfile import write_model
from rigctl.runfile import Run, read_run, with_channel, write_run
from tests.identification.hysteretic import hysteretic


def cut(run: Run, samples: int) -> Run:
    return replace(run, channels={name: one[:samples] for name, one in run.channels.items()})


def without(run: Run, channel: str) -> Run:
    kept = {name: one for name, one in run.channels.items() if name != channel}
    return replace(run, channels=kept, units={name: run.units[name] for name in kept})


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Runs with every mistake, and models of them."""
    driven, passive = hysteretic(1, 900, current=True), hysteretic(2, 900)
    x = driven.channels["displacement"]
    runs = {
        "driven": driven,
        "passive": passive,
        "short": cut(driven, 120),
        "brief": cut(driven, 320),
        "faster": hysteretic(3, 1200, rate_hz=500.0, current=True),
        "held": with_channel(driven, "current", np.full(x.size, 0.5), "A"),
        "nearly": with_channel(driven, "current", 0.5 + 1e-12 * x / np.max(np.abs(x)), "A"),
        "copied": with_channel(driven, "current", 40.0 * x + 1.0, "A"),
        "pushed": with_channel(driven, "force_wanted", 5e4 + driven.channels["force"], "N"),
        "still": with_channel(driven, "displacement", np.zeros(x.size), "m"),
        "dead": with_channel(driven, "force", np.full(x.size, 7.0), "N"),
        "faint": with_channel(driven, "force", 1e-300 * driven.channels["force"], "N"),
        "minute": with_channel(driven, "displacement", 1e-300 * x, "m"),
        "two": cut(driven, 2),
        "forceless": without(driven, "force"),
    }
    for name, run in runs.items():
        write_run(tmp_path / f"{name}.h5", run)
    parts = (element("viscous_damping", {"c": 300.0, "c_control": 50.0}),)
    write_model(tmp_path / "forward.json", Model(name="forward", elements=parts))
    weak = (element("viscous_damping", {"c": 300.0, "c_control": 5.0}),)
    write_model(tmp_path / "weak.json", Model(name="weak", elements=weak))
    hard = (element("viscous_damping", {"c": 1e300}),)
    write_model(tmp_path / "hard.json", Model(name="hard", elements=hard))
    monkeypatch.chdir(tmp_path)
    assert main(["identify", "arx", "driven.h5", "--regressors", "F1 v0 i0", "-o", "needs_current.json"]) == 0
    return tmp_path


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["identify", "nnoe", "short.h5"], ["the longest run has 120 samples", "at least one run needs 300"]),
        (
            ["identify", "narx", "brief.h5", "--layers", "20,20", "--regressors", "F1 v0"],
            ["samples for", "weights: at least 3 for each"],
        ),
        (["identify", "arx", "held.h5", "--regressors", "F1 v0 i0"], ["current does not vary in these runs: leave it"]),
        (["identify", "arx", "driven.h5", "--regressors", "F1 v0 v0"], ["regressor v0 is given twice: leave one out"]),
        (
            ["identify", "arx", "copied.h5", "--regressors", "F1 x0 i0"],
            ["current is displacement times a constant", "leave one of them out of the regressors"],
        ),
        (["identify", "mlp", "still.h5"], ["still.h5", "displacement"]),
        (["identify", "hybrid", "faint.h5"], ["faint.h5: channel 'force' is frozen at"]),
        (["identify", "hybrid", "minute.h5"], ["minute.h5: channel 'displacement' is frozen at"]),
        (
            ["identify", "nnoe", "driven.h5", "faster.h5"],
            ["faster.h5 has 500 Hz, driven.h5 200 Hz", "one sample rate", "(--rate)"],
        ),
        (["identify", "inverse", "driven.h5", "faster.h5"], ["faster.h5 has 500 Hz, driven.h5 200 Hz"]),
        (["simulate", "needs_current.json", "passive.h5"], ["passive.h5 has no control current, which the black box"]),
        (
            ["simulate", "needs_current.json", "faster.h5"],
            ["faster.h5: 'needs_current' was identified at 200 Hz and the run has 500 Hz"],
        ),
        (
            ["identify", "arx", "driven.h5", "--held-out", "passive.h5"],
            ["passive.h5 has no current, driven.h5 has: give runs that all have it"],
        ),
        *(
            (["identify", kind, "driven.h5", "--held-out", f"{run}.h5"], [f"{run}.h5: {said}"])
            for kind in ("arx", "polynomial", "inverse")
            for run, said in (
                ("dead", "channel 'force' is frozen at 7"),
                ("two", "only 2 samples"),
                ("forceless", "no channel 'force'"),
            )
        ),
        (["identify", "nnoe", "driven.h5", "--regressors", "v0 M0"], ["regressors v0 M0", "only a hybrid has one"]),
        (["identify", "polynomial", "driven.h5", "--regressors", "v0 M0"], ["only a hybrid has one"]),
        (["identify", "inverse", "driven.h5", "--regressors", "F0 M0"], ["only a hybrid has one"]),
        (["identify", "mlp", "driven.h5", "--regressors", "F1 v0"], ["hold a past force F: an mlp is static"]),
        (
            ["identify", "mlp", "driven.h5", "--layers", "4", "--regressors", "F1 v0"],
            ["hold a past force F: an mlp is static"],
        ),
        (["identify", "arx", "driven.h5", "--regressors", "v0", "--nodes", "5"], ["arx is a kind without nodes"]),
        (["identify", "arx", "driven.h5", "--select", "--nodes", "5"], ["arx is a kind without nodes"]),
        (["identify", "polynomial", "driven.h5", "--regressors", "v0", "--nodes", "5"], ["is a kind without nodes"]),
        (["identify", "inverse", "nearly.h5"], ["current is 0.5 A in all runs"]),
        (["identify", "arx", "driven.h5", "--regressors", "x" * 5000], ["regressor 'xxx"]),
        (["identify", "arx", "driven.h5", "--regressors", "v\uff10"], ["regressor 'v\uff10'"]),
        (["identify", "narx", "driven.h5", "--layers", "1" * 5000], ["layers are '111"]),
        (["identify", "narx", "driven.h5", "--layers", "\u0663"], ["layers are '\u0663'"]),
        (
            ["identify", "hybrid", "passive.h5", "--base", "hard.json"],
            ["passive.h5: 'hard' gives ", "no machine has more than 1e+12 N"],
        ),
        (
            ["identify", "inverse", "driven.h5", "--base", "weak.json"],
            ["the current changes the force of 'weak' by less than 10 % of its rms at every sample"],
        ),
        (["identify", "inverse", "held.h5"], ["current is 0.5 A in all runs"]),
        (
            ["track", "forward.json", "pushed.h5", "--current", "0", "1"],
            ["pushed.h5: no sample of the wanted force can be made within [0, 1] A", "N are lacking"],
        ),
    ],
)
def test_it_is_refused_in_one_line_and_nothing_is_written(
    place: Path, words: list[str], parts: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(path.name for path in place.iterdir())
    capsys.readouterr()
    assert main([*words, "-o", "made.h5"]) == 2
    said = capsys.readouterr()
    (refusal,) = said.err.splitlines()  # what the data checks find is said of runs that can be used
    assert all(part in refusal for part in parts), said.err
    assert len(refusal) < 500
    assert not said.out
    assert sorted(path.name for path in place.iterdir()) == before


@pytest.mark.parametrize(
    "words",
    [["identify", "arx", "driven.h5"], ["identify", "inverse", "faster.h5", "--held-out", "driven.h5"],
     ["identify", "multiaxis", "driven.h5"], ["fit", "forward.json", "faster.h5", "driven.h5"]],
    ids=" ".join,
)  # fmt: skip
def test_a_model_is_not_written_over_a_run_that_it_is_made_of(
    place: Path, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = (place / "driven.h5").read_bytes()
    capsys.readouterr()
    assert main([*words, "-o", str(place / "driven.h5")]) == 2
    (refusal,) = capsys.readouterr().err.splitlines()
    assert "driven.h5: is a run that this command reads: give another place" in refusal
    assert (place / "driven.h5").read_bytes() == before


def test_runs_of_two_rates_are_resampled_on_request(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["identify", "arx", "driven.h5", "faster.h5", "--rate", "100", "--regressors", "F1 v0 i0"]
    assert main([*given, "-o", "both.json"]) == 0
    assert read_run(Path("faster.h5")).sample_rate_hz == 500.0
    capsys.readouterr()
    assert main(["simulate", "both.json", "driven.h5", "-o", "out.h5"]) == 2
    assert "identified at 100 Hz" in capsys.readouterr().err
    assert main(["simulate", "both.json", "driven.h5", "--rate", "100", "-o", "out.h5"]) == 0
    assert (read_run(Path("out.h5")).sample_rate_hz, read_run(Path("out.h5")).samples) == (100.0, 450)
    assert main(["compare", "both.json", "--runs", "driven.h5", "--rate", "100", "-o", "out.html", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out.partition("\n")[2])["models"]
    assert row["fit"] > 30.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"kind": "physical", "paths": {"core": [{"element": "a\x1b[31mb\x07", "parameters": {}}]}},
            "a\\x1b[31mb\\x07",
        ),
        ({"facts": {"y" * 1_000_000: "x"}}, " … "),
        ({"format": [1] * 5000}, "[1, 1, 1"),
    ],
)
def test_what_a_file_says_neither_commands_the_terminal_nor_fills_it(
    place: Path, changes: dict[str, object], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    data = json.loads(Path("needs_current.json").read_text()) | changes
    Path("hostile.json").write_text(json.dumps(data))
    capsys.readouterr()
    assert main(["simulate", "hostile.json", "driven.h5", "-o", "made.h5"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.isprintable()
    assert words in line
    assert len(line) < 3100
