"""Free-run simulation of a model of any kind along a run, from the run's inputs alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError, SimulationError
from identification.models.inputs import motion_of, with_measured
from identification.models.motion import Motion
from identification.models.protocol import SimulationModel
from rigctl.runfile import Run, with_channel

Floats = NDArray[np.float64]
SIMULATED = "force_simulated"
"""The channel of a run with the simulated force."""

# N: no machine has a larger force. Half or double: nothing, machines lie far below.
LARGEST_FORCE = 1e12


def simulate_run(model: SimulationModel, run: Run) -> Floats:
    """Force of the model along a run's displacement, current and temperature, (N,), N, for every sample of the run.

    Raises
    ------
    DataError
        when the run lacks the displacement, or a channel that the model needs, or holds no motion at all.
    SimulationError
        when the model fails on this run, which it names, or gives a force that no machine has.
    """
    motion = checked_motion(model, run)
    try:
        return for_every_sample(force_along(model, motion), motion, run)
    except SimulationError as error:
        raise SimulationError(f"{name_of(run)}: {error}") from error


def force_along(model: SimulationModel, motion: Motion) -> Floats:
    """Force of the model along a motion, (N,), N; raises SimulationError where no machine could have it."""
    force = model.force(motion)
    at = int(np.argmax(np.abs(force)))
    if abs(force[at]) > LARGEST_FORCE:
        raise SimulationError(
            f"'{model.name}' gives {force[at]:.3g} N at {at * motion.dt:.4g} s: no machine has more than "
            f"{LARGEST_FORCE:g} N; check its parameters against the range of the run"
        )
    return force


def with_simulation(
    model: SimulationModel, runs: Sequence[Run], *, on_progress: Callable[[float, str], None] | None = None
) -> list[Run]:
    """The runs with a channel `force_simulated`, N; raises as `simulate_run` does."""
    out = []
    for k, run in enumerate(runs):
        if on_progress is not None:
            on_progress(k / len(runs), f"{model.name} on {name_of(run)}")
        out.append(with_channel(run, SIMULATED, simulate_run(model, run), "N"))
    return out


def outside_training(model: SimulationModel, run: Run) -> list[str]:
    """A sentence for each signal of a run that leaves the training range of the model, where it states one."""
    known = model.training_range
    if known is None:
        return []
    return [f"{name_of(run)}: {sentence}" for sentence in known.described(checked_motion(model, run))]


def name_of(run: Run) -> str:
    """The name of a run in messages: its file, or its id."""
    return run.path.name if run.path is not None else run.run_id


def checked_motion(model: SimulationModel, run: Run) -> Motion:
    """The motion of a run that can drive the model; raises DataError, one line, where it can't."""
    check_inputs(model, run)
    return with_measured(motion_of(run), run, model.inputs)


def check_inputs(model: SimulationModel, run: Run, *, but: Sequence[str] = ()) -> None:
    """Raise DataError, one line, where a run cannot drive the model; channels in `but` come from elsewhere."""
    name = name_of(run)
    if "displacement" not in run.channels:
        raise DataError(f"{name}: no channel 'displacement': the model is driven by the measured displacement")
    if run.samples < 2:
        raise DataError(f"{name}: only {run.samples} sample: a motion has at least 2")
    for channel, user in model.inputs.items():
        if channel not in (*run.channels, *but):
            what = "control current" if channel == "current" else channel
            raise DataError(f"{name} has no {what}, which {user} needs: record it or leave it out")


def for_every_sample(force: Floats, motion: Motion, run: Run) -> Floats:
    """The force for every sample: where a periodic run ends within a period, the last period is repeated."""
    missing = run.samples - force.size
    return np.concatenate([force, np.resize(force[-motion.period :], missing)]) if missing > 0 else force
