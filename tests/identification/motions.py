"""A motion of two tones with a current and a temperature that change, and its sample times."""

from __future__ import annotations

import numpy as np

from identification.models.motion import Motion

DT, N = 1e-3, 2000
T = np.arange(N) * DT


def motion(frequency: float = 2.0, amplitude: float = 0.02) -> Motion:
    turn = 2 * np.pi * frequency
    return Motion(
        dt=DT,
        x=amplitude * np.sin(turn * T) + 0.2 * amplitude * np.sin(3.1 * turn * T),
        v=amplitude * turn * np.cos(turn * T) + 0.62 * amplitude * turn * np.cos(3.1 * turn * T),
        a=-amplitude * turn**2 * np.sin(turn * T) - 0.2 * amplitude * (3.1 * turn) ** 2 * np.sin(3.1 * turn * T),
        i=0.9 + 0.5 * np.sin(2 * np.pi * 1.3 * T),
        temperature=25.0 + 5.0 * T,
        t=T,
    )
