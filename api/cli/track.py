"""``damper-rig track``: the current that makes a damper give a wanted force."""

from __future__ import annotations

import sys
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice
from api.cli.places import to_file

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from identification.inverse import Tracking

__all__ = ["track"]

CURRENT = "current_tracking"


def track(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL", help="An inverse (.json), or a model with a current that is inverted.")
    ],
    run: Annotated[Path, typer.Argument(metavar="RUN.h5", help="The run with the motion and the wanted force.")],
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", callback=to_file, metavar="OUT.h5", help="The run with current_tracking and the force."
        ),
    ],
    wanted: Annotated[
        str, typer.Option("--wanted", metavar="CHANNEL", help="Default: force_wanted where there is one, else force.")
    ] = "",
    current: Annotated[
        tuple[float, float] | None,
        typer.Option("--current", metavar="LOW HIGH", help="Limits of the current, A; default: those of the training."),
    ] = None,
    forward: Annotated[
        bool, typer.Option("--by-forward", help="Invert the forward model in an inverse, in place of its network.")
    ] = False,
    rate: Annotated[
        float | None, typer.Option("--rate", metavar="HZ", help="Resample the run to this rate first; OUT.h5 has it.")
    ] = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Find the current for a wanted force, and simulate the forward model with it.

    Where only a part of the force can be made, a warning says where and how much is lacking, the current found is
    written all the same, and the exit status is 0; where nothing can be made, nothing is written.

    Example: damper-rig track inverse.json run.h5 -o tracked.h5
    """
    from api.cli.terminal import answer, progress_bar, warn
    from identification.blackbox import resampled
    from identification.inverse import INVERSE, Limits, tracking_data, wanted_of
    from identification.inverse import track as tracked
    from identification.inverse.model import forward_of
    from identification.measured import read_runs
    from identification.models import load_model
    from identification.models.modelfile import KINDS
    from rigctl.runfile import with_channel, write_run

    limits = None if current is None else Limits(*current)
    choice = fmu_choice([model], fmu_input, fmu_output, fmu_set)
    described = load_model(model, choice, kinds=(*KINDS, INVERSE))
    (measured,) = (one if rate is None else resampled(one, rate) for one in read_runs([run]))
    asked = wanted_of(measured, forward_of(described), wanted)
    with progress_bar("tracking"):
        found = tracked(described, asked, limits, learned=not forward)
    warn([measured])  # only now: a refusal is one line
    cannot = found.described(asked.motion.dt)
    for sentence in (*([cannot] if cannot else []), *found.beyond):
        print(f"damper-rig: {sentence}", file=sys.stderr)
    made = with_channel(measured, CURRENT, _whole(found.current, measured.samples), "A")
    write_run(output, with_channel(made, "force_simulated", _whole(found.force, measured.samples), "N"))
    answer(f"{output}: {_text(found)}", {"file": str(output), **tracking_data(found)}, as_json=as_json)


def _whole(series: NDArray[np.float64], samples: int) -> NDArray[np.float64]:
    """A series for every sample of the run: what a broken last period has more repeats the last value."""
    import numpy as np

    return np.pad(series, (0, samples - series.size), mode="edge")


def _text(found: Tracking) -> str:
    """What came out, in one line."""
    cannot = f", {100.0 * found.share_cannot:.3g} % of the samples cannot be made" if found.share_cannot else ""
    if cannot and isfinite(found.fit_where_it_can):
        cannot += f" (fit of the others {found.fit_where_it_can:.2f} %)"
    if not isfinite(found.fit):
        return f"a constant force is wanted, it is missed by {found.rms:.3g} N rms{cannot}"
    return f"wanted force tracked with a fit of {found.fit:.2f} %, {found.rms:.3g} N rms{cannot}"
