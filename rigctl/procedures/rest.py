"""Readings of a rig at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigctl.axis import Axis
from rigctl.clock import Clock
from rigctl.device import describe
from rigctl.errors import ProcedureError, RigFault, TransportTimeout
from rigctl.procedures.criteria import STILL_M

POLL_S = 0.01  # on average
GOLDEN = 0.6180339887  # its multiples, modulo 1, are spread evenly
STALL_S = 5.0  # without a new reading


@dataclass(frozen=True, slots=True, kw_only=True)
class Rest:
    """Readings at rest, each of another sample of the rig; (n,) arrays."""

    force_n: NDArray[np.float64]
    displacement_m: NDArray[np.float64]
    temperature_degc: NDArray[np.float64]
    window_s: float


def read_at_rest(axis: Axis, clock: Clock, readings: int) -> Rest:
    """Collect so many readings.

    The time between them varies around POLL_S, so that mains hum is not read at one phase.

    Raises
    ------
    ProcedureError
        When the piston moves meanwhile.
    RigFault, TransportTimeout
        When the rig stops, or its clock does.
    """
    rows: list[tuple[float, float, float]] = []
    index, began = -1, clock.now()
    moved_at = began
    while len(rows) < readings:
        status = axis.status()
        if status.faults:
            raise RigFault(f"the rig stopped: {describe(status.faults, status.detector)}")
        if status.state.moving or not status.arrived:
            raise ProcedureError(f"the rig is moving ({status.state.name}): it must be at rest")
        if status.sample_index != index:
            index, moved_at = status.sample_index, clock.now()
            rows.append((status.force_n, status.displacement_m, status.temperature_degc))
        elif clock.now() - moved_at > STALL_S:
            raise TransportTimeout(f"no new reading for {STALL_S:g} s: the rig's clock has stopped")
        clock.sleep(POLL_S * (0.5 + GOLDEN * len(rows) % 1.0))
    force, displacement, temperature = np.array(rows).T
    for name, unit, values in (("force", "N", force), ("displacement", "m", displacement)):
        if not np.all(np.isfinite(values)):
            raise ProcedureError(
                f"the {name} reads {values[~np.isfinite(values)][0]} {unit} at rest: look at its sensor"
            )
    travelled = float(np.ptp(displacement))
    if travelled > STILL_M:
        raise ProcedureError(
            f"the piston moved by {1e6 * travelled:.0f} µm during the reading, at most {1e6 * STILL_M:.0f} µm "
            "are rest: wait until it stands still"
        )
    return Rest(force_n=force, displacement_m=displacement, temperature_degc=temperature, window_s=clock.now() - began)
