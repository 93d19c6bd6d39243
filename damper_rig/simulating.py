"""Models from their files, and the force that a model gives along runs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TypeAlias

from damper_rig.running import working
from damper_rig.runs import Runs, listed
from identification.blackbox import resampled
from identification.errors import ModelError
from identification.measured import check_runs
from identification.models import KINDS, Choice, Kind, SimulationModel, with_simulation
from identification.models import load_model as read
from identification.models.simulation import SIMULATED
from identification.physical.model import Model
from identification.physical.within import simulate_run_within
from rigctl.runfile import Run, with_channel

__all__ = ["AnyModel", "load_model", "model_of", "simulate"]

AnyModel: TypeAlias = "SimulationModel | str | os.PathLike[str]"  # a model, or its file


def load_model(path: str | os.PathLike[str], fmu: Choice | None = None) -> SimulationModel:
    """The model in a .json or .fmu file; ``fmu`` connects an FMU whose variables have other names.

    Raises ModelFileError or ModelError.
    """
    return read(Path(path), fmu)


def model_of(given: AnyModel, kinds: Sequence[Kind] = KINDS) -> SimulationModel:
    """The model itself, read where it is a file."""
    return read(Path(given), kinds=kinds) if isinstance(given, str | os.PathLike) else given


def at_rate(runs: Sequence[Run], rate_hz: float | None) -> Sequence[Run]:
    """The runs, resampled where a rate is asked for; raises DataError."""
    return runs if rate_hz is None else [resampled(one, rate_hz) for one in runs]


def simulate(
    model: AnyModel, runs: Run | Iterable[Run], *, tolerance: float | None = None, rate_hz: float | None = None
) -> Runs:
    """The runs with a channel `force_simulated`, N, from displacement, current and temperature alone.

    With ``rate_hz`` they are resampled first.

    With ``tolerance`` the solver takes smaller steps until its error is below this share of the force.

    Raises
    ------
    DataError
        Where a run lacks what the model needs.
    SimulationError
        Where the model fails on a run.
    ModelError
        Where a tolerance is asked of a model that is not physical.
    """
    driven, given = model_of(model), at_rate(listed(runs), rate_hz)
    check_runs(given)
    with working("simulating") as tell:
        if tolerance is None:
            return Runs(tuple(with_simulation(driven, given, on_progress=tell)))
        if not isinstance(driven, Model):
            raise ModelError(f"tolerance: '{driven.name}' is of kind '{driven.kind}': only a physical model has one")
        return Runs(tuple(_within(driven, run, tolerance) for run in given))


def _within(model: Model, run: Run, tolerance: float) -> Run:
    force, _ = simulate_run_within(model, run, tolerance)
    return with_channel(run, SIMULATED, force, "N")
