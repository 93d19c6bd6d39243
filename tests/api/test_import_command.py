"""``damper-rig import`` at the command line: one file, many files, a mapping, and what is said of other files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from rigctl.runfile import read_run
from tests.foreign.dyno_files import FORCE_N, SAMPLES, TIME, V_M_S, X_M, german, plain, rows
from tests.foreign.example_dyno import PATH, written

Said = pytest.CaptureFixture[str]


def imports(*words: object) -> int:
    return main(["import", *map(str, words)])


def test_what_was_taken_is_shown_in_one_table_and_the_notes_beside_it(tmp_path: Path, capsys: Said) -> None:
    german(tmp_path / "dyno.csv")
    assert imports(tmp_path / "dyno.csv", "-o", tmp_path / "run.h5") == 0
    shown = capsys.readouterr()
    for word in (
        "columns apart by semicolon, decimal comma",
        "Kolbenweg",
        "Dämpferkraft",
        "kN",
        "2000 samples at 500 Hz",
    ):
        assert word in shown.out
    assert "positive displacement is extension" in shown.out
    assert shown.err == ""
    assert read_run(tmp_path / "run.h5").samples == SAMPLES


def test_the_same_as_json_and_nothing_is_written_by_a_dry_run(tmp_path: Path, capsys: Said) -> None:
    german(tmp_path / "dyno.csv")
    assert imports(tmp_path / "dyno.csv", "-o", tmp_path / "run.h5", "--dry-run", "--json") == 0
    (one,) = json.loads(capsys.readouterr().out)
    assert [c["column"] for c in one["runs"][0]["columns"]][:2] == ["Zeit", "Kolbenweg"]
    assert not (tmp_path / "run.h5").exists()


def test_options_say_what_the_file_does_not(tmp_path: Path, capsys: Said) -> None:
    (tmp_path / "a.csv").write_text("Zeit,Stroke,Force\n" + rows([TIME, 1e3 * X_M, -1e-3 * FORCE_N], ","))
    given = ("--time", "Zeit:s", "--displacement", "Stroke:mm", "--force", "Force:kN", "--flip", "force")
    assert imports(tmp_path / "a.csv", "-o", tmp_path / "a.h5", *given) == 0
    run = read_run(tmp_path / "a.h5")
    assert np.allclose(run.channels["force"], FORCE_N, atol=1e-3)
    (tmp_path / "b.csv").write_text((tmp_path / "a.csv").read_text())
    assert imports(tmp_path / "b.csv", "-o", tmp_path / "b.h5", "--like", tmp_path / "a.h5") == 0
    assert np.array_equal(read_run(tmp_path / "b.h5").channels["force"], run.channels["force"])
    capsys.readouterr()


def test_further_axes_are_taken_as_stated_and_never_guessed(tmp_path: Path, capsys: Said) -> None:
    names = "Time (s),Stroke (mm),Force (kN),Roll (deg),Mx (kN·m),Fy (N)\n"
    columns = [TIME, 1e3 * X_M, 1e-3 * FORCE_N, 57.29577951 * X_M, 1e-3 * FORCE_N, FORCE_N]
    (tmp_path / "six.csv").write_text(names + rows(columns, ","))
    taken = ("--axis", "displacement_rx=Roll", "--axis", "torque_x=Mx", "--axis", "force_y=Fy:N", "--flip", "torque_x")
    assert imports(tmp_path / "six.csv", "-o", tmp_path / "six.h5", *taken) == 0
    run = read_run(tmp_path / "six.h5")
    assert (run.units["displacement_rx"], run.units["torque_x"], run.units["force_y"]) == ("rad", "N·m", "N")
    assert np.allclose(run.channels["displacement_rx"], X_M, atol=1e-6)
    assert np.allclose(run.channels["torque_x"], -FORCE_N, atol=1e-2)
    assert imports(tmp_path / "six.csv", "-o", tmp_path / "one.h5") == 0
    assert set(read_run(tmp_path / "one.h5").channels) == {"displacement", "force"}
    for word in ("up=Roll", "torque_x", "force=Fy"):
        capsys.readouterr()
        assert imports(tmp_path / "six.csv", "-o", tmp_path / "bad.h5", "--axis", word) == 2
        assert "write CHANNEL=COLUMN[:UNIT]" in capsys.readouterr().err
    assert imports(tmp_path / "six.csv", "-o", tmp_path / "bad.h5", "--axis", "torque_x=Roll") == 2
    assert "'deg' is no unit of it: write one such as N·m or kN·m" in capsys.readouterr().err


def test_a_force_of_other_polarity_is_recognised_and_stays_as_it_is(tmp_path: Path, capsys: Said) -> None:
    (tmp_path / "a.csv").write_text("Time (s),Stroke (mm),Force (N)\n" + rows([TIME, 1e3 * X_M, -FORCE_N], ","))
    assert imports(tmp_path / "a.csv", "-o", tmp_path / "a.h5") == 0
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "--flip force, if that is so" in said
    assert np.allclose(read_run(tmp_path / "a.h5").channels["force"], -FORCE_N, atol=1e-5)


def test_an_archive_is_read_by_one_command_and_one_mapping(tmp_path: Path, capsys: Said) -> None:
    lab = tmp_path / "archive"
    for name, sign in (("cold/a.csv", 1.0), ("cold/b.csv", 1.0), ("old/a.csv", -1.0)):
        (lab / name).parent.mkdir(parents=True, exist_ok=True)
        (lab / name).write_text("t,w,k\n" + rows([TIME, 1e3 * X_M, sign * FORCE_N], ","))
    plain(lab / "old" / "notes.csv")
    (lab / "cold" / "broken.csv").write_text("t,w,k\n1,2\n")
    (tmp_path / "lab.toml").write_text(
        'time = "t:s"\ndisplacement = "w:mm"\nforce = "k:N"\nspecimen = "front left"\n'
        '[[files]]\nmatch = "old/*"\nflip = ["force"]\n[[files]]\nmatch = "*notes*"\nskip = true\n'
    )
    assert imports(lab, "--mapping", tmp_path / "lab.toml", "-o", tmp_path / "runs") == 2
    shown = capsys.readouterr().out.splitlines()
    assert shown[-1] == "4 files, 3 runs, 1 refused"
    assert any(line.startswith("cold/broken.csv") and "refused: " in line for line in shown)
    found = sorted((tmp_path / "runs").rglob("*.h5"))
    assert [str(path.relative_to(tmp_path / "runs")) for path in found] == ["cold/a.h5", "cold/b.h5", "old/a.h5"]
    for path in found:
        run = read_run(path)
        assert run.specimen == "front left"
        assert np.allclose(run.channels["force"], FORCE_N, atol=1e-5)


@pytest.mark.parametrize(
    ("mapping", "word"),
    [
        ("time = 3", "time is 3"),
        ('zeit = "t:s"', "'zeit' is unknown"),
        ("[[files]]\nskip = true", "match is missing"),
        ('[[files]]\nmatch = "*"\nskip = 1', "skip is 1"),
        ('flip = ["torque"]', "'torque' is unknown"),
        ("rate_hz = -1", "-1"),
        ("a = [", "not a TOML file"),
    ],
)
def test_a_mapping_that_says_something_else_is_refused(mapping: str, word: str, tmp_path: Path, capsys: Said) -> None:
    plain(tmp_path / "a.csv")
    (tmp_path / "lab.toml").write_text(mapping)
    assert imports(tmp_path / "a.csv", "--mapping", tmp_path / "lab.toml", "-o", tmp_path / "runs") == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert word in said
    assert not (tmp_path / "runs").exists()


def test_an_output_that_cannot_be_written_is_said_before_a_file_is_read(tmp_path: Path, capsys: Said) -> None:
    (tmp_path / "a.csv").write_text("this is no table")
    (tmp_path / "place").write_text("a file")
    for place in (tmp_path / "place" / "run.h5", tmp_path / "place"):
        assert imports(tmp_path / "a.csv", "-o", place) == 2
        assert "not a folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("run.csv", b"Time (s),x\n0,1\n", "make one of it with 'damper-rig import run.csv -o run.h5'"),
        ("run.xlsx", b"PK\x03\x04", "make one of it with 'damper-rig import run.xlsx -o run.h5'"),
        ("run.toml", b"kind = 'sine'\n", "'damper-rig design'"),
        ("run.json", b'{"format": "damper-rig/model"}', "a model where a run file is due"),
        ("run", '\ufeff{"name": "Dämpfer"}'.encode(), "a model where a run file is due"),
        ("run.bin", b"\x00\x01", "'damper-rig import' makes one"),
        ("folder", None, "a folder where a run file is due"),
    ],
)
@pytest.mark.parametrize("command", ["fit", "explain", "characterise", "analyse", "compare", "simulate"])
def test_what_is_no_run_is_said_with_what_makes_one(
    command: str, name: str, content: bytes | None, word: str, tmp_path: Path, capsys: Said
) -> None:
    path, model = tmp_path / name, str(PATH.parent / "models" / "passive.json")
    path.mkdir() if content is None else path.write_bytes(content)
    words = {
        "fit": ["fit", model, str(path), "-o", str(tmp_path / "m.json")],
        "explain": ["explain", model, str(path), "-o", str(tmp_path / "report")],
        "characterise": ["characterise", str(path), "-o", str(tmp_path / "s.html")],
        "analyse": ["analyse", str(path), "-o", str(tmp_path / "a.html")],
        "compare": ["compare", model, "--runs", str(path), "-o", str(tmp_path / "c.html")],
        "simulate": ["simulate", model, str(path), "-o", str(tmp_path / "o.h5")],
    }[command]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert word in said


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("a.csv", b"1,2", "'damper-rig import' makes a run of it"),
        ("a.h5", b"\x89HDF\r\n\x1a\n", "the model stands first"),
        ("a.toml", b"a = 1", "models are JSON"),
        ("folder", None, "a folder where a model is due"),
    ],
)
def test_what_is_no_model_is_said_with_what_it_is(
    name: str, content: bytes | None, word: str, tmp_path: Path, capsys: Said
) -> None:
    path = tmp_path / name
    path.mkdir() if content is None else path.write_bytes(content)
    run = a_run(tmp_path / "run.h5")
    for command in (["fit", str(path), run, "-o", "x.json"], ["simulate", str(path), run, "-o", "x.h5"]):
        assert main(command) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert word in said


def a_run(path: Path, **changes: object) -> str:
    from dataclasses import replace

    from rigctl.foreign_files import Choice, import_file
    from rigctl.runfile import write_run

    plain(path.with_suffix(".csv"))
    (one,) = import_file(path.with_suffix(".csv"), Choice())
    write_run(path, replace(one.run, **changes))  # type: ignore[arg-type]
    return str(path)


def test_a_run_in_millimetres_is_refused_by_every_command_in_words(tmp_path: Path, capsys: Said) -> None:
    wrong = a_run(tmp_path / "a.h5", channels={"displacement": 1e3 * X_M, "force": FORCE_N})
    model = str(PATH.parent / "models" / "passive.json")
    for words in (
        ["fit", model, wrong, "-o", str(tmp_path / "m.json")],
        ["characterise", wrong, "-o", str(tmp_path / "s.html")],
        ["simulate", model, wrong, "-o", str(tmp_path / "o.h5")],
        ["explain", model, wrong, "-o", str(tmp_path / "report")],
    ):
        assert main(words) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert "it looks like millimetres stored as metres" in said


def test_the_same_measurement_given_twice_is_refused(tmp_path: Path, capsys: Said) -> None:
    one, other = a_run(tmp_path / "a.h5"), a_run(tmp_path / "b.h5")
    model = str(PATH.parent / "models" / "passive.json")
    assert main(["fit", model, one, other, "-o", str(tmp_path / "m.json")]) == 2
    assert "b.h5 holds the same measurement as a.h5" in capsys.readouterr().err


def test_a_parameter_that_moves_far_is_asked_about(tmp_path: Path, capsys: Said) -> None:
    """Kilonewtons stored as newtons: the fit is good, and every parameter a thousandth."""
    small = a_run(tmp_path / "a.h5", channels={"displacement": X_M, "force": 1e-3 * 2000.0 * V_M_S})
    model = tmp_path / "m.json"
    model.write_text(
        '{"format": "damper-rig/model", "format_version": 1, "name": "m", "kind": "physical", '
        '"paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 2000.0}}]}}'
    )
    assert main(["fit", str(model), small, "-o", str(tmp_path / "out.json")]) == 0
    said = capsys.readouterr().err
    assert "viscous_damping.c moved from 2000 to 2" in said
    assert "A factor of 1000" in said


def test_a_period_that_only_the_displacement_keeps_is_said_by_simulate(tmp_path: Path, capsys: Said) -> None:
    current = np.repeat([0.4, 1.2], SAMPLES // 2)
    channels = {"displacement": X_M, "force": FORCE_N, "current": current}
    units = {"displacement": "m", "force": "N", "current": "A"}
    run = a_run(tmp_path / "a.h5", channels=channels, units=units, period_samples=1000)
    model = str(PATH.parent / "models" / "semi-active.json")
    assert main(["simulate", model, run, "-o", str(tmp_path / "o.h5")]) == 0
    assert "current: it does not repeat after 1000 samples" in capsys.readouterr().err


def test_a_csv_of_ours_whose_times_are_of_another_rate_is_refused(tmp_path: Path, capsys: Said) -> None:
    run = a_run(tmp_path / "a.h5")
    assert main(["convert", run, "-o", str(tmp_path / "b.csv")]) == 0
    text = (tmp_path / "b.csv").read_text()
    (tmp_path / "c.csv").write_text(text.replace("sample_rate,500.0", "sample_rate,1000.0"))
    lines = text.splitlines()
    (tmp_path / "d.csv").write_text("\n".join([*lines[:900], *lines[903:]]) + "\n")
    (tmp_path / "e.csv").write_text(text.replace("force (N)", "displacement (m)"))
    capsys.readouterr()
    for name, word in (("c", "500 Hz and 1000 Hz is stated"), ("d", "3 rows are missing"), ("e", "stands twice")):
        assert main(["convert", str(tmp_path / f"{name}.csv"), "-o", str(tmp_path / "out.h5")]) == 2
        assert word in capsys.readouterr().err


def test_the_example_is_what_the_simulated_dyno_wrote() -> None:
    """To the last digits: the noise is seeded, the filter may round differently."""

    def numbers(text: str) -> np.ndarray:
        return np.array([line.replace(",", ".").split(";") for line in text.splitlines()[6:]], dtype=np.float64)

    assert np.allclose(numbers(written()), numbers(PATH.read_bytes().decode("cp1252")), atol=0.02)


@pytest.mark.slow
def test_four_commands_lead_from_a_dynos_file_to_the_effect_that_is_in_it(tmp_path: Path, capsys: Said) -> None:
    """The example was made with a Coulomb friction of 90 N, which the model lacks."""
    model, runs = str(PATH.parent / "models" / "passive.json"), tmp_path / "own"
    assert imports(PATH, "-o", runs, "--split", "--flip", "force") == 0
    cut = sorted(map(str, runs.glob("*.h5")))
    assert len(cut) == 4
    assert main(["characterise", *cut, "-o", str(tmp_path / "sheet.html")]) == 0
    assert main(["fit", model, *cut, "-o", str(tmp_path / "fitted.json")]) == 0
    assert main(["explain", model, *cut, "-o", str(tmp_path / "report")]) == 0
    report = json.loads((tmp_path / "report" / "report.json").read_text(encoding="utf-8"))
    capsys.readouterr()
    surest = max(report["effects"], key=lambda effect: effect["confidence"])
    assert surest["element"] == "coulomb_friction"
    assert surest["parameters"]["f_c"]["value"] == pytest.approx(90.0, rel=0.05)
    assert report["gap"]["held_out"]["closed"] > 0.95  # of what the refitted base leaves beyond the noise
    assert [e["element"] for e in report["effects"]] == ["coulomb_friction"]
