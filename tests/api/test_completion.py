"""What a shell is offered after the first letters of a command."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("shell", "given"),
    [
        ("bash", {"COMP_WORDS": "damper-rig char", "COMP_CWORD": "1"}),
        ("zsh", {"_TYPER_COMPLETE_ARGS": "damper-rig char"}),
        ("fish", {"_TYPER_COMPLETE_ARGS": "damper-rig char", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}),
    ],
)
def test_a_shell_completes_a_command(shell: str, given: dict[str, str]) -> None:
    environment = os.environ | given | {"_DAMPER_RIG_COMPLETE": f"complete_{shell}"}
    done = subprocess.run(
        [sys.executable, "-c", "from api.cli.main import run; run()"],
        env=environment, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "characterise" in done.stdout
    assert done.stderr == ""
