"""``damper-rig simulate``: the force of a model for the inputs of a run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice
from api.cli.options import AsJson
from api.cli.places import to_file

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from identification.models import SimulationModel
    from rigctl.runfile import Run

__all__ = ["simulate"]


def simulate(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="The model: .json or .fmu.")],
    run: Annotated[Path, typer.Argument(metavar="RUN.h5", help="The run whose inputs drive the model.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_file, metavar="OUT.h5", help="The run with force_simulated.")
    ],
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance", help="Use smaller steps until the solver's error is below this share of the force."
        ),
    ] = None,
    band: Annotated[
        float | None,
        typer.Option(
            "--band",
            metavar="PERCENT",
            help="Level of the prediction band of a black box, force_low and force_high; default: 90.",
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option("--rate", metavar="HZ", help="Resample the run to this rate first; OUT.h5 has it.")
    ] = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    as_json: AsJson = False,
) -> None:
    """Simulate a run from its inputs only: displacement, current and temperature, or the motion of all axes.

    Example: damper-rig simulate fitted.json run.h5 -o simulated.h5
    """
    from api.cli.simulate_axes import simulate_axes
    from api.cli.terminal import answer, progress_bar, warn
    from api.errors import InputError
    from identification.blackbox import resampled
    from identification.measured import read_runs
    from identification.models import load_model, outside_training, simulate_run
    from identification.multiaxis import multiaxis_in
    from identification.physical.model import Model
    from identification.physical.within import simulate_run_within
    from rigctl.runfile import with_channel, write_run

    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise InputError(f"--tolerance is {tolerance:g}: it must lie between 0 and 1")
    given = fmu_choice([model], fmu_input, fmu_output, fmu_set)
    axes = None if model.suffix.lower() == ".fmu" else multiaxis_in(model)
    if axes is not None:
        simulate_axes(axes, run, output, rate, asked=tolerance is not None or band is not None, as_json=as_json)
        return
    described = load_model(model, given, only=() if tolerance is None else ("physical",))
    (measured,) = (one if rate is None else resampled(one, rate) for one in read_runs([run]))
    with progress_bar("simulating"):
        if tolerance is None:
            force, error = simulate_run(described, measured), None
        else:
            assert isinstance(described, Model)  # by `only`
            force, error = simulate_run_within(described, measured, tolerance)
    limits = _band(described, measured, force, band)
    warn([measured])  # only now: a refusal is one line
    for sentence in outside_training(described, measured):
        print(f"damper-rig: {sentence}", file=sys.stderr)
    made = with_channel(measured, "force_simulated", force, "N")
    for name, series in limits.items():
        made = with_channel(made, name, series, "N")
    write_run(output, made)
    text = str(output) if error is None else f"{output}: numerical error {error:.1e} of the force"
    answer(text, {"file": str(output), "numerical_error": error}, as_json=as_json)


def _band(
    model: SimulationModel, run: Run, force: NDArray[np.float64], percent: float | None
) -> dict[str, NDArray[np.float64]]:
    """The channels of the band; none where the model has none and none is asked for."""
    from api.errors import InputError
    from identification.models.band import LEVEL, check_level, half_width_of
    from identification.models.simulation import checked_motion, for_every_sample

    level = LEVEL if percent is None else percent / 100.0
    check_level(level)
    motion = checked_motion(model, run)
    half = half_width_of(model, motion, level)
    if half is None:
        if percent is not None:
            raise InputError(f"--band: '{model.name}' states no band: identify gives one to a black box")
        return {}
    width = for_every_sample(half, motion, run)
    return {"force_low": force - width, "force_high": force + width}
