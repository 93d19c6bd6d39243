"""The servo-hydraulic actuator, compiled: valve, oil column, piston, position controller."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_rig.compiled import compiled

X, V, A, SPOOL, SPOOL_RATE, OIL, LOAD = range(7)
STATE: Final = 8


class Actuator(NamedTuple):
    """A 25 kN actuator with a three-stage valve; SI."""

    valve_rad_s: float = 2.0 * math.pi * 120.0
    valve_damping: float = 0.8
    speed_m_s: float = 2.4  # of the piston, no load, valve open
    stall_n: float = 30e3
    oil_n_m: float = 1.2e8
    oil_ns_m: float = 6e4
    leak_m_s_n: float = 2e-8
    piston_kg: float = 60.0
    seal_ns_m: float = 300.0
    gain_1_s: float = 50.0
    lead_s: float = 0.0016  # of the speed feed-forward: compensates a part of the valve's lag
    compensation: float = 0.9  # of the valve's loss of flow under load


@compiled
def step(p: Actuator, s: NDArray[np.float64], command_m: float, feed_m_s: float, load_n: float, h: float) -> None:
    """Advance by h under the damper's force; the state then holds position, speed and acceleration.

    Valve: second order to the demanded speed, opening limited to ±1. Flow: proportional to the root of the pressure
    that is left by the load. Oil: a spring and a dashpot between flow and piston. Semi-implicit Euler.
    """
    s[LOAD] += (load_n - s[LOAD]) * (1.0 - math.exp(-h / 0.002))
    demand = (feed_m_s + p.gain_1_s * (command_m - s[X])) / p.speed_m_s
    demand /= 1.0 + p.compensation * (_flow(p, demand, s[LOAD]) - 1.0)
    demand = min(max(demand, -1.0), 1.0)
    rate = p.valve_rad_s**2 * (demand - s[SPOOL]) - 2.0 * p.valve_damping * p.valve_rad_s * s[SPOOL_RATE]
    s[SPOOL_RATE] += h * rate
    s[SPOOL] = min(max(s[SPOOL] + h * s[SPOOL_RATE], -1.0), 1.0)
    thrust = p.oil_n_m * s[OIL]
    flow = p.speed_m_s * s[SPOOL] * _flow(p, s[SPOOL], thrust)
    pushing = min(max(thrust + p.oil_ns_m * (flow - s[V]), -p.stall_n), p.stall_n)
    s[A] = (pushing - load_n - p.seal_ns_m * s[V]) / p.piston_kg
    s[V] += h * s[A]
    s[X] += h * s[V]
    s[OIL] += h * (flow - s[V] - p.leak_m_s_n * pushing)


@compiled
def _flow(p: Actuator, opening: float, load_n: float) -> float:
    """Flow over no-load flow under a load: sqrt(1 − load/stall), load against the motion positive."""
    against = load_n if opening >= 0.0 else -load_n
    return math.sqrt(min(max(1.0 - against / p.stall_n, 0.04), 1.96))
