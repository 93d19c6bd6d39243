"""A simulated rig that runs as a user's does, as the command in a process of its own; what a refusal says."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.starting import Started


@contextmanager
def a_sim(url: str, *options: str) -> Iterator[str]:
    with Started(["sim", "--listen", url.format(os.getpid()), *options]) as process:
        yield process.wait_until_ready()


def said_in_one_line(capsys: pytest.CaptureFixture[str]) -> str:
    said = capsys.readouterr()
    assert said.out.strip() == ""
    assert said.err.count("\n") == 1, said.err
    assert said.err.startswith("damper-rig: ")
    return said.err
