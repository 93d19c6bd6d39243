"""What a low-pass of two poles and a rest before the motion do to a force with memory."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, lfilter_zi

from identification.discrepancy import explain
from identification.physical.model import Model, element
from identification.record import record_from_run
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


def test_a_low_pass_of_two_poles_is_told_as_it_is_beside_a_force_that_jumps() -> None:
    runs, held_out = [damper(1, 0.012), damper(2, 0.008), damper(3, 0.016)], [damper(4, 0.012)]
    found = explain(BASE, runs, held_out)
    assert "force_delay" in [e.element for e in found.effects]
    assert len(found.effects) == 2
    assert found.held_out.final < 1.5 * found.held_out.noise_floor  # one pole and a dead time leave 6.8
    late = found.model.element("force_delay").values()
    assert late["turn"] == pytest.approx(1.0 / (2.0 * np.pi * LOW_PASS_HZ), rel=0.1)
    assert late["tau"] + late["lag"] == pytest.approx(np.sqrt(2.0) / (2.0 * np.pi * LOW_PASS_HZ), rel=0.05)


@pytest.mark.parametrize("rest_s", [2.0, 6.0])
def test_what_a_machine_remembers_of_a_rest_before_its_motion_is_left_out_as_that_before_a_record(
    rest_s: float,
) -> None:
    _, x, v = motion(1, 0.01)
    rest = np.zeros(round(rest_s * RATE))
    moving = recorded("moving", 1, x, DAMPING * v)
    begun = recorded("begun", 1, np.concatenate([rest, x - x[0]]), DAMPING * np.concatenate([rest, v]))
    counted = [np.arange(r.force.size)[r.window][0] for r in map(record_from_run, (moving, begun))]
    assert counted[0] > 1  # the motion goes through its whole travel first
    assert counted[1] - rest.size == pytest.approx(counted[0], abs=0.02 * RATE)
