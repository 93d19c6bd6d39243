"""A file that cannot be imported: one line, status 2, nothing written, bounded memory."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from api.cli.main import main
from tests.foreign.hostile_imports import HOSTILE_FILES, HOSTILE_TEXTS, Writer

MAY_BE_READ = ("TDMS", "UFF 58", "MDF 4", "MATLAB 7.3", "RPC III", "MATLAB vectors", "MATLAB structure")
"""Formats whose values have no checksum: scrambled or cut ones may be whole files of other values."""


def refused(
    path: Path, write: Writer, word: str, capsys: pytest.CaptureFixture[str], *, may_read: bool = False
) -> None:
    write(path)
    before = set(path.parent.iterdir())
    status = main(["import", str(path), "-o", str(path.parent / "out.h5")])
    printed = capsys.readouterr()
    if may_read and status == 0:
        return
    assert status == 2, printed.err
    assert printed.err.count("\n") == 1, printed.err
    assert printed.out == ""
    assert len(printed.err) < 700
    assert printed.err.startswith(f"damper-rig: {path}: ")
    assert word in printed.err
    assert set(path.parent.iterdir()) == before


@pytest.mark.parametrize("kind", HOSTILE_TEXTS)
def test_a_hostile_text_is_refused_in_one_line(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write, word = HOSTILE_TEXTS[kind]
    refused(tmp_path / "a.csv", write, word, capsys)


@pytest.mark.parametrize("kind", HOSTILE_FILES)
def test_a_hostile_file_is_refused_in_one_line(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ending, write, word = HOSTILE_FILES[kind]
    refused(tmp_path / f"a{ending}", write, word, capsys, may_read=kind.split(",")[0] in MAY_BE_READ)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="only Linux tells the peak")
@pytest.mark.parametrize("kind", ["a zip bomb", "entities that unfold", "MATLAB that unpacks to far more"])
def test_a_bomb_takes_no_more_memory_than_other_files(kind: str, tmp_path: Path) -> None:
    ending, write, _ = HOSTILE_FILES[kind]
    write(tmp_path / f"a{ending}")
    code = (
        "import sys; from pathlib import Path; from api.cli.main import main\n"
        "status = main(['import', sys.argv[1], '-o', sys.argv[1] + '.h5'])\n"
        "print(status, next(line for line in Path('/proc/self/status').open() if 'VmHWM' in line).split()[1])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / f"a{ending}")], capture_output=True, text=True, check=True
    )
    status, peak = map(int, done.stdout.split())
    assert status == 2
    assert peak * 1024 < 600e6


def test_the_bound_of_memory_is_lifted_after_the_import(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = resource.getrlimit(resource.RLIMIT_AS)
    refused(tmp_path / "a.csv", *HOSTILE_TEXTS["text in a cell"], capsys)
    assert resource.getrlimit(resource.RLIMIT_AS) == before
