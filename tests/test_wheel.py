"""The wheel, in a fresh environment outside of the working copy: it holds all it needs, and says when it is broken."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parent.parent
QUIET = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "DAMPER_RIG"))}


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with the wheel; its dependencies are those of this one, which the working copy is no part of."""
    folder = tmp_path_factory.mktemp("wheel")
    (wheel,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "env"], check=True)
    subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "--python",
            folder / "env",
            "install",
            "--quiet",
            "--no-deps",
            "--no-index",
            wheel,
        ],
        check=True,
        env=QUIET,
    )
    packages(folder).joinpath("dependencies.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    return folder


def packages(folder: Path) -> Path:
    (found,) = (folder / "env").glob("lib/python*/site-packages")
    return found


def ran(folder: Path, *words: str, program: str = "damper-rig") -> subprocess.CompletedProcess[str]:
    line = [str(folder / "env" / "bin" / program), *words]
    return subprocess.run(line, cwd=folder, env=QUIET, capture_output=True, text=True, timeout=600, check=False)


def does(folder: Path, *words: str) -> str:
    done = ran(folder, *words)
    assert done.returncode == 0, (words, done.stderr)
    return done.stdout


@pytest.mark.slow
def test_it_works_away_from_the_working_copy(fresh: Path) -> None:
    does(fresh, "examples", "mine")
    does(fresh, "import", "mine/dyno.csv", "-o", "own", "--split", "--flip", "force")
    runs = sorted(str(path) for path in (fresh / "own").glob("*.h5"))
    does(fresh, "characterise", *runs, "-o", "sheet.html")
    does(fresh, "design", "harmonic", "mine/first_sines.toml", "-o", "sines.csv")
    does(fresh, "key", "create", "Anna Berg", "--scope", "admin", "--data", "data")  # the store with all migrations
    said = ran(fresh, "-c", "import damper_rig, api.demo; print(damper_rig.__file__)", program="python")
    assert str(packages(fresh)) in said.stdout, said.stderr


@contextmanager
def changed(path: Path, text: str) -> Iterator[None]:
    """Another program's file in the place of ours, or none, for a while."""
    before = path.read_bytes() if path.is_file() else None
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    try:
        yield
    finally:
        if before is None:
            path.unlink()
        else:
            path.write_bytes(before)


@pytest.mark.slow
def test_a_package_that_another_program_wrote_over_is_said_in_one_line(fresh: Path) -> None:
    for name in ("api/__init__.py", "api/errors.py", "rigctl/axis.py"):
        with changed(packages(fresh) / name, "raise RuntimeError('of somebody else')\n"):
            done = ran(fresh, "--version")
        assert done.returncode == 1
        assert done.stderr.count("\n") == 1
        assert name in done.stderr
        assert "environment of its own" in done.stderr
    assert ran(fresh, "--version").returncode == 0


@pytest.mark.slow
def test_a_package_that_hides_ours_is_said_in_one_line(fresh: Path) -> None:
    elsewhere = fresh / "elsewhere" / "api"
    elsewhere.mkdir(parents=True)
    (elsewhere / "__init__.py").write_text("")
    with changed(packages(fresh) / "a.pth", f"import sys; sys.path.insert(0, {str(elsewhere.parent)!r})\n"):
        done = ran(fresh, "--version")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert str(elsewhere) in done.stderr
