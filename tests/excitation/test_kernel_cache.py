"""The cache of the simulated rig's loops: a second process compiles nothing."""

from __future__ import annotations

import subprocess
import sys

PLAY = """
import numpy as np
from sim_rig import plant
from sim_rig.specimens import SPECIMENS

one = SPECIMENS["semi-active"]
plant.SimulatedPlant(one.damper, one.noise, seed=1, start_degc=25.0).play(np.zeros((5, 2)))
print(len(plant.play.stats.cache_hits), len(plant.play.stats.cache_misses))
"""


def test_a_rig_that_starts_again_finds_its_compiled_loop() -> None:
    said = [
        subprocess.run([sys.executable, "-c", PLAY], capture_output=True, text=True, check=True).stdout.split()
        for _ in range(2)
    ]
    assert said[1] == ["1", "0"]
