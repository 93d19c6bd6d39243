"""Which set-points may be played: the host refuses a waveform that the rig would refuse, and the other way round."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from excitation.harmonic import SineSpec, TriangleSpec, sine, triangle
from rigctl.device import Fault
from rigctl.errors import LimitError
from rigctl.interlocks import check_waveform
from rigctl.limits import Limits
from rigctl.setpoint_check import RESOLUTION_M, Quantity, all_bad, at_rest
from rigctl.waveform import with_ramps
from sim_rig.detectors import check_setpoints

LIMITS = Limits()


def violated(x: NDArray[np.float64], rate_hz: float = 1000.0) -> set[Quantity]:
    return {bad.quantity for bad in all_bad(x, np.zeros_like(x), at_rest(float(x[0])), LIMITS, rate_hz)}


def a_triangle(corner_time_s: float) -> NDArray[np.float64]:
    spec = TriangleSpec(
        sample_rate_hz=1000.0, amplitude_m=0.02, frequency_hz=1.0, cycles=3, corner_time_s=corner_time_s
    )
    return with_ramps(triangle(spec), 0.5).displacement_m


def test_a_sharp_corner_is_a_jump_of_the_velocity_and_is_refused_in_one_line_with_its_cure() -> None:
    with pytest.raises(
        LimitError, match=r"^acceleration leaves -60 … 60 m/s²: 80 at sample 251, .*corner_time"
    ) as error:
        check_waveform(a_triangle(0.0), np.zeros(4000), 1000.0, LIMITS)
    assert "\n" not in str(error.value)


def test_a_rounded_corner_may_be_played() -> None:
    check_waveform(a_triangle(0.01), np.zeros(4000), 1000.0, LIMITS)


def test_a_step_of_a_tenth_of_a_millimetre_is_a_jump() -> None:
    x = np.zeros(100)
    x[50:] = 1e-4
    assert violated(x) == {Quantity.ACCELERATION, Quantity.JUMP}


def test_an_acceleration_within_the_limit_must_not_be_reversed_within_one_sample() -> None:
    x = np.zeros(100)
    x[50] = 5e-5  # 50, then −100, then 50 m/s²
    assert violated(x) == {Quantity.ACCELERATION, Quantity.JUMP}
    swaying = np.cumsum(np.cumsum(np.resize([40e-6, -40e-6], 100)))
    assert violated(swaying - swaying[0]) == {Quantity.JUMP}


@pytest.mark.parametrize("rate_hz", [100.0, 1000.0, 5000.0])
def test_a_sine_at_the_limit_of_acceleration_may_be_played_at_any_rate(rate_hz: float) -> None:
    for factor, allowed in ((0.97, True), (1.1, False)):
        amplitude = factor * LIMITS.acceleration_m_s2 / (2 * np.pi * 5.0) ** 2
        spec = SineSpec(sample_rate_hz=rate_hz, amplitude_m=amplitude, frequency_hz=5.0, cycles=5)
        found = violated(with_ramps(sine(spec), 1.0).displacement_m, rate_hz)
        assert (Quantity.ACCELERATION not in found) is allowed


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([100.0, 1000.0, 5000.0]),
    st.floats(0.1, 3.0),
    st.integers(1, 40),
)
def test_what_the_host_accepts_the_rig_accepts_after_the_wire_has_rounded_it_in_blocks_of_any_size(
    seed: int, rate_hz: float, hard: float, block: int
) -> None:
    random = np.random.default_rng(seed)
    t = np.arange(400) / rate_hz
    f = random.uniform(0.5, 20.0, 3) * rate_hz / 1000
    a = hard * LIMITS.acceleration_m_s2 / 3 / (2 * np.pi * f) ** 2
    x = np.clip((a[:, None] * np.sin(2 * np.pi * f[:, None] * t)).sum(axis=0), -1, 1) * np.hanning(400)
    sent = np.round(x / RESOLUTION_M) * RESOLUTION_M
    before, played, fault = at_rest(float(sent[0])), 0, Fault.NONE
    for start in range(0, 400, block):
        rows = np.column_stack([sent[start : start + block], np.zeros(sent[start : start + block].size)])
        good, fault = check_setpoints(rows, before, LIMITS, rate_hz)
        played += good
        if fault:
            break
        before = before.then(rows[:, 0])
    bad = all_bad(x, np.zeros(400), at_rest(float(x[0])), LIMITS, rate_hz)
    if not bad:
        assert (played, fault) == (400, Fault.NONE)
    # and what is refused by the rig was refused by the host, not later
    if fault:
        assert min(one.sample for one in bad) <= played
