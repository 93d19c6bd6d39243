"""What README and docs show: their blocks and lines, and a place where such a line runs as in a shell."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from unittest.mock import patch

from api.cli.main import main
from tests.starting import Started

ROOT = Path(__file__).parent.parent
SECONDS = 600.0
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: Path, language: str) -> list[str]:
    return [text for kind, text in BLOCK.findall(page.read_text(encoding="utf-8")) if kind == language]


def lines(page: Path, first: str) -> list[str]:
    """The lines of a page that begin with a word, with what a backslash continues."""
    every = "\n".join(blocks(page, "sh")).replace("\\\n", " ").splitlines()
    return [line for line in every if line.startswith(f"{first} ")]


OF_A_SHELL = re.compile(r"[|<>&;$`]")


def does(words: Sequence[str], folder: Path) -> str:
    """What a command prints that must do its work, in this process: a process of its own takes ten times as long."""
    said, told = StringIO(), StringIO()
    with chdir(folder), redirect_stdout(said), redirect_stderr(told):
        status = main(words)
    assert status == 0, (words, said.getvalue(), told.getvalue())
    return said.getvalue()


def found(pattern: str, folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.glob(pattern))


def words_of(line: str, folder: Path) -> list[str]:
    """What the shell makes of a line without pipes, in a folder: words, a pattern as the names that it finds."""
    words = shlex.split(line, comments=True)
    return [one for word in words for one in (found(word, folder) if "*" in word else [word])]


@dataclass(frozen=True)
class Place:
    """A folder with the files that the lines name, and where rig and service are."""

    folder: Path
    rig: str
    service: str

    def does(self, line: str, **variables: str) -> str:
        """Run a line on this rig and this service, in a shell where it needs one; an error of HTTP fails it.

        A 503 is tried again: on a busy computer the service says so, and when.
        """
        here = line.replace("modbus://127.0.0.1:5020", self.rig).replace("http://127.0.0.1:8420", self.service)
        if here.startswith("damper-rig ") and not OF_A_SHELL.search(shlex.join(shlex.split(here, comments=True))):
            with patch.dict(os.environ, variables, DAMPER_RIG_SERVICE=self.service):
                return does(words_of(here, self.folder)[1:], self.folder)
        program = f'function damper-rig {{ {shlex.quote(sys.executable)} -m api.cli "$@"; }}\n'
        program += 'curl() { command curl --silent --show-error --fail-with-body --retry 5 "$@"; }\n'
        env = {**os.environ, **variables, "PYTHONPATH": str(ROOT), "DAMPER_RIG_SERVICE": self.service}
        done = subprocess.run(
            ["bash", "-c", program + here],
            cwd=self.folder, env=env, capture_output=True, text=True, timeout=SECONDS, check=False,
        )  # fmt: skip
        assert done.returncode == 0, (line, done.stdout, done.stderr)
        return done.stdout


@contextmanager
def listening(folder: Path, *words: str) -> Iterator[str]:
    """A command that answers `ready URL`, until the block ends; then it is asked to end, and does."""
    with listening_at(1, folder, *words) as (url,):
        yield url


@contextmanager
def listening_at(places: int, folder: Path, *words: str) -> Iterator[list[str]]:
    """The same for a command that listens at more places than one: their URLs, in the order in which it says them."""
    with Started(words, folder=folder) as process:
        ready = [process.line().split() for _ in range(places)]
        assert all(one[:1] == ["ready"] for one in ready), words
        yield [one[-1] for one in ready]
