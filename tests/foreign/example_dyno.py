"""How `examples/dyno.csv` was made: the simulated rig, four levels of a dyno, a friction that no model file has.

`python -m tests.foreign.example_dyno` writes it again.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim_rig.plant import SimulatedPlant
from sim_rig.specimens import PASSIVE

RATE_HZ: Final = 500.0
LEVELS: Final = ((1.0, 0.02), (2.0, 0.02), (2.0, 0.008), (4.0, 0.02))  # Hz, m
CYCLES: Final = 8
FRICTION_N: Final = 90.0
PATH: Final = Path(__file__).parents[2] / "examples" / "dyno.csv"


def setpoints() -> NDArray[np.float64]:
    """Displacement and current, (N, 2): sines that begin and end at rest, with half a second between."""
    parts = []
    for frequency, amplitude in LEVELS:
        t = np.arange(round(CYCLES / frequency * RATE_HZ)) / RATE_HZ
        parts += [np.zeros(250), amplitude * np.sin(2 * np.pi * frequency * t)]
    x = np.concatenate([*parts, np.zeros(250)])
    return np.stack([x, np.zeros_like(x)], axis=1)


def recorded() -> NDArray[np.float64]:
    """What the rig measured, (N, 5): force, displacement, current, temperature, pressure; SI."""
    damper = PASSIVE.damper._replace(coulomb=FRICTION_N)
    plant = SimulatedPlant(damper, replace(PASSIVE.noise, force_n=4.0), seed=7, start_degc=24.0)
    plant.set_rate(RATE_HZ)
    plant.begin_run()
    return plant.play(setpoints())


def written() -> str:
    """As a dyno with a German keyboard writes it: lines of text, names, units, decimal commas; tension is negative."""
    head = (
        "Stoßdämpferprüfstand 2;;;\nPrüfling;vorn links;;\nAbtastrate;500 Hz;;\n\n"
        "Zeit;Kolbenweg;Dämpferkraft;Öltemperatur\ns;mm;kN;°C\n"
    )
    rows = [
        f"{k / RATE_HZ:.3f};{1e3 * x:.3f};{-1e-3 * force:.5f};{degc:.2f}".replace(".", ",")
        for k, (force, x, _, degc, _) in enumerate(recorded().tolist())
    ]
    return head + "\n".join(rows) + "\n"


if __name__ == "__main__":
    PATH.write_bytes(written().encode("cp1252"))
