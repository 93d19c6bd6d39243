"""The tests that a report proposes can be designed, whatever machine the runs were of."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation.kinds import Kind
from excitation.plan import test_from_config as excitation_of
from identification.discrepancy.nexttest import _design, library
from identification.record import Record, record_to_come


@given(amplitude=st.floats(1e-4, 0.2), frequency=st.floats(0.1, 20.0))
def test_every_proposed_triangle_can_be_designed(amplitude: float, frequency: float) -> None:
    design = _design(Kind.TRIANGLE, 2000.0, amplitude, frequency, None)
    assert excitation_of(design).excitation.samples > 0


def record(rate: float, amplitude: float, cycles: float, level: float | None, swing: float) -> Record:
    """A sine of that many cycles in 2000 samples, with a current of that level and swing."""
    turn = 2.0 * np.pi * cycles * np.arange(2000) / 2000
    noise = np.random.default_rng(1).standard_normal(2000)
    current = None if level is None else level + swing * noise
    return record_to_come(amplitude * np.sin(turn), rate, current=current, period=0, settle=0, sigma=1.0, kind="sine")


LEVEL = st.one_of(st.none(), st.just(0.0), st.floats(0.01, 3.0), st.floats(-3.0, -0.01))


@settings(max_examples=60, deadline=None)
@given(
    rate=st.sampled_from([50.0, 200.0, 997.0, 1000.0, 5000.0]),
    amplitude=st.floats(1e-5, 0.5),
    cycles=st.floats(2.0, 80.0),
    level=LEVEL,
    share=st.sampled_from([0.0, 1e-3, 0.4]),
)
def test_every_test_of_the_library_can_be_designed_and_a_constant_current_gets_no_steps(
    rate: float, amplitude: float, cycles: float, level: float | None, share: float
) -> None:
    designs = library([record(rate, amplitude, cycles, level, share * abs(level or 0.0))])
    assert all(excitation_of(dict(d)).excitation.samples > 0 for d in designs)
    constant = level in (None, 0.0) or share < 0.01
    assert any(d["kind"] == Kind.STEPS for d in designs) is not constant
    assert len(designs) == (18 if constant else 37)
