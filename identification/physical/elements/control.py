"""Rows of the control path: from the measured current i to the effective current u."""

from __future__ import annotations

from typing import Final

from identification.criteria import FORM
from identification.physical.elements.spec import (
    TINY,
    Alias,
    Departure,
    ElementSpec,
    Family,
    ParameterSpec,
    Remedy,
    Surroundings,
    Values,
    of_shape,
)

_PROBE = "record the current at the coil with a probe of its own"


def _smears(less: Values, more: Values) -> bool:
    """Whether one of a lag and a dead time is only how a real one of the other kind departs from it."""
    return less["tau"] < FORM.minor * more["tau"]


def _never_crossed(values: Values, around: Surroundings) -> bool:
    """Whether no run crosses the width of a hysteresis: what the current left before is then free in every run."""
    return values["h"] >= around.swing


ROWS: Final = (
    ElementSpec(
        name="control_lag",
        family=Family.CONTROL,
        title="first-order lag of the control",
        equation="du/dt = (i − u)/tau; with a fall above 0 that time where the field falls, as of a coil",
        parameters=(
            ParameterSpec("tau", "s", limits=lambda s: (0.0, 0.5 * s.duration), remedy=Remedy.FREQUENCY),
            # Of most coils a field falls faster than it rises, as the iron stays magnetised or the driver brakes.
            of_shape("coil", "fall", "s", lambda own, s: 0.5 * own["tau"], remedy=Remedy.FREQUENCY),
        ),
        starts=lambda s: [{"tau": part * s.current_time} for part in (0.2, 1.0)],
        needs_current=True,
        memory=True,
        alias=Alias("a slow current amplifier", _PROBE),
        departure=Departure(
            of={"control_delay": 0.0},
            is_only=_smears,
            words=lambda v: f"the dead time of the control is smeared by a lag of {v['tau']:.3g} s",
        ),
    ),
    ElementSpec(
        name="coil_lag",
        family=Family.CONTROL,
        title="lag of a coil, of its own for a rising and a falling field",
        equation="du/dt = (i − u)/tau, tau = tau_rise where (i − u)·i > 0, else tau_fall",
        parameters=(
            ParameterSpec("tau_rise", "s", remedy=Remedy.FREQUENCY),
            ParameterSpec("tau_fall", "s", remedy=Remedy.FREQUENCY),
        ),
        nameable=False,  # a lag of the control has a name, and a time of its own for the fall
        needs_current=True,
        memory=True,
        alias=Alias("a current amplifier that is slower one way", _PROBE),
    ),
    ElementSpec(
        name="control_delay",
        family=Family.CONTROL,
        title="dead time of the control",
        equation="u(t) = i(t − tau)",
        parameters=(ParameterSpec("tau", "s", limits=lambda s: (0.0, 0.1 * s.duration), remedy=Remedy.FREQUENCY),),
        starts=lambda s: [{"tau": part * s.current_time} for part in (0.1, 0.5)],
        needs_current=True,
        alias=Alias("a dead time of the current amplifier", _PROBE),
        departure=Departure(
            of={"control_lag": 0.0},
            is_only=_smears,
            words=lambda v: f"the lag of the control sets in after {v['tau']:.3g} s",
        ),
    ),
    ElementSpec(
        name="control_saturation",
        family=Family.CONTROL,
        title="saturation of the control",
        equation="u = i_s·tanh(i/i_s)",
        parameters=(ParameterSpec("i_s", "A", TINY, limits=lambda s: (0.1 * s.current_high, 30.0 * s.current_high)),),
        starts=lambda s: [{"i_s": part * max(abs(s.current_low), s.current_high)} for part in (0.8, 2.0)],
        needs_current=True,
        alias=Alias("a current amplifier at its limit", _PROBE),
    ),
    ElementSpec(
        name="control_hysteresis",
        family=Family.CONTROL,
        title="hysteresis of the control",
        equation="u follows i once i has moved by h/2 away from it",
        parameters=(ParameterSpec("h", "A", limits=lambda s: (0.0, s.current_high - s.current_low)),),
        starts=lambda s: [{"h": part * (s.current_high - s.current_low)} for part in (0.05, 0.15)],
        needs_current=True,
        memory=True,
        remanent=True,
        mistaken=_never_crossed,
        alias=Alias("hysteresis of the current amplifier", _PROBE),
    ),
)
