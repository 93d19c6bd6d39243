"""``damper-rig score``: the error of a simulated force against the measured one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["score"]


def score(
    run: Annotated[Path, typer.Argument(metavar="OUT.h5", help="A run with force and force_simulated.")],
    as_json: Annotated[bool, typer.Option("--json", help="The answer is JSON without this option too.")] = False,
) -> None:
    """Print the error measures of force_simulated against force as JSON.

    Example: damper-rig score simulated.h5
    """
    import json

    from identification.models.measures import score as figures_of
    from rigctl.runfile import read_run

    print(json.dumps(figures_of(read_run(run))))
