"""``damper-rig report``: draw the page of an explanation again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["report"]


def report(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that damper-rig explain wrote.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the path of the page as JSON.")] = False,
) -> None:
    """Draw report.html again from report.json and evidence.h5 in DIR.

    Nothing is simulated or judged again: the page has the results of explain in the layout of this version.

    Example: damper-rig report found
    """
    from api.cli.places import check_file
    from api.cli.terminal import answer
    from identification.report import draw_report

    if directory.is_dir():
        check_file(directory / "report.html")
    page = draw_report(directory)
    answer(str(page), {"file": str(page)}, as_json=as_json)
