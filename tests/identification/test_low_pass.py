"""A low-pass of two poles in the force channel, beside a force that jumps."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, lfilter_zi

from identification.discrepancy import explain
from identification.physical.model import Model, element
from rigctl.runfile import Run
from tests.identification.ordinary import RATE, motion, recorded

Floats = NDArray[np.float64]

LOW_PASS_HZ, DAMPING, FRICTION_N = 6.0, 1500.0, 150.0
BASE = Model(name="viscous", elements=(element("viscous_damping", {"c": 1200.0}),))


def damper(seed: int, amplitude: float) -> Run:
    """A viscous damper with a seal, under Butterworth's low-pass of second order."""
    _, x, v = motion(seed, amplitude)
    force, analogue = DAMPING * v + FRICTION_N * np.tanh(v / 1e-3), butter(2, LOW_PASS_HZ, fs=RATE)
    filtered, _ = lfilter(*analogue, force, zi=lfilter_zi(*analogue) * force[0])
    return recorded("filtered", seed, x, filtered)


@pytest.mark.slow
def test_a_low_pass_of_two_poles_is_told_as_it_is_beside_a_force_that_jumps() -> None:
    runs, held_out = [damper(1, 0.012), damper(2, 0.008), damper(3, 0.016)], [damper(4, 0.012)]
    found = explain(BASE, runs, held_out)
    assert "force_delay" in [e.element for e in found.effects]
    assert len(found.effects) == 2
    assert found.held_out.final < 1.5 * found.held_out.noise_floor  # one pole and a dead time leave 6.8
    late = found.model.element("force_delay").values()
    assert late["turn"] == pytest.approx(1.0 / (2.0 * np.pi * LOW_PASS_HZ), rel=0.1)
    assert late["tau"] + late["lag"] == pytest.approx(np.sqrt(2.0) / (2.0 * np.pi * LOW_PASS_HZ), rel=0.05)
