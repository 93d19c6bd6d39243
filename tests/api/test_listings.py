"""The lists of what there is are those of the code, as text and as JSON."""

from __future__ import annotations

import json
from importlib.metadata import version

import pytest

from api.cli.main import main
from identification.physical.elements import CATALOGUE
from sim_rig.effects import EFFECTS
from sim_rig.fault_table import FAULT_TABLE
from sim_rig.specimens import SPECIMENS

LISTS = {
    "elements": ("element", list(CATALOGUE)),
    "specimens": ("specimen", list(SPECIMENS)),
    "effects": ("effect", list(EFFECTS)),
    "faults": ("fault", [row.name for row in FAULT_TABLE]),
}


@pytest.mark.parametrize("command", LISTS)
def test_a_list_names_everything_that_the_code_has(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    key, names = LISTS[command]
    assert main([command, "--json"]) == 0
    assert [row[key] for row in json.loads(capsys.readouterr().out)] == names
    assert main([command]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in names)
    assert len(shown.splitlines()) == len(names)


@pytest.mark.parametrize("name", CATALOGUE)
def test_an_element_is_shown_with_its_equation_and_every_parameter(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["elements", name]) == 0
    shown = capsys.readouterr().out
    assert CATALOGUE[name].equation in shown
    assert all(f"  {p.name} " in shown for p in CATALOGUE[name].parameters)


def test_a_misspelt_element_is_refused_with_the_one_that_is_meant(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["elements", "coulomb"]) == 2
    assert "coulomb_friction" in capsys.readouterr().err


def test_the_version_is_that_of_the_distribution(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"damper-rig {version('damper-rig')}\n"
