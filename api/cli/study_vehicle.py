"""``damper-rig study vehicle``, ``seat`` and ``bogie``: damper models of any kind in a vehicle."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice
from api.cli.options import AsJson
from api.cli.places import part_of, to_file

if TYPE_CHECKING:
    from identification.models import Choice, SimulationModel
    from identification.studies.vehicle.choice import Setting

__all__ = ["Config", "Current", "Page", "Step", "bogie", "check_page", "models_of", "seat", "settings", "vehicle"]

Models = Annotated[list[Path], typer.Argument(metavar="MODEL.json ...", help="Models of any kind, compared.")]
Page = Annotated[
    Path, typer.Option("-o", "--output", callback=to_file, metavar="FILE.html", help="One page that opens offline.")
]
Config = Annotated[
    Path | None, typer.Option("--config", metavar="STUDY.toml", help="The vehicle and what moves it; see the guide.")
]
Current = Annotated[float | None, typer.Option(metavar="A", help="The current, held, for models that need one.")]
Step = Annotated[float | None, typer.Option(metavar="S", help="The step, s; else that of a black box, or 0.001.")]
_SINES_HZ = (0.7, 0.9, 1.0, 1.1, 1.2, 1.4, 1.7, 2.0, 3.0, 5.0, 8.0, 10.0, 12.0, 15.0)


def vehicle(
    models: Models,
    *,
    output: Page,
    config: Config = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    road: Annotated[str | None, typer.Option(metavar="A … H", help="Class of the road, ISO 8608; else C.")] = None,
    speed: Annotated[float | None, typer.Option(metavar="KM/H", help="Speed of the vehicle; else 72.")] = None,
    seconds: Annotated[float | None, typer.Option(metavar="S", help="Time on the road; else 20.")] = None,
    seed: Annotated[int | None, typer.Option(help="Of the road and the multisine; else 1.")] = None,
    sines: Annotated[bool, typer.Option("--sines", help="Stepped sines of 10 mm too; takes some minutes.")] = False,
    current: Current = None,
    step: Step = None,
    as_json: AsJson = False,
) -> None:
    """Comfort (ISO 2631-1), wheel load and transmissibility of a quarter car with each damper on a road (ISO 8608).

    Example: damper-rig study vehicle passive.json -o vehicle.html
    """
    given = {
        "road_class": None if road is None else road.upper(),
        "speed_m_s": None if speed is None else speed / 3.6,
        "seconds": seconds,
        "seed": seed,
        "current": current,
        "sines_hz": _SINES_HZ if sines else None,
        "step_s": step,
    }
    choice = fmu_choice(models, fmu_input, fmu_output, fmu_set)
    _finish(models, settings("car", config, given), output, choice, as_json=as_json)


def seat(
    models: Models,
    *,
    output: Page,
    config: Config = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    specimen: Annotated[
        Path | None,
        typer.Option(metavar="MODEL.json", help="The damper in the seat; else the model of each inverse itself."),
    ] = None,
    sky: Annotated[float | None, typer.Option(metavar="N·S/M", help="Damping of the skyhook; else 2000.")] = None,
    currents: Annotated[
        tuple[float, float] | None, typer.Option(metavar="LOW HIGH", help="Limits of the current, A; else 0 1.")
    ] = None,
    amplitude: Annotated[float | None, typer.Option(metavar="M", help="Of the floor's sines; else 0.005.")] = None,
    passive: Annotated[float | None, typer.Option(metavar="N·S/M", help="The passive damper; else 942.")] = None,
    step: Step = None,
    as_json: AsJson = False,
) -> None:
    """A seat with skyhook control: the current is looked up in the inverse of each model, beside the passive seat.

    Example: damper-rig study seat original.json modified.json -o seat.html
    """
    given = {
        "sky_n_s_per_m": sky,
        "lowest": None if currents is None else currents[0],
        "highest": None if currents is None else currents[1],
        "amplitude_m": amplitude,
        "passive_n_s_per_m": passive,
        "step_s": step,
    }
    choice = fmu_choice([*models, *([specimen] if specimen else [])], fmu_input, fmu_output, fmu_set)
    _finish(models, settings("seat", config, given), output, choice, as_json=as_json, specimen=specimen)


def bogie(
    models: Models,
    *,
    output: Page,
    config: Config = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    speeds: Annotated[
        tuple[float, float] | None, typer.Option(metavar="LOW HIGH", help="Speeds, km/h; else 108 432.")
    ] = None,
    current: Current = None,
    step: Step = None,
    as_json: AsJson = False,
) -> None:
    """Critical speed and limit cycles of a railway bogie with each model as its yaw dampers.

    Example: damper-rig study bogie yaw.json -o bogie.html
    """
    given = {
        "low_m_s": None if speeds is None else speeds[0] / 3.6,
        "high_m_s": None if speeds is None else speeds[1] / 3.6,
        "current": current,
        "step_s": step,
    }
    choice = fmu_choice(models, fmu_input, fmu_output, fmu_set)
    _finish(models, settings("bogie", config, given), output, choice, as_json=as_json)


def settings(vehicle: str, config: Path | None, given: Mapping[str, Any]) -> Setting:
    """The settings of a file with the options that were given in their place. Any: what JSON can say."""
    from excitation.configuration import key_of, read_config
    from identification.studies.vehicle import setting_of

    keys = {} if config is None else read_config(config)
    keys |= {key_of(name): value for name, value in given.items() if value is not None}
    return setting_of(vehicle, keys, "" if config is None else str(config))


def models_of(paths: list[Path], choice: Choice | None = None) -> list[SimulationModel]:
    """The models of some files; `choice` connects an FMU."""
    from identification.models import load_model

    return [load_model(path, choice) for path in paths]


def check_page(output: Path) -> None:
    """Raise InputError where the name is not that of a page."""
    from api.errors import InputError

    if output.suffix != ".html":
        raise InputError(f"{output}: the study is a web page: end its name in .html")


def _finish(
    models: list[Path],
    setting: Setting,
    output: Path,
    choice: Choice | None,
    *,
    as_json: bool,
    specimen: Path | None = None,
) -> None:
    """Carry a study out, write its page, and answer."""
    from api.cli.terminal import answer, progress_bar
    from identification.compute import chosen
    from identification.studies.journal import kept
    from identification.studies.vehicle import study_data, study_text, vehicle_study, write_study

    check_page(output)
    loaded, inside = models_of(models, choice), models_of([specimen], choice)[0] if specimen else None
    with chosen(os.environ), kept(part_of(output)), progress_bar("study") as tell:
        found = vehicle_study(loaded, setting, specimen=inside, on_progress=tell)
    write_study(output, found)
    answer(f"{study_text(found)}\n{output}", study_data(found) | {"file": str(output)}, as_json=as_json)
