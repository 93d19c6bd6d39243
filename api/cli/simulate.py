"""``damper-rig simulate``: the force that a model gives for a run's inputs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["simulate"]


def simulate(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="The model.")],
    run: Annotated[Path, typer.Argument(metavar="RUN.h5", help="The run whose inputs drive it.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT.h5", help="The run with force_simulated.")],
) -> None:
    """Free-run simulation, from the run's inputs alone: displacement, current, temperature.

    Example: damper-rig simulate fitted.json run.h5 -o simulated.h5
    """
    from api.cli.terminal import progress_bar
    from identification.physical.modelfile import read_model
    from identification.simulation import simulate_run
    from rigctl.runfile import read_run, with_channel, write_run

    described, measured = read_model(model), read_run(run)
    with progress_bar("simulating"):
        force = simulate_run(described, measured)
    write_run(output, with_channel(measured, "force_simulated", force, "N"))
    print(output)
