"""The site is whole and needs no network; the commands, snippets and notebooks of its guides run."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from excitation import plan_from_config
from tests.shown_lines import ROOT, blocks
from tests.shown_lines import does as commanded
from tests.starting import Started

DOCS = ROOT / "docs"
GUIDES = (*sorted(DOCS.glob("tutorial-*.md")), *sorted((DOCS / "howto").glob("*.md")))
PAGES = (ROOT / "README.md", *GUIDES)
ON_A_SERVICE = ("campaign", "fmu", "http")  # guides whose lines test_service_lines.py runs
SECONDS = 900.0
LOADED = re.compile(
    r"""<(?:script|img|iframe)[^>]*\ssrc=["']?(https?:)?//|<link[^>]*\srel=["']?(?:stylesheet|preconnect|icon)"""
    r"""["']?[^>]*\shref=["']?(https?:)?//|@import\s+url\(["']?https?:|url\(["']?https?:"""
)


def commands(page: Path) -> list[list[str]]:
    lines = [line for block in blocks(page, "sh") for line in block.splitlines()]
    return [shlex.split(line, comments=True)[1:] for line in lines if line.startswith("damper-rig ")]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A working folder with the examples, and an archive of one file."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    (tmp_path / "archive").mkdir()
    shutil.copy(ROOT / "examples" / "dyno.csv", tmp_path / "archive")
    (tmp_path / "lab.toml").write_text('flip = ["force"]\n')
    return tmp_path


def does(folder: Path, *words: str) -> str:
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore"}
    line = [sys.executable, *words]
    done = subprocess.run(line, cwd=folder, env=env, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert done.returncode == 0, (words, done.stdout, done.stderr)
    return done.stdout


def expanded(words: list[str], folder: Path) -> list[str]:
    return [one for word in words for one in (sorted(map(str, folder.glob(word))) if "*" in word else [word])]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as `make docs` does: strict, a warning is an error."""
    place = tmp_path_factory.mktemp("site")
    does(ROOT, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(place))
    return place


def test_the_site_loads_nothing_from_the_net(site: Path) -> None:
    pages = [*site.rglob("*.html"), *site.rglob("*.css")]
    assert len(pages) > 20
    assert {path.name for path in pages if LOADED.search(path.read_text(encoding="utf-8"))} == set()


@pytest.mark.parametrize(
    "loaded", ['<script src="https://a/b.js">', '<link rel="stylesheet" href="//a">', "url(http://a)"]
)
def test_what_would_be_loaded_from_the_net_is_found(loaded: str) -> None:
    assert LOADED.search(loaded)


def test_the_references_of_the_site_are_those_of_the_code(site: Path) -> None:
    from damper_rig import elements

    shown = (site / "elements.html").read_text(encoding="utf-8")
    assert all(f'id="{name}"' in shown for name in elements())
    assert all(f"damper-rig {name}<" in (site / "commands.html").read_text() for name in ("explain", "rig tare"))


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [page for page in GUIDES if commands(page) and page.stem not in ON_A_SERVICE], ids=lambda page: page.stem
)
def test_the_commands_of_a_guide_work_one_after_the_other(page: Path, folder: Path) -> None:
    rig, url = None, ""
    try:
        for words in commands(page):
            if words[0] == "sim":
                listening = [word.replace(":5020", ":0") for word in words]
                rig = Started([*listening, "--speed", "20"])
                url = rig.wait_until_ready()
            else:
                there = [word.replace("modbus://127.0.0.1:5020", url) for word in words]
                commanded(expanded(there, folder), folder)
    finally:
        if rig is not None:
            rig.stop()
    for made in (folder / "own_report", folder / "report") if page.name.startswith("tutorial") else ():
        if made.is_dir():
            assert "coulomb_friction" in (made / "report.json").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=lambda page: page.stem)
def test_the_python_of_readme_and_guides_runs(page: Path, folder: Path) -> None:
    does(folder, "-c", "\n".join(blocks(page, "python")))


def test_the_plan_of_the_guide_is_one() -> None:
    (text,) = blocks(DOCS / "howto" / "campaign.md", "toml")
    assert [test.name for test in plan_from_config(tomllib.loads(text)).tests] == ["slow", "fast"]


@pytest.mark.slow
@pytest.mark.parametrize("notebook", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs_from_its_first_cell_to_its_last(notebook: Path, folder: Path) -> None:
    shutil.copy(notebook, folder)
    does(folder, "-c", "from nbclient.cli import main; main()", "--inplace", notebook.name)
    assert "output_type" in (folder / notebook.name).read_text(encoding="utf-8")
