"""A model of any kind as the force model of the experiment design: the force of a test before it is played."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from api.errors import InputError
from excitation.motion import Motion as PlayedMotion
from excitation.prediction import ForceModel
from identification.models import load_model, motion_from

__all__ = ["force_model"]


def force_model(path: Path) -> ForceModel:
    """Force of the model in a file, N, (N,), over one played period; a periodic motion is settled first.

    Raises ModelError where the file cannot be used; the force model raises InputError where a test lacks the current.
    """
    model = load_model(path)

    def force(played: PlayedMotion) -> NDArray[np.float64]:
        if "current" in model.inputs and played.current_a is None:
            raise InputError(f"{path}: '{model.name}' needs a control current, which the tests do not have: add one")
        n = played.displacement_m.size
        times = 2 if played.repeats > 1.0 else 1
        motion = motion_from(
            np.tile(played.displacement_m, times),
            played.sample_rate_hz,
            velocity=np.tile(played.velocity_m_s, times),
            acceleration=np.tile(played.acceleration_m_s2, times),
            current=0.0 if played.current_a is None else np.tile(played.current_a, times),
            period=n if times > 1 else 0,
        )
        return model.force(motion)[-n:]

    return force
