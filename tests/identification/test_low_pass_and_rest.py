"""A friction under a low-pass of two poles, and after a rest: neither makes another effect of it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, lfilter

from identification.discrepancy import explain
from identification.physical.model import Model, element
from identification.record import record_from_run
from rigctl.runfile import Run
from tests.identification.ordinary import RATE, motion, recorded

Floats = NDArray[np.float64]

STIFFNESS, DAMPING, SLIP_N, SLIP_M = 3e5, 3e3, 150.0, 2e-4
LOW_PASS_HZ = 5.0
BASE = Model(
    name="a rubber mount",
    elements=(element("linear_stiffness", {"k": 2.6e5}), element("viscous_damping", {"c": 2.5e3})),
)


def slipping(x: Floats) -> Floats:
    """Force of a spring of `SLIP_N`/`SLIP_M` that slips at `SLIP_N`, (N,), N."""
    force, now = np.zeros(x.size), 0.0
    for k in range(1, x.size):
        now = float(np.clip(now + (x[k] - x[k - 1]) * SLIP_N / SLIP_M, -SLIP_N, SLIP_N))
        force[k] = now
    return force


def mount(seed: int, amplitude: float) -> Run:
    """A rubber mount with slip springs under Butterworth's low-pass of second order."""
    _, x, v = motion(seed, amplitude)
    force = STIFFNESS * x + DAMPING * v + slipping(x)
    return recorded("filtered", seed, x, lfilter(*butter(2, LOW_PASS_HZ, fs=RATE), force))


def test_a_friction_under_a_low_pass_of_two_poles_is_a_friction_and_a_late_force() -> None:
    runs, held_out = [mount(1, 0.003), mount(2, 0.002), mount(3, 0.004)], [mount(4, 0.003)]
    found = explain(BASE, runs, held_out)
    names = {e.element for e in found.effects}
    assert "force_delay" in names
    assert names - {"force_delay"} <= {"presliding_friction", "bouc_wen"}
    assert len(names) == 2
    assert found.verdict == "explained"
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
