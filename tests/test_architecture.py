"""The walls of the house: who imports whom, and what reaches a user's site-packages."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

from hatchling.builders.wheel import WheelBuilder
from importlinter.cli import lint_imports

ROOT = Path(__file__).parent.parent
ROOMS = ("api", "excitation", "identification", "rigctl", "sim_rig")


def test_every_import_keeps_to_the_rules() -> None:
    before = Path.cwd()
    os.chdir(ROOT)
    try:
        assert lint_imports(cache_dir=None) == 0
    finally:
        os.chdir(before)


def test_the_wheel_holds_the_five_rooms_and_nothing_else() -> None:
    files = [file.distribution_path for file in WheelBuilder(str(ROOT)).recurse_included_files()]
    assert {path.split("/")[0] for path in files} == set(ROOMS)
    assert not [path for path in files if "test_" in path or "/tests/" in path]
    for due in (
        *(f"{room}/py.typed" for room in ROOMS),
        "api/store/migrations/versions/0001_campaigns.py",
        "api/store/migrations/versions/0006_jobs.py",
        "api/store/migrations/script.py.mako",
        "api/web/live.html",
        "api/web/static/live.js",
        "api/demo/data/mr_utfpr/NOTICE.md",
        "api/demo/data/mr_utfpr/ensaio_A_1.h5",
        "api/demo/data/viscous.json",
    ):
        assert due in files, due


def test_the_distribution_cannot_be_uploaded_by_accident() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert "Private :: Do Not Upload" in project["classifiers"]
    assert list(project["scripts"]) == ["damper-rig"]


def test_help_loads_none_of_the_heavy_libraries() -> None:
    heavy = ("numpy", "numba", "scipy", "h5py", "fastapi", "sqlalchemy", "pydantic", "plotly")
    code = f"import sys, api.cli.main; print([m for m in {heavy} if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert said.stdout.strip() == "[]"


def test_every_room_says_what_it_exports() -> None:
    for room in ROOMS:
        text = (ROOT / room / "__init__.py").read_text()
        assert text.startswith('"""'), room
        assert "def " not in text, f"{room}/__init__.py is a map, not a place for code"
        assert "class " not in text.split('"""')[2], f"{room}/__init__.py is a map, not a place for code"
