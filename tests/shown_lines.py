"""What README and docs show: their blocks and lines, and a place where such a line runs as in a shell."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
SECONDS = 600.0
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: Path, language: str) -> list[str]:
    return [text for kind, text in BLOCK.findall(page.read_text(encoding="utf-8")) if kind == language]


def lines(page: Path, first: str) -> list[str]:
    """The lines of a page that begin with a word, with what a backslash continues."""
    every = "\n".join(blocks(page, "sh")).replace("\\\n", " ").splitlines()
    return [line for line in every if line.startswith(f"{first} ")]


@dataclass(frozen=True)
class Place:
    """A folder with the files that the lines name, and where rig and service are."""

    folder: Path
    rig: str
    service: str

    def does(self, line: str, **variables: str) -> str:
        """Run a line as a shell does, on this rig and this service; an error of HTTP fails it.

        A 503 is tried again: on a busy computer the service says so, and when.
        """
        here = line.replace("modbus://127.0.0.1:5020", self.rig).replace("http://127.0.0.1:8420", self.service)
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
    line = [sys.executable, "-m", "api.cli", *words, "--with-parent"]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        line, cwd=folder, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        ready = process.stdout.readline().split()
        assert ready[:1] == ["ready"], words
        try:
            yield ready[-1]
        finally:
            process.terminate()
            process.communicate(timeout=60)
