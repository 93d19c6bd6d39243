"""One writer for every file: whole under its name, or not there."""

from __future__ import annotations

from pathlib import Path

import pytest

from excitation.atomic import written_whole


class RefusedError(Exception):
    """Stands for the error class of the package that writes."""


def stopped_half_way(path: Path) -> None:
    with written_whole(path, RefusedError) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt


def test_a_file_stands_under_its_name_when_the_block_has_ended(tmp_path: Path) -> None:
    with written_whole(tmp_path / "a.txt", RefusedError) as temporary:
        temporary.write_text("new")
        assert not (tmp_path / "a.txt").exists()
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "new"


def test_an_error_inside_the_block_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    with pytest.raises(KeyboardInterrupt):
        stopped_half_way(tmp_path / "a.txt")
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


@pytest.mark.parametrize("name", ["missing/a.txt", "folder"])
def test_a_place_that_cannot_be_written_is_refused_by_the_error_of_the_caller(name: str, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with (
        pytest.raises(RefusedError, match=f"{name}: cannot be written .*: give a place"),
        written_whole(tmp_path / name, RefusedError) as temporary,
    ):
        temporary.write_text("new")
    assert [p.name for p in tmp_path.iterdir()] == ["folder"]


def test_a_temporary_file_is_never_taken_for_one_of_the_kind_that_is_written(tmp_path: Path) -> None:
    with written_whole(tmp_path / "run.h5", RefusedError) as temporary:
        temporary.write_text("new")
        assert list(tmp_path.glob("*.h5")) == []
