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
    tolerance: Annotated[
        float | None,
        typer.Option("--tolerance", help="Divide the samples until the solver's own error is this share of the force."),
    ] = None,
) -> None:
    """Free-run simulation, from the run's inputs alone: displacement, current, temperature.

    Example: damper-rig simulate fitted.json run.h5 -o simulated.h5
    """
    from api.cli.terminal import progress_bar
    from api.errors import InputError
    from identification.physical.modelfile import read_model
    from identification.simulation import simulate_run, simulate_run_within
    from rigctl.runfile import read_run, with_channel, write_run

    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise InputError(f"--tolerance is {tolerance:g}: it must lie between 0 and 1")
    described, measured = read_model(model), read_run(run)
    with progress_bar("simulating"):
        if tolerance is None:
            force, error = simulate_run(described, measured), None
        else:
            force, error = simulate_run_within(described, measured, tolerance)
    write_run(output, with_channel(measured, "force_simulated", force, "N"))
    print(output if error is None else f"{output}: numerical error {error:.1e} of the force")
