"""Simulate a physical model on a record, with what belongs to a record and to no model estimated from it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.models.motion import Motion
from identification.models.series import is_beyond
from identification.models.simulation import LARGEST_FORCE
from identification.physical.elements import TONE
from identification.physical.elements.equations.control import effective_current
from identification.physical.model import Element, Model, Parameter
from identification.physical.simulate import Simulation, simulate, simulation_of, without_hum
from identification.record import Record
from identification.tone import frequency_in

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

RUNAWAY = 1e100  # a gradient that squares to infinity
_FORGOTTEN = 1e-3  # of the width of a magnet's hysteresis
_FEWEST = 2  # samples: one is no motion


def predict(model: Model, record: Record, *, gradient: bool | Mask = False) -> tuple[Floats, Floats | None]:
    """Simulated force in the record's window, (M,), N, and, where asked, its gradient (M, P); see `simulate`.

    A model on top of another program's simulation adds to that. Mains hum has a phase of its own in every run, and a
    frequency by its clock: they are set to those that fit this record best. So is what the current before the run left
    in a magnetic circuit with hysteresis.

    Raises
    ------
    SimulationError
        as `simulate` does, and where the force is larger than any machine's: a search would take a fit to it for one.
    """
    return prediction_of(model, gradient=gradient).on(record)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """A model with its values, ready for any record; see `prediction_of`."""

    model: Model
    gradient: bool | Mask
    simulation: Simulation | None  # None where it differs from record to record
    remanent: bool

    def on(self, record: Record) -> tuple[Floats, Floats | None]:
        """Force and gradient in the window of a record; see `predict`."""
        model, simulation, motion = self.model, self.simulation, record.motion
        if simulation is None:
            model = in_phase(model, record)
            simulation = simulation_of(model, gradient=self.gradient)
        if self.remanent and record.has_current:
            motion = _as_left(model, record)
        response = simulation.along(motion)
        full, whole = response.gradient, response.force
        if is_beyond(whole, LARGEST_FORCE):
            largest = float(np.max(np.abs(whole)))
            raise SimulationError(
                f"'{model.name}' runs away on {record.name}: to {largest:.3g} N, which no machine has"
            )
        with np.errstate(over="ignore", invalid="ignore"):  # what runs away is told by the sums of its gradient
            force = record.seen(whole)
            full = None if full is None else record.seen(full)
        if record.simulated is not None:
            force = force + record.simulated[record.window]
        return force, full


def prediction_of(model: Model, *, gradient: bool | Mask = False) -> Prediction:
    """The prediction of a model on any record, what all records share being done once; `gradient` as of `simulate`."""
    hums = model.has(TONE.name)
    return Prediction(
        model=model,
        gradient=gradient,
        simulation=None if hums else simulation_of(model, gradient=gradient),
        remanent=any(e.spec.remanent for e in model.elements),
    )


def _as_left(model: Model, record: Record) -> Motion:
    """The record's motion with the remanence that fits it best: −1 for a current from far below, 1 from far above."""
    low, high = (replace(record.motion, remanence=r) for r in (-1.0, 1.0))
    control = model.on("control")
    after = [effective_current(control, m.i, m.dt, m.period, m.remanence)[0] for m in (low, high)]
    window = _until_forgotten(after[1] - after[0], record)
    if window.size == 0:
        return record.motion
    shown = max(int(window[-1]) + 1, _FEWEST)
    down, up = (simulate(model, m if m.period else m.head(shown)).force[window] for m in (low, high))
    half, rest = 0.5 * (up - down), record.force[window] - 0.5 * (up + down)
    if record.simulated is not None:
        rest = rest - record.simulated[window]
    if not 0.0 < np.max(np.abs(half)) < RUNAWAY:
        return record.motion
    share = float(np.dot(rest, half) / np.dot(half, half))
    return replace(record.motion, remanence=min(max(share, -1.0), 1.0))


def _until_forgotten(apart: Floats, record: Record) -> NDArray[np.int64]:
    """The samples of the record's window up to the last in which what was left in the magnet shows in the current."""
    shows = np.flatnonzero(np.abs(apart) > _FORGOTTEN * np.max(np.abs(apart)))
    samples = np.arange(apart.size)[record.window]
    return samples[samples <= (shows[-1] if shows.size else -1)]


def in_phase(model: Model, record: Record) -> Model:
    """The model with phase and frequency of its mains hum as they are in `record`."""
    rest = record.force - simulate(without_hum(model), record.motion).force
    if record.simulated is not None:
        rest = rest - record.simulated
    elements = [replace(e, parameters=_turned(e, rest, record)) if e.spec.tone else e for e in model.elements]
    return replace(model, elements=tuple(elements))


def _turned(hum: Element, rest: Floats, record: Record) -> tuple[Parameter, ...]:
    late = rest[record.window]
    amplitude, frequency, old = hum.parameters
    own = frequency_in(record, late, frequency.value)
    turn = 2.0 * np.pi * own * record.motion.t[record.window]
    phase = float(np.arctan2(np.dot(late, np.cos(turn)), np.dot(late, np.sin(turn))))
    return amplitude, replace(frequency, value=own), replace(old, value=phase)
