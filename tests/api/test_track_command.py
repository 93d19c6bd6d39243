"""`damper-rig identify inverse` and `damper-rig track`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from identification.blackbox import resampled
from identification.physical.model import Model, element
from identification.physical.modelfile import write_model
from rigctl.runfile import read_run, with_channel, write_run
from tests.identification.hysteretic import hysteretic

CHOSEN = ["--regressors", "F0 F1 v0 v1", "--nodes", "4"]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with runs of a damper that is controlled by a current, and a forward model."""
    for name, seed in (("one.h5", 1), ("other.h5", 2), ("shown.h5", 3)):
        write_run(tmp_path / name, hysteretic(seed, 700, current=True))
    write_run(tmp_path / "passive.h5", hysteretic(4, 700))
    parts = (
        element("viscous_damping", {"c": 300.0, "c_control": 50.0}),
        element("tanh_hysteresis", {"alpha": 60.0, "alpha_control": 80.0, "beta": 30.0, "delta": 0.0}),
    )
    write_model(tmp_path / "forward.json", Model(name="forward", elements=parts))
    write_model(tmp_path / "passive.json", Model(name="passive", elements=(element("viscous_damping", {"c": 300.0}),)))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_an_inverse_is_identified_and_tracks_a_force(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["identify", "inverse", "one.h5", "other.h5", "--held-out", "shown.h5", "--base", "forward.json", *CHOSEN]
    assert main([*given, "-o", "inverse.json", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["candidate"] == "v0 v1 F0 F1, 4 nodes"
    assert figures["by_forward"][0]["fit"] > figures["tracked"][0]["fit"] > 50.0
    assert main(["track", "inverse.json", "shown.h5", "-o", "tracked.h5", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["fit"] == pytest.approx(figures["tracked"][0]["fit"])
    made = read_run(Path("tracked.h5"))
    assert made.units["current_tracking"] == "A"
    assert np.ptp(made.channels["current_tracking"]) > 0.1
    assert main(["score", "tracked.h5"]) == 0
    assert json.loads(capsys.readouterr().out)["fit"] == pytest.approx(told["fit"])


def test_a_forward_model_is_inverted_and_what_cannot_be_made_is_said(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = read_run(Path("shown.h5"))
    write_run(Path("more.h5"), with_channel(shown, "force_wanted", 2.0 * shown.channels["force"], "N"))
    assert main(["track", "forward.json", "more.h5", "--current", "0", "1", "-o", "out.h5"]) == 0
    said = capsys.readouterr()
    assert "more.h5: the wanted force cannot be made in" in said.err
    assert "A can give; there the current gives another force" in said.err
    assert "of the samples cannot be made (fit of the others " in said.out
    made = read_run(Path("out.h5"))
    wanted, given = made.channels["force_wanted"], made.channels["force_simulated"]
    assert np.max(np.abs(given)) < np.max(np.abs(wanted))


def test_where_only_a_part_of_a_force_can_be_made_the_help_says_what_is_written(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["track", "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "the exit status is 0" in said


def test_a_run_of_another_rate_is_refused_and_tracked_where_it_is_resampled(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", "inverse", "one.h5", "--base", "forward.json", *CHOSEN, "-o", "inverse.json"]) == 0
    rate = read_run(Path("shown.h5")).sample_rate_hz
    write_run(Path("slow.h5"), resampled(read_run(Path("shown.h5")), 0.5 * rate))
    capsys.readouterr()
    assert main(["track", "inverse.json", "slow.h5", "-o", "out.h5"]) == 2
    assert f"--rate {rate:g}" in capsys.readouterr().err
    assert not Path("out.h5").exists()
    assert main(["track", "inverse.json", "slow.h5", "--rate", f"{rate:g}", "-o", "out.h5"]) == 0
    assert read_run(Path("out.h5")).sample_rate_hz == rate


def test_a_constant_force_is_tracked_without_a_fit_that_is_no_number(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = read_run(Path("one.h5"))
    write_run(Path("still.h5"), with_channel(shown, "force_wanted", np.zeros(shown.samples), "N"))
    assert main(["track", "forward.json", "still.h5", "--current", "0", "1", "-o", "out.h5"]) == 0
    said = capsys.readouterr().out
    assert "a constant force is wanted, it is missed by" in said
    assert "inf" not in said


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["track", "forward.json", "one.h5"], ["'forward' states no range of the current", "--current LOW HIGH"]),
        (["track", "passive.json", "one.h5"], ["'passive' has no current among its inputs: it cannot be inverted"]),
        (["track", "forward.json", "one.h5", "--current", "1", "0"], ["limits of the current are [1, 0] A"]),
        (["track", "forward.json", "one.h5", "--current", "0", "1", "--wanted", "p"], ["one.h5: no channel 'p'"]),
        (["track", "forward.json", "far.h5", "--current", "0", "1"], ["no sample of the wanted force can be made"]),
        (["identify", "inverse", "passive.h5", "--base", "forward.json"], ["passive.h5 has no control current"]),
        (
            ["identify", "inverse", "one.h5", "--regressors", "v0 i1", "--base", "forward.json"],
            ["regressors hold no wanted force F"],
        ),
        (["identify", "inverse", "one.h5", "--nodes", "3"], ["nodes are stated without regressors"]),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line_and_leaves_no_file(
    place: Path, words: list[str], parts: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    one = read_run(Path("one.h5"))
    write_run(Path("far.h5"), with_channel(one, "force_wanted", one.channels["force"] + 5e4, "N"))
    before = sorted(path.name for path in place.iterdir())
    assert main([*words, "-o", "made.h5"]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert all(part in said for part in parts), said
    assert sorted(path.name for path in place.iterdir()) == before
