"""Options that several commands share, each described once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["AsJson", "Envelopes", "Interlocks", "Operator", "RigOption", "Specimen", "Url", "Yes"]

_ADDRESS = "The rig's address, for example modbus://127.0.0.1:5020."

Url = Annotated[str, typer.Argument(metavar="URL", help=_ADDRESS)]
RigOption = Annotated[str, typer.Option("--rig", help=_ADDRESS)]
Yes = Annotated[bool, typer.Option("--yes", help="Ask nothing before a motion; for simulated rigs only.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")]
Specimen = Annotated[str, typer.Option(help="Specimen, for the run files.")]
Operator = Annotated[str, typer.Option(help="Operator, for the run files.")]
Interlocks = Annotated[
    list[str] | None,
    typer.Option(
        "--interlock",
        metavar="CHANNEL:LOW:HIGH:ACTION[:DELAY_S[:MARGIN[:RELEASE_S]]]",
        help="A channel and its limits (SI), and the action outside them: indicate, hold or stop.",
    ),
]
Envelopes = Annotated[
    list[Path] | None,
    typer.Option(
        "--envelope",
        metavar="RIG.toml",
        help="What the rig or the specimen can do: every test is checked against it before, and while it moves.",
    ),
]
