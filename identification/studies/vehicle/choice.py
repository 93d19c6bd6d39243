"""Which vehicle, by its name, with settings as a configuration or a request has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from excitation.configuration import to_spec
from identification.errors import DataError
from identification.models.protocol import SimulationModel
from identification.studies.vehicle.answer import Study
from identification.studies.vehicle.bogie_study import OnRail, bogie_study, check_bogie_study
from identification.studies.vehicle.road_study import OnRoad, check_road_study, road_study
from identification.studies.vehicle.seat_study import OnSeat, check_seat_study, seat_study

Tell = Callable[[float, str], None]
Setting = OnRoad | OnSeat | OnRail

VEHICLES: Final[Mapping[str, type[Setting]]] = {"car": OnRoad, "seat": OnSeat, "bogie": OnRail}
"""The vehicles by name, with what states their settings."""


def setting_of(vehicle: str, keys: Mapping[str, Any], where: str = "") -> Setting:
    """The settings of a vehicle from the keys of a configuration; raises DataError or DesignError, one line.

    Any: what JSON can say; the keys are the names of the fields without their units.
    """
    if vehicle not in VEHICLES:
        raise DataError(f"vehicle is {vehicle!r:.40}: use {', '.join(VEHICLES)}")
    return to_spec(VEHICLES[vehicle], keys, where)


def vehicle_study(
    models: Sequence[SimulationModel],
    setting: Setting,
    *,
    specimen: SimulationModel | None = None,
    on_progress: Tell | None = None,
) -> Study:
    """The study of the vehicle that the settings belong to; `specimen` is the damper in a controlled seat."""
    if isinstance(setting, OnRoad):
        return road_study(models, setting, on_progress=on_progress)
    if isinstance(setting, OnSeat):
        return seat_study(models, setting, specimen=specimen, on_progress=on_progress)
    return bogie_study(models, setting, on_progress=on_progress)


def check_vehicle_study(models: Sequence[SimulationModel], setting: Setting) -> None:
    """Raise DataError or SimulationError, one line, where the study of these models cannot begin."""
    if isinstance(setting, OnRoad):
        check_road_study(models, setting)
    elif isinstance(setting, OnSeat):
        check_seat_study(models, setting)
    else:
        check_bogie_study(models, setting)
