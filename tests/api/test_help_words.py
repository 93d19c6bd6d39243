"""Help says what to give, not which Python type reads it."""

from __future__ import annotations

import re

import pytest

from api.cli.main import main

COMMANDS = (
    "", "fit", "characterise", "sim", "design harmonic", "serve", "run", "explain", "import", "model new", "key create",
)  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_no_help_names_a_python_type(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*command.split(), "--help"]) == 0
    said = capsys.readouterr().out
    assert "Usage" in said
    assert not re.findall(r"<(?:list\[)?\w+\]?>", said)
