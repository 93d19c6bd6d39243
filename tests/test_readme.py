"""The commands of the README do what they show, on the simulated rig, in the order in which they stand there."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.shown_lines import ROOT, does


def shown(page: Path = ROOT / "README.md") -> list[list[str]]:
    """Every `damper-rig` command line of a page, as words, its comment left out."""
    lines = page.read_text(encoding="utf-8").splitlines()
    return [shlex.split(line, comments=True)[1:] for line in lines if line.startswith("damper-rig ")]


OWN_DATA = shown(ROOT / "docs" / "tutorial-csv.md")  # test_docs.py runs them


def command(words: list[str], rig: str, folder: Path) -> list[str]:
    """The words with the paths of the examples, the files that are there, and the rig that really listens."""
    out: list[str] = []
    for word in words:
        if "*" in word:
            out += sorted(str(p.relative_to(folder)) for p in folder.glob(word))
        else:
            out.append(
                str(ROOT / word) if word.startswith("examples/") else word.replace("modbus://127.0.0.1:5020", rig)
            )
    return out


@pytest.mark.slow
def test_the_commands_of_the_readme_work_one_after_the_other(tmp_path: Path) -> None:
    lines = [words for words in shown() if words not in OWN_DATA]
    simulated = next(line for line in lines if line[0] == "sim")
    listening = [word.replace(":5020", ":0") for word in simulated]
    with subprocess.Popen(
        [sys.executable, "-m", "api.cli", *listening, "--speed", "20"], stdout=subprocess.PIPE, text=True
    ) as rig:
        try:
            assert rig.stdout is not None
            url = rig.stdout.readline().split()[-1]
            for words in lines:
                # test_service_lines.py explains an FMU, test_reference_lines.py a simulation; it iterates a drive.
                foreign = "--simulated" in words or "damper.fmu" in words
                if words[0] not in ("sim", "iterate", "serve", "demo") and not foreign:
                    does(command(words, url, tmp_path), tmp_path)
        finally:
            rig.terminate()
    assert "coulomb_friction" in (tmp_path / "report" / "report.json").read_text(encoding="utf-8")
    for made in ("excitation.h5", "sheet.html", "fitted.json", "report/report.html"):
        assert (tmp_path / made).is_file()


def test_the_four_commands_for_own_data_are_those_of_the_tutorial_where_they_run() -> None:
    assert [words[0] for words in OWN_DATA] == ["import", "characterise", "fit", "explain"]
    assert all(words in shown() for words in OWN_DATA)


def test_every_command_that_the_readme_shows_has_help() -> None:
    for words in shown():
        assert words[0] in does([words[0], "--help"], ROOT)
