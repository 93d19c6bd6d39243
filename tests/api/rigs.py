"""A simulated rig that is started as a user starts it, by the command, in a process of its own; what a refusal says."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def a_sim(url: str, *options: str) -> Iterator[str]:
    command = [sys.executable, "-m", "api.cli", "sim", "--listen", url.format(os.getpid()), *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().split()[1]
        finally:
            process.terminate()


def said_in_one_line(capsys: pytest.CaptureFixture[str]) -> str:
    said = capsys.readouterr()
    assert said.out.strip() == ""
    assert said.err.count("\n") == 1, said.err
    assert said.err.startswith("damper-rig: ")
    return said.err
