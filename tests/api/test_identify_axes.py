"""`damper-rig identify multiaxis`: single tests of a rig of several axes, and what simulate makes of the model."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from identification.multiaxis import identify_axes, write_multiaxis
from identification.physical.model import Model, element
from identification.physical.modelfile import write_model
from rigctl.runfile import Run, read_run, with_channel, write_run
from tests.identification.six_axes import by_formula, motion, singles_of

AXES = ("x", "y", "z", "rx", "ry", "rz")
SINGLES = [f"{name}.h5" for name in AXES]


@pytest.fixture(scope="module")
def runs() -> dict[str, Run]:
    together = by_formula(motion(1), "together")
    product = together.channels["displacement"] * together.channels["displacement_rz"]
    made = dict(zip(AXES, singles_of(motion(1), by_formula), strict=True))
    return {
        **made,
        "together": together,
        "coupled": with_channel(together, "torque_z", together.channels["torque_z"] + 1e5 * product, "N·m"),
        "shown": by_formula(motion(2), "shown"),
        "slow": replace(made["y"], sample_rate_hz=50.0),
        "again": by_formula(motion(5) * (np.arange(6) == 0), "again"),
        "still": by_formula(0.0 * motion(1), "still"),
    }


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, runs: dict[str, Run]) -> Path:
    """A folder with the runs, and a base of the main axis, in which the commands run."""
    for name, run in runs.items():
        write_run(tmp_path / f"{name}.h5", run)
    write_model(tmp_path / "base.json", Model(name="oil", elements=(element("viscous_damping", {"c": 3e4}),)))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_single_tests_become_a_model_of_all_axes(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    held_out = ["--held-out", "together.h5", "--held-out", "coupled.h5", "--held-out", "shown.h5"]
    given = ["identify", "multiaxis", *SINGLES, *held_out, "--base", "base.json", "-o", "six.json"]
    assert main([*given, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["superposed"] == 6
    assert said["axes"]["torque_y"] == ["displacement_z", "displacement_ry"]
    assert said["superposition_fails"] == {"together.h5": [], "coupled.h5": ["torque_z"]}
    assert min(said["fit_held_out"]["shown.h5"].values()) > 80.0
    assert main(["simulate", "six.json", "shown.h5", "-o", "out.h5"]) == 0
    made = read_run(place / "out.h5")
    assert made.units["torque_x_simulated"] == "N·m"
    force, given_force = made.channels["force"], made.channels["force_simulated"]
    fit = 100.0 * (1.0 - np.linalg.norm(force - given_force) / np.linalg.norm(force - force.mean()))
    assert fit == pytest.approx(said["fit_held_out"]["shown.h5"]["force"])
    capsys.readouterr()
    assert main(["score", "out.h5"]) == 0
    assert json.loads(capsys.readouterr().out)["fit"] == pytest.approx(fit)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["identify", "multiaxis", *SINGLES, "again.h5", "-o", "o.json"], "displacement is moved by 2 runs, "),
        (["identify", "multiaxis", *SINGLES, "together.h5", "-o", "o.json"], "x.h5 moves displacement alone, together"),
        (["identify", "multiaxis", "x.h5", "slow.h5", "-o", "o.json"], "slow.h5 has 50 Hz, x.h5 100 Hz"),
        (["identify", "multiaxis", "x.h5", "still.h5", "-o", "o.json"], "still.h5 moves no axis: leave it out"),
        (["identify", "multiaxis", "x.h5", "y.h5", "--nodes", "4", "-o", "o.json"], "chosen by correlation"),
    ],
)
def test_what_cannot_be_identified_is_refused_in_one_line(
    place: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    assert main(words) == 2
    error = capsys.readouterr().err.strip().splitlines()
    assert len(error) == 1
    assert said in error[0]
    assert not (place / "o.json").exists()


def test_a_file_of_several_axes_is_checked_and_has_no_place_among_models_of_one(
    place: Path, runs: dict[str, Run], capsys: pytest.CaptureFixture[str]
) -> None:
    write_multiaxis("six.json", identify_axes([runs["together"]]))
    assert main(["simulate", "six.json", "x.h5", "--band", "80", "-o", "out.h5"]) == 2
    assert "no band" in capsys.readouterr().err
    whole = json.loads(Path("six.json").read_text())
    for change, where in (
        ({"loads": {**whole["loads"], "heat": {}}}, "loads.heat is no load"),
        ({"loads": {"force": {**whole["loads"]["force"], "axes": ["up"]}}}, "loads.force.axes is ['up']"),
        ({"loads": {"force": {**whole["loads"]["force"], "weights": [1.0]}}}, "loads.force.weights: 1 numbers"),
        ({"signals": {}}, "signals.displacement is missing"),
        ({"sample_rate": 0}, "sample rate is 0 Hz"),
        ({"base": {"kind": "physical"}}, "base: format is None"),
    ):
        Path("bad.json").write_text(json.dumps({**whole, **change}))
        assert main(["simulate", "bad.json", "shown.h5", "-o", "out.h5"]) == 2
        assert f"bad.json: {where}" in capsys.readouterr().err


def test_compare_takes_the_main_force_of_several_axes_beside_a_model_of_one(
    place: Path, runs: dict[str, Run], capsys: pytest.CaptureFixture[str]
) -> None:
    write_multiaxis("six.json", identify_axes([runs["together"]]))
    write_model(Path("one.json"), Model(name="one", elements=(element("viscous_damping", {"c": 600.0}),)))
    capsys.readouterr()
    assert main(["compare", "one.json", "six.json", "--runs", "shown.h5", "-o", "page.html", "--json"]) == 0
    one, six = json.loads(capsys.readouterr().out)["models"]
    assert (six["kind"], six["training_range"]) == ("multiaxis", "stated")
    assert six["fit"] > max(80.0, one["fit"])
    assert six["parameters"] > 12
    assert set(six["runs"][0]["outside_training"]) <= {"displacement", "displacement_y"}
    assert main(["compare", "six.json", "--runs", "x.h5", "--rate", "50", "-o", "page.html", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["models"]
    assert "identified at" in row["runs"][0]["failure"]
