"""A fitted damper as the force model of the experiment design: what a test will pull before it is played."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from api.errors import InputError
from excitation.motion import Motion as PlayedMotion
from excitation.prediction import ForceModel
from identification.models.motion import Motion
from identification.physical.modelfile import read_model
from identification.physical.simulate import simulate

__all__ = ["force_model"]

_ROOM_DEGC = 25.0


def force_model(path: Path) -> ForceModel:
    """Force of the model in a file, N, (N,), over one played period; a periodic motion is settled first.

    Raises ModelError where the file cannot be used; the force model raises InputError where a test lacks the current.
    """
    model = read_model(path)

    def force(played: PlayedMotion) -> NDArray[np.float64]:
        if model.needs_current and played.current_a is None:
            raise InputError(f"{path}: '{model.name}' needs a control current, which the tests have not: give them one")
        n = played.displacement_m.size
        periodic = played.repeats > 1.0
        found: NDArray[np.float64] = simulate(model, _twice(played) if periodic else _once(played)).force[-n:]
        return found

    return force


def _once(played: PlayedMotion) -> Motion:
    n = played.displacement_m.size
    return Motion(
        dt=1.0 / played.sample_rate_hz,
        x=played.displacement_m,
        v=played.velocity_m_s,
        a=played.acceleration_m_s2,
        i=np.zeros(n) if played.current_a is None else played.current_a,
        temperature=np.full(n, _ROOM_DEGC),
        t=np.arange(n) / played.sample_rate_hz,
    )


def _twice(played: PlayedMotion) -> Motion:
    one = _once(played)
    n = one.x.size
    index = np.arange(2 * n) % n
    return replace(
        one,
        x=one.x[index],
        v=one.v[index],
        a=one.a[index],
        i=one.i[index],
        temperature=one.temperature[index],
        t=np.arange(2.0 * n) * one.dt,
        period=n,
    )
