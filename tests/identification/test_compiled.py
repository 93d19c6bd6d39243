"""The cache of compiled loops: no version of the code reads what another one wrote."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from excitation.kernel_cache import digest
from identification import compiled

LAW = """from tiny.compiled import inlined
@inlined
def law(w):
    return {factor} * w
"""
LOOP = """from tiny.compiled import compiled
from tiny.law import law
@compiled
def loop(w):
    return law(w) + 1.0
if __name__ == "__main__":
    print(loop(10.0), len(loop.stats.cache_hits))
"""


def write(folder: Path, factor: str) -> None:
    """The law with a factor; size and time of the file stay."""
    path = folder / "law.py"
    path.write_text(LAW.format(factor=factor))
    os.utime(path, (1e9, 1e9))


def answer(folder: Path) -> tuple[float, int]:
    """What a fresh process computes, and how many compiled functions it found in the cache."""
    # Without bytecode: Python itself takes that of a file of the same size and time for its own.
    of_its_own = {"PYTHONPATH": str(folder.parent), "NUMBA_CACHE_DIR": "", "PYTHONDONTWRITEBYTECODE": "1"}
    environment = {**os.environ, **of_its_own}
    command = [sys.executable, "-m", "tiny.loop"]
    said = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()
    return float(said[0]), int(said[1])


def test_a_change_in_another_file_of_the_same_size_and_time_is_compiled_and_the_old_version_is_still_there(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "tiny"
    folder.mkdir()
    shutil.copy(compiled.__file__, folder / "compiled.py")
    (folder / "__init__.py").touch()
    (folder / "loop.py").write_text(LOOP)
    write(folder, "2.0")
    assert answer(folder) == (21.0, 0)
    write(folder, "3.0")
    assert answer(folder) == (31.0, 0)
    write(folder, "2.0")
    assert answer(folder) == (21.0, 1)


def test_the_digest_sees_every_file_and_no_time(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("x = 1")
    (tmp_path / "b.py").write_text("y = 1")
    before = digest(tmp_path)
    os.utime(tmp_path / "a.py", (1e9, 1e9))
    assert digest(tmp_path) == before
    (tmp_path / "b.py").write_text("y = 2")
    assert digest(tmp_path) != before
