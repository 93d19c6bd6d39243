"""A hostile run file is refused in one line before any of its data are read, whatever it hides."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigctl.errors import RunFileError
from rigctl.runfile import read_run
from tests.hostile_files import HOSTILE, UNUSUAL


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_run_file_is_refused_in_one_line(kind: str, tmp_path: Path) -> None:
    write, expected = HOSTILE[kind]
    path = tmp_path / "bad.h5"
    write(path)
    with pytest.raises(RunFileError) as refused:
        read_run(path)
    message = str(refused.value)
    assert message.startswith(f"{path}: ")
    assert expected in message
    assert "\n" not in message
    assert len(message) < 400


@pytest.mark.parametrize("kind", UNUSUAL)
def test_an_unusual_run_file_that_keeps_to_the_layout_is_read(kind: str, tmp_path: Path) -> None:
    UNUSUAL[kind](tmp_path / "good.h5")
    assert read_run(tmp_path / "good.h5").samples == 64


@pytest.fixture(scope="module")
def contents(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """Good run files of every unusual kind."""
    folder = tmp_path_factory.mktemp("good")
    for kind, write in UNUSUAL.items():
        write(folder / f"{kind}.h5")
    return [path.read_bytes() for path in sorted(folder.glob("*.h5"))]


@settings(max_examples=300, derandomize=True, deadline=None)
@given(
    which=st.integers(0, len(UNUSUAL) - 1),
    changes=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=8),
    kept=st.one_of(st.just(1.0), st.floats(0, 1)),
)
def test_a_file_with_changed_bytes_or_cut_off_is_read_or_refused_in_one_line(
    contents: list[bytes],
    tmp_path_factory: pytest.TempPathFactory,
    which: int,
    changes: list[tuple[float, int]],
    kept: float,
) -> None:
    damaged = bytearray(contents[which])
    for where, value in changes:
        damaged[int(where * len(damaged))] = value
    path = tmp_path_factory.getbasetemp() / "damaged.h5"
    path.write_bytes(damaged[: int(kept * len(damaged))])
    said = f"{path}: read"
    try:
        read_run(path)
    except RunFileError as error:
        said = str(error)
    assert said.startswith(f"{path}: ")
    assert "\n" not in said
