"""``damper-rig study``: what a damper is worth in its vehicle, and what a model must be able to do."""

from __future__ import annotations

import typer

from api.cli.study_complexity import complexity
from api.cli.study_explore import explore
from api.cli.study_own import own
from api.cli.study_range import range_
from api.cli.study_realtime import realtime
from api.cli.study_sensitivity import sensitivity
from api.cli.study_vehicle import bogie, seat, vehicle
from api.cli.study_worth import worth

__all__ = ["study"]

study = typer.Typer(
    name="study",
    help="Studies with a model: feasible parameters, what the damper does in a vehicle, what an effect is worth there.",
    no_args_is_help=True,
)
study.command()(explore)
study.command()(sensitivity)
study.command()(complexity)
study.command()(vehicle)
study.command()(seat)
study.command()(bogie)
study.command()(own)
study.command()(worth)
study.command("range")(range_)
study.command()(realtime)
