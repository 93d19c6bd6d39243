"""Rows of the control path: from the measured current i to the effective current u."""

from __future__ import annotations

from typing import Final

from identification.physical.elements.spec import TINY, ElementSpec, Family, ParameterSpec

ROWS: Final = (
    ElementSpec(
        name="control_lag",
        family=Family.CONTROL,
        title="first-order lag of the control",
        equation="du/dt = (i − u)/tau",
        parameters=(ParameterSpec("tau", "s"),),
        starts=lambda s: [{"tau": part * s.current_time} for part in (0.2, 1.0)],
        needs_current=True,
        memory=True,
    ),
    ElementSpec(
        name="control_delay",
        family=Family.CONTROL,
        title="dead time of the control",
        equation="u(t) = i(t − tau)",
        parameters=(ParameterSpec("tau", "s"),),
        starts=lambda s: [{"tau": part * s.current_time} for part in (0.1, 0.5)],
        needs_current=True,
    ),
    ElementSpec(
        name="control_saturation",
        family=Family.CONTROL,
        title="saturation of the control",
        equation="u = i_s·tanh(i/i_s)",
        parameters=(ParameterSpec("i_s", "A", TINY),),
        starts=lambda s: [{"i_s": part * max(abs(s.current_low), s.current_high)} for part in (0.8, 2.0)],
        needs_current=True,
    ),
    ElementSpec(
        name="control_hysteresis",
        family=Family.CONTROL,
        title="hysteresis of the control",
        equation="u follows i once i has moved by h/2 away from it",
        parameters=(ParameterSpec("h", "A"),),
        starts=lambda s: [{"h": part * (s.current_high - s.current_low)} for part in (0.05, 0.15)],
        needs_current=True,
        memory=True,
    ),
)
