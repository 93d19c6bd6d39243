"""Whatever a command writes: a place that cannot be written is said before it reads, computes or moves anything."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from api.cli.main import main
from tests.api.command_tree import commands, line, name_of, takes_a_path

READ = {  # parameters that name what is there already; every other one that takes a path is written to
    *("--calibration", "--tare", "--envelope", "--instrument", "--from", "--like", "--mapping", "--held-out", "--base"),
    *("--runs", "--model", "--mass", "--sheet", "--config"),
    *("runs", "run", "files", "record", "source", "config", "models", "model"),
}
ALSO_READ = {("campaign submit", "file"), ("iterate", "file"), ("rig calibration", "file"), ("recover", "directory")}
ALSO_READ |= {("study complexity", name) for name in ("--beside", "--feasible", "--plan")}
ALSO_READ |= {("study range", "--trained"), ("study range", "service")}
ALSO_READ |= {("study own", name) for name in ("--fmu", "--wiring")}
ALSO_READ |= {("study seat", "--specimen"), ("study sensitivity", "--at")}
ALSO_READ |= {("store restore", "file"), ("store check", "file")}
OF_A_SERVICE = "--data"  # the folder of its store, tried when it is opened: test_command_line.py
FOLDERS = {"run", "iterate", "explain", "autopilot", "demo", "examples", "campaign fetch"}
FOLDERS |= {"rig crawl", "rig weigh", "rig compensate"}
INSIDE = {("report", "directory")}  # a folder that must hold files already: see below


def written() -> Iterator[tuple[str, str]]:
    """Each command with each of its parameters that names a place to write."""
    for path, command in commands().items():
        for one in command.params:
            name = name_of(one)
            known = name in READ | {OF_A_SERVICE} or (path, name) in ALSO_READ | INSIDE
            if takes_a_path(one) and not known:
                yield path, name


WRITTEN = pytest.mark.parametrize(("path", "name"), sorted(set(written())), ids=lambda text: text.replace(" ", "-"))
REFUSED = ("taken/out.h5", "/proc/out.h5", 300 * "a" + ".h5")  # below a file, by the system, too long


def test_the_places_that_commands_write_to_are_known() -> None:
    found = set(written())
    assert {("fit", "--output"), ("rig tare", "--output"), ("design harmonic", "--plot"), ("sim", "--reveal")} <= found
    assert {("examples", "output"), ("store backup", "file"), ("campaign fetch", "--output")} <= found
    assert len(found) >= 29


@WRITTEN
@pytest.mark.parametrize("place", REFUSED, ids=("below a file", "by the system", "too long"))
def test_a_place_that_cannot_be_written_is_said_before_anything_is_read(
    place: str,
    path: str,
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("")
    assert main(line(path, {name: place})) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert place[:100] in said.err
    assert "nothing.h5" not in said.err
    assert list(Path().iterdir()) == [Path("taken")]


@WRITTEN
def test_a_file_where_a_folder_is_due_and_the_reverse_are_said_before_anything_is_read(
    path: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a-file").write_text("of somebody")
    Path("a-folder.h5").mkdir()
    place, why = ("a-file", "is a file, not a folder") if path in FOLDERS else ("a-folder.h5", "is a folder")
    assert main(line(path, {name: place})) == 2
    said = capsys.readouterr().err
    assert f"{place}: {why}" in said
    assert said.count("\n") == 1
    assert sorted(Path().rglob("*")) == [Path("a-file"), Path("a-folder.h5")]
    assert Path("a-file").read_text() == "of somebody"


def test_the_folder_of_a_report_is_tried_before_it_is_read(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "/proc"]) == 2
    assert "report.html: cannot be written" in capsys.readouterr().err


def test_a_rig_is_not_asked_where_its_protocol_cannot_be_kept(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir("/proc")
    assert main(["rig", "check", "modbus://127.0.0.1:9"]) == 2
    said = capsys.readouterr().err
    assert "cannot be written" in said
    assert said.count("\n") == 1
