"""``damper-rig simulate`` with a model of several axes: every load for the motion of a run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identification.multiaxis import MultiAxis

__all__ = ["simulate_axes"]


def simulate_axes(
    model: MultiAxis, run: Path, output: Path, rate_hz: float | None, *, asked: bool, as_json: bool
) -> None:
    """Write the run with a channel for each load, such as force_simulated and torque_x_simulated."""
    from api.cli.terminal import answer, warn
    from api.errors import InputError
    from identification.blackbox import resampled
    from identification.measured import read_runs
    from identification.models.simulation import name_of
    from identification.multiaxis import UNITS
    from rigctl.runfile import with_channel, write_run

    if asked:
        raise InputError(f"'{model.name}' is of several axes: it has no solver's tolerance and no band")
    (measured,) = (one if rate_hz is None else resampled(one, rate_hz) for one in read_runs([run]))
    made = measured
    for load, force in model.simulate(measured).items():
        made = with_channel(made, f"{load}_simulated", force, UNITS[load])
    warn([measured])
    for sentence in model.described(measured):
        print(f"damper-rig: {name_of(measured)}: {sentence}", file=sys.stderr)
    write_run(output, made)
    answer(
        str(output), {"file": str(output), "channels": [f"{load}_simulated" for load in model.loads]}, as_json=as_json
    )
