"""``damper-rig design``: every shipped configuration, the rig's envelope, charts, and the same design again."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

import damper_rig as dr
from api.cli.main import main
from excitation import Excitation, TestPlan, read_excitation, read_plan
from excitation.plan_files import holds_a_plan
from tests.shown_lines import ROOT, blocks

EXAMPLES = Path(__file__).parents[2] / "examples"
CONFIGURATIONS = sorted(p for p in EXAMPLES.glob("*.toml") if p.read_text().startswith("# damper-rig design "))
RIG = str(EXAMPLES / "rig_25kn.toml")
SINE = "sample_rate = 1000.0\n[[series]]\namplitude = {amplitude}\nfrequency = {frequency}\ncurrent = 1.0\n"


def made(path: Path) -> Excitation | TestPlan:
    return read_plan(path) if holds_a_plan(path) else read_excitation(path)


def sine(place: Path, amplitude: float, frequency: float) -> str:
    path = place / "sine.toml"
    path.write_text(SINE.format(amplitude=amplitude, frequency=frequency))
    return str(path)


def samples(path: Path) -> list[bytes]:
    content = made(path)
    tests = [content] if isinstance(content, Excitation) else [test.excitation for test in content.tests]
    return [part.tobytes() for e in tests for part in (e.displacement_m, e.current_a) if part is not None]


LONGER = ("homogenised", "homogenised_levels", "homogenised_passive", "mr_seat_damper_matrix")


@pytest.mark.parametrize(
    "config",
    [
        pytest.param(path, id=path.stem, marks=pytest.mark.slow if path.stem in LONGER else [])
        for path in CONFIGURATIONS
    ],
)
def test_every_shipped_configuration_is_designed_and_made_again_to_the_last_bit(
    config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = config.read_text().split()[3]
    first, again = tmp_path / "first.h5", tmp_path / "again.h5"
    assert main(["design", command, str(config), "-o", str(first), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["duration_s"] > 0
    assert main(["design", "--from", str(first), "-o", str(again)]) == 0
    assert samples(first) == samples(again)


def test_every_example_that_is_no_envelope_names_its_command() -> None:
    def named(path: Path) -> bool:
        lines = [line for line in path.read_text().splitlines() if line.startswith("#")]
        return any("damper-rig design " in line and f"examples/{path.name}" in line for line in lines)

    assert {p.stem for p in EXAMPLES.glob("*.toml") if not named(p)} == {"rig_25kn"}


@pytest.mark.parametrize(
    ("amplitude", "frequency", "words"),
    [
        (0.1, 0.2, ["displacement 0.1 m", "the limit is 0.075 m", "33.3 % above", "amplitude = 0.075"]),
        (0.06, 5.0, ["velocity 1.885 m/s", "the limit is 1.6 m/s", "17.8 % above", "amplitude =", "or frequency ="]),
        (0.001, 62.5, ["frequency 62.5 Hz", "the limit is 50 Hz", "25 % above", "change the frequency"]),
    ],
)
def test_a_test_beyond_the_rig_is_refused_with_the_limit_the_excess_and_the_nearest_that_fits(
    amplitude: float, frequency: float, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = sine(tmp_path, amplitude, frequency)
    output = tmp_path / "plan.h5"
    assert main(["design", "harmonic", config, "-o", str(output), "--envelope", RIG]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    for word in ("sine.toml", f"test 'sine_{1000 * amplitude:g}mm_{frequency:g}Hz_1A'", *words):
        assert word in said.err, said.err
    assert not output.exists()


def test_scaled_to_fit_the_plan_keeps_every_limit_and_is_otherwise_the_same(tmp_path: Path) -> None:
    config, output = sine(tmp_path, 0.1, 0.2), tmp_path / "plan.h5"
    assert main(["design", "harmonic", config, "-o", str(output), "--envelope", RIG, "--scale-to-fit"]) == 0
    plan = read_plan(output)
    assert float(np.abs(plan.tests[0].excitation.displacement_m).max()) == pytest.approx(0.075, rel=1e-3)
    assert main(["design", "--from", str(output), "-o", str(tmp_path / "again.h5"), "--envelope", RIG]) == 0


def test_a_model_of_the_damper_predicts_the_force_in_place_of_the_envelope(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "stiff.json"
    element = {"element": "viscous_damping", "parameters": {"c": 35000.0}}
    content = {"format": "damper-rig/model", "format_version": 1, "name": "stiff", "kind": "physical"}
    model.write_text(json.dumps({**content, "paths": {"core": [element]}}))
    arguments = ["design", "harmonic", sine(tmp_path, 0.05, 2.0), "-o", str(tmp_path / "plan.h5"), "--envelope", RIG]
    assert main(arguments) == 0
    assert main([*arguments, "--model", str(model)]) == 2
    assert "force 2.199e+04 N, the limit is 2e+04 N" in capsys.readouterr().err


@pytest.mark.parametrize("name", [pytest.param("homogenised_passive", marks=pytest.mark.slow), "yaw_damper_30_tests"])
def test_charts_are_one_page_that_opens_offline(name: str, tmp_path: Path) -> None:
    config = EXAMPLES / f"{name}.toml"
    plot = tmp_path / "charts.html"
    command = config.read_text().split()[3]
    assert main(["design", command, str(config), "-o", str(tmp_path / "x.h5"), "--plot", str(plot)]) == 0
    page = plot.read_text()
    assert page.startswith("<!DOCTYPE html>")
    assert '<script src="http' not in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["design", "--from", "absent.h5", "-o", "out.h5"], ["absent.h5"]),
        (["design", "-o", "out.h5"], ["--from"]),
        (["design", "--from", "x.h5", "harmonic", "sine.toml", "-o", "out.h5"], ["after 'harmonic'"]),
        (["design", "--from", "x.h5", "-o", "out.h5", "--scale-to-fit"], ["--scale-to-fit", "--envelope"]),
        (["design", "harmonic", "sine.toml", "-o", "out.h5", "--scale-to-fit"], ["--scale-to-fit", "--envelope"]),
        (["design", "harmonic", "sine.toml", "-o", "out.h5", "--model", "m.json"], ["--model", "--envelope"]),
        (["design", "harmonic", "sine.toml", "-o", "out.h5", "--envelope", "absent.toml"], ["absent.toml"]),
        (["design", "harmonic", "sine.toml", "-o", "out.h5", "--envelope", "sine.toml"], ["sine.toml", "motion"]),
        (["design", "harmonic", "sine.toml", "-o", "out.h5", "--plot", "out.png"], ["out.png", ".html"]),
        (["design", "harmonic", "sine.toml", "-o", "out.h5", "--plot", "absent/out.html"], ["absent"]),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line_and_leaves_nothing(
    arguments: list[str],
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    sine(tmp_path, 0.01, 1.0)
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1, said.err
    assert all(word in said.err for word in words), said.err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["sine.toml"]


@pytest.mark.parametrize("words", [[], ["harmonic"]])
def test_the_keys_of_a_configuration_are_told(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["design", "--explain-keys", *words]) == 0
    text = capsys.readouterr().out
    assert "peak_velocity" in text
    assert ("period_samples" in text) == (not words)
    assert main(["design", "--explain-keys", "--json", *words]) == 0
    told = json.loads(capsys.readouterr().out)
    assert {key["unit"] for key in told["harmonic"] if key["name"] == "peak_velocity"} == {"m/s"}


SPOILED = """sample_rate = 500.0
period_samples = 1000
realisations = 2
[displacement]
f_min = 0.5
f_max = 20.0
lines = "odd"
max_displacement = 0.01
max_velocity = 0.5
[current]
f_min = 0.5
f_max = 30.0
lines = "all"
min = 0.3
max = 1.2
"""


def test_a_current_on_the_detection_lines_of_the_displacement_is_told_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "spoiled.toml"
    config.write_text(SPOILED)
    words = ["design", "random-phase", str(config), "-o", str(tmp_path / "plan.h5"), "--json"]
    assert main(words) == 0
    told = capsys.readouterr()
    assert "level_1_realisation_1 and 1 more: current excites 19 of the 19 lines" in told.err
    assert told.err.count("\n") == 1
    assert json.loads(told.out)["warnings"][0] in told.err
    config.write_text(SPOILED.replace('"all"', '"odd"'))
    assert main(words) == 0
    assert capsys.readouterr().err == ""


def test_a_notebook_warns_of_it(tmp_path: Path) -> None:
    config = tmp_path / "spoiled.toml"
    config.write_text(SPOILED)
    with pytest.warns(dr.DesignWarning, match="current excites"):
        dr.design("random-phase", config)


def test_what_the_page_of_signals_shows_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    page = ROOT / "docs" / "excitation.md"
    lines = [shlex.split(line)[1:] for block in blocks(page, "sh") for line in block.splitlines()]
    assert len(lines) >= 5
    assert [line for line in lines if main(line) != 0] == []
    for block in blocks(page, "python"):
        exec(compile(block, page.name, "exec"), {})
    assert (tmp_path / "sweep.html").stat().st_size > 100_000


def test_what_exceeds_the_rig_is_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "two.toml"
    config.write_text("sample_rate = 1000.0\n[[series]]\namplitude = [0.01, 0.1]\nfrequency = 1.0\n")
    words = [
        "design",
        "harmonic",
        str(config),
        "-o",
        str(tmp_path / "two.csv"),
        "--envelope",
        RIG,
        "--on-excess",
        "drop",
    ]
    assert main(words) == 0
    assert "sine_100mm_1Hz: dropped: displacement 0.1 m, the limit is 0.075 m" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    [change] = json.loads(capsys.readouterr().out)["changes"]
    assert change.startswith("sine_100mm_1Hz: dropped")


def test_what_was_scaled_is_said_of_a_single_excitation_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "wide.toml"
    config.write_text(
        "sample_rate = 1000.0\nf_start = 0.5\nf_end = 2.0\nduration = 20.0\n"
        "[bounds]\nmax_displacement = 0.1\nmax_velocity = 1.0\n"
    )
    words = ["design", "sweep", str(config), "-o", str(tmp_path / "wide.h5"), "--envelope", RIG, "--scale-to-fit"]
    assert main(words) == 0
    said = capsys.readouterr().out.splitlines()[1]
    assert said.startswith("excitation: scaled, level 1 →")
    assert read_excitation(tmp_path / "wide.h5").figures["changes"] == [said]
