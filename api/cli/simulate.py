"""``damper-rig simulate``: the force of a model for the inputs of a run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice

__all__ = ["simulate"]


def simulate(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="The model: .json or .fmu.")],
    run: Annotated[Path, typer.Argument(metavar="RUN.h5", help="The run whose inputs drive the model.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT.h5", help="The run with force_simulated.")],
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance", help="Use smaller steps until the solver's error is below this share of the force."
        ),
    ] = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
) -> None:
    """Simulate a run from its inputs only: displacement, current and temperature.

    Example: damper-rig simulate fitted.json run.h5 -o simulated.h5
    """
    from api.cli.terminal import progress_bar, warn
    from api.errors import InputError
    from identification.measured import read_runs
    from identification.models import load_model, outside_training, simulate_run
    from identification.physical.model import Model
    from identification.physical.within import simulate_run_within
    from rigctl.runfile import with_channel, write_run

    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise InputError(f"--tolerance is {tolerance:g}: it must lie between 0 and 1")
    given = fmu_choice([model], fmu_input, fmu_output, fmu_set)
    described = load_model(model, given, only=() if tolerance is None else ("physical",))
    (measured,) = read_runs([run])
    with progress_bar("simulating"):
        if tolerance is None:
            force, error = simulate_run(described, measured), None
        else:
            assert isinstance(described, Model)  # by `only`
            force, error = simulate_run_within(described, measured, tolerance)
    warn([measured])  # only now: a refusal is one line
    for sentence in outside_training(described, measured):
        print(f"damper-rig: {sentence}", file=sys.stderr)
    write_run(output, with_channel(measured, "force_simulated", force, "N"))
    print(output if error is None else f"{output}: numerical error {error:.1e} of the force")
