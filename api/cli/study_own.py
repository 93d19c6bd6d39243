"""``damper-rig study own``: damper models in a vehicle that another program has exported as an FMU."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice
from api.cli.options import AsJson
from api.cli.places import part_of
from api.cli.study_vehicle import Current, Models, Page, Step, check_page, models_of

__all__ = ["own"]


def own(
    models: Models,
    *,
    fmu: Annotated[Path, typer.Option("--fmu", metavar="CAR.fmu", help="The vehicle without its dampers.")],
    wiring: Annotated[
        Path, typer.Option("--wiring", metavar="WIRING.toml", help="Which of its variables is what; see the guide.")
    ],
    output: Page,
    config: Annotated[
        Path | None, typer.Option("--config", metavar="STUDY.toml", help="The road and the multisine; see the guide.")
    ] = None,
    current: Current = None,
    step: Step = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    as_json: AsJson = False,
) -> None:
    """Dampers in a vehicle of your own, an FMU: its outputs on a road (ISO 8608), comfort, transmissibility.

    Example: damper-rig study own passive.json --fmu car.fmu --wiring wiring.toml -o own.html
    """
    from api.cli.terminal import answer, progress_bar
    from excitation.configuration import key_of, read_config, to_spec
    from identification.compute import chosen
    from identification.studies.journal import kept
    from identification.studies.vehicle import (
        FmuWiring,
        OnOwn,
        open_vehicle,
        own_study,
        study_data,
        study_text,
        write_study,
    )

    check_page(output)
    keys = {} if config is None else read_config(config)
    keys |= {key_of(k): v for k, v in {"current": current, "step_s": step}.items() if v is not None}
    asked = to_spec(OnOwn, keys, "" if config is None else str(config))
    wires = to_spec(FmuWiring, read_config(wiring), str(wiring))
    loaded = models_of(models, fmu_choice(models, fmu_input, fmu_output, fmu_set))
    vehicle = open_vehicle(fmu, wires)
    with chosen(os.environ), kept(part_of(output)), progress_bar("study") as tell:
        found = own_study(vehicle, loaded, asked, on_progress=tell)
    write_study(output, found)
    answer(f"{study_text(found)}\n{output}", study_data(found) | {"file": str(output)}, as_json=as_json)
