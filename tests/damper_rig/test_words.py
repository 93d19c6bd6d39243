"""What an import says in a notebook names what one writes there."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
import pytest

import damper_rig as dr
from damper_rig.words import in_python
from rigctl.errors import ForeignFileError

OPTION = re.compile(r"(?<!\w)--\w")
FOREIGN = Path(__file__).parents[2] / "rigctl" / "foreign_files"


def test_no_option_of_the_command_line_is_left_in_any_message() -> None:
    said = [text for file in FOREIGN.glob("*.py") for text in re.findall(r'"([^"\n]*--[^"\n]*)"', file.read_text())]
    assert len(said) > 15
    assert [text for text in said if OPTION.search(in_python(text))] == []


@pytest.mark.parametrize(
    ("said", "here"),
    [
        ("--displacement Stroke:mm", 'columns={"displacement": "Stroke:mm"}'),
        ("gaps: --resample 500 interpolates", "gaps: choice=dr.Choice(resample_hz=500) interpolates"),
        ("state --time none --rate HZ", 'state columns={"time": "none"} choice=dr.Choice(rate_hz=HZ)'),
        (
            "--part NAME with one of a, or --part all",
            'choice=dr.Choice(part="NAME") with one of a, or choice=dr.Choice(part="all")',
        ),
        ("--flip x: there is no such channel", 'flip=["x"]: there is no such channel'),
        ("--centre displacement, if", 'choice=dr.Choice(centre=("displacement",)), if'),
        ("--split makes a run of each", "split=True makes a run of each"),
        ("correct --rate, or", "correct rate_hz, or"),
        ("a name-with--dashes", "a name-with--dashes"),
    ],
)
def test_options_become_arguments(said: str, here: str) -> None:
    assert in_python(said) == here


def test_what_is_advised_can_be_done(tmp_path: Path) -> None:
    t = np.arange(600) / 500.0
    rows = np.column_stack([1e3 * 0.01 * np.sin(9 * t), 600.0 * 0.09 * np.cos(9 * t)])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="Stroke (mm),Load (N)", comments="")
    with pytest.raises(ForeignFileError, match=r"choice=dr\.Choice\(rate_hz=HZ\)"):
        dr.load(tmp_path / "a.csv")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", dr.DataWarning)
        (run,) = dr.load(tmp_path / "a.csv", choice=dr.Choice(rate_hz=500.0))
    assert run.sample_rate_hz == 500.0
