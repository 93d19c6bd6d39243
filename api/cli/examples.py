"""``damper-rig examples``: the files that the documentation uses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.options import AsJson
from api.cli.places import to_folder

__all__ = ["examples"]


def examples(
    output: Annotated[
        Path, typer.Argument(metavar="DIR", callback=to_folder, help="A folder that does not exist yet.")
    ],
    as_json: AsJson = False,
) -> None:
    """Copy the examples of the documentation: a dyno's log, models, designs, maps of rigs.

    Example: damper-rig examples examples
    """
    import shutil

    from api.cli.terminal import answer
    from api.errors import InputError

    if output.exists():
        raise InputError(f"{output}: exists already: give a folder that does not")
    try:
        shutil.copytree(_place(), output)
    except OSError as error:
        raise InputError(f"{output}: cannot be written ({error.strerror or error})") from error
    files = sum(path.is_file() for path in output.rglob("*"))
    answer(f"{output}: {files} files", {"folder": str(output), "files": files}, as_json=as_json)


def _place() -> Path:
    """Within the package where it is installed, beside it in a working copy."""
    package = Path(__file__).resolve().parents[1]
    beside = package.parent / "examples"
    return beside if (package.parent / "pyproject.toml").is_file() else package / "examples"
