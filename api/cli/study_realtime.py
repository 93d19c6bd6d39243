"""``damper-rig study realtime``: a model at a fixed step, each step against the clock."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice
from api.cli.options import AsJson
from api.cli.places import to_file
from api.cli.study_vehicle import check_page

__all__ = ["realtime"]


def realtime(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="A model of any kind.")],
    *,
    step: Annotated[float, typer.Option(metavar="S", help="The step, s.")] = 0.001,
    seconds: Annotated[float, typer.Option(metavar="S", help="Simulated time.")] = 10.0,
    stroke: Annotated[float, typer.Option(metavar="M", help="Peak of the random motion of 0.5 … 10 Hz.")] = 0.01,
    current: Annotated[float | None, typer.Option(metavar="A", help="The current; default: mid-training.")] = None,
    paced: Annotated[
        bool, typer.Option("--paced", help="Wait for the time of each step, as a loop with hardware does.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Of the motion.")] = 1,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", callback=to_file, metavar="FILE.html", help="One page that opens offline."),
    ] = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    as_json: AsJson = False,
) -> None:
    """Measured time a step, mean and worst, against the step; and what one bad input does to the force.

    Example: damper-rig study realtime passive.json --step 0.001 -o realtime.html
    """
    from api.cli.terminal import answer, progress_bar
    from identification.models import load_model
    from identification.studies.realtime import realtime as measured
    from identification.studies.realtime import realtime_data, realtime_text
    from identification.studies.realtime_page import write_realtime

    if output is not None:
        check_page(output)
    loaded = load_model(model, fmu_choice([model], fmu_input, fmu_output, fmu_set))
    with progress_bar("stepping") as tell:
        found = measured(
            loaded, step, seconds=seconds, stroke_m=stroke, current=current, seed=seed, paced=paced, on_progress=tell
        )
    text, data = realtime_text(found), realtime_data(found)
    if output is not None:
        write_realtime(output, found)
        text, data = f"{text}\n{output}", data | {"file": str(output)}
    answer(text, data, as_json=as_json)
