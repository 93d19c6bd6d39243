"""The tests that a report proposes can be designed, whatever machine the runs were of."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from excitation.kinds import Kind
from excitation.plan import test_from_config as excitation_of
from identification.discrepancy.nexttest import _design


@given(amplitude=st.floats(1e-4, 0.2), frequency=st.floats(0.1, 20.0))
def test_every_proposed_triangle_can_be_designed(amplitude: float, frequency: float) -> None:
    design = _design(Kind.TRIANGLE, 2000.0, amplitude, frequency, None)
    assert excitation_of(design).excitation.samples > 0
