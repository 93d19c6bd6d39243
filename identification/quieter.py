"""The noise of a record without periods, from what a model leaves of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.errors import SimulationError
from identification.noise import high_frequency, step_of
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record


def quieter(record: Record, model: Model) -> Record:
    """The record with the noise at the highest frequencies of what `model` leaves of its force, where that is less.

    A step of the current, a reversal, or the harmonics of a curve under a broad motion reach the highest frequencies of
    a force and are no noise. A model that has them takes them away; one that has not leaves them, as in the force.
    Periods tell their noise themselves.
    """
    if record.period:
        return record
    try:
        rest = record.measured - predict(model, record)[0]
    except SimulationError:
        return record
    sigma = max(high_frequency(rest)[0], step_of(record.force) / float(np.sqrt(12.0)))
    return replace(record, sigma=sigma) if 0.0 < sigma < record.sigma else record
