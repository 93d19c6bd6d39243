"""A model of any kind as the base of the discrepancy workflow."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from identification.models.protocol import SimulationModel
from identification.models.simulation import with_simulation
from identification.physical.model import Model
from rigctl.runfile import Run


def as_base(
    model: SimulationModel, runs: Sequence[Run], *, on_progress: Callable[[float, str], None] | None = None
) -> tuple[Model | None, list[Run]]:
    """What `explain` is given: a physical model and the runs, or None and the runs with what another kind simulates.

    Effects are then named on top of the simulation, as on that of any other program. Raises as `simulate_run` does.
    """
    if isinstance(model, Model):
        return model, list(runs)
    return None, with_simulation(model, runs, on_progress=on_progress)
