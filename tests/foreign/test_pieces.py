"""A large text file is read in pieces of whole lines: the table is that of one piece."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigctl.errors import ForeignFileError
from rigctl.foreign_files import text_file
from rigctl.foreign_files.layout import TextOptions

LINE = st.sampled_from(["1.5,2", "-0.25,1e3", "12345.678901,7", ",3", ""])
HEAD = "Time (s),Stroke (mm)\n0,0\n0.001,1\n0.002,2\n0.003,1\n0.004,0\n0.005,-1\n"


def taken(path: Path) -> list[list[float]]:
    (table,) = text_file.read_text(path, TextOptions())
    return [column.tolist() for column in table.take([0, 1], lambda done: None).columns]


@given(
    lines=st.lists(LINE, max_size=30),
    ending=st.sampled_from(["\n", "\r\n"]),
    whole=st.booleans(),
    room=st.integers(40, 90),
)
def test_the_size_of_a_piece_changes_nothing(
    tmp_path_factory: pytest.TempPathFactory, lines: list[str], ending: str, whole: bool, room: int
) -> None:
    path = tmp_path_factory.mktemp("pieces") / "run.csv"
    text = (HEAD + "\n".join([*lines, "9,9"]) + "\n" * whole).replace("\n", ending)
    path.write_bytes(text.encode())
    with pytest.MonkeyPatch.context() as patched:
        at_once = taken(path)
        patched.setattr(text_file, "PIECE", room)
        np.testing.assert_array_equal(taken(path), at_once)


def test_a_line_that_is_longer_than_a_piece_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.csv"
    path.write_text(f"{HEAD}0.003,{'1' * 200}\n")
    monkeypatch.setattr(text_file, "PIECE", 64)
    with pytest.raises(ForeignFileError):
        taken(path)
