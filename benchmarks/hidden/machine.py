"""The specimen, integrated in fine steps: control, mount and core, compiled; the sensor follows on the fine grid.

With a mount the speed of the core is the root of (core force) = (mount force) at the end of each fine step, and
its position follows by the trapezoidal rule. Without one the core moves as the rig does.
"""

from __future__ import annotations

from math import exp, tanh

import numpy as np
from numpy.typing import NDArray

from benchmarks.hidden import laws
from benchmarks.hidden.laws import compiled, inlined
from benchmarks.hidden.layout import OFFSET

SPEED, STROKE, CURRENT, FORCE = 0, 1, 2, 3
MODIFIED, SPRUNG, ODD, CONTROLLED, RUBBED = 4, 5, 6, 7, 8  # layout.GROUPS

VISCOUS = OFFSET["viscous_damping"]
ARCTAN = OFFSET["arctan_damping"]
PIECEWISE = OFFSET["piecewise_linear_damping"]
VALVE = OFFSET["valve_damping"]
QUADRATIC = OFFSET["quadratic_damping"]
RELIEF = OFFSET["relief_valve"]
ASYMMETRY = OFFSET["damping_asymmetry"]
TANH = OFFSET["tanh_hysteresis"]
WEN = OFFSET["bouc_wen"]
COULOMB = OFFSET["coulomb_friction"]
STRIBECK = OFFSET["stribeck_friction"]
PRESLIDING = OFFSET["presliding_friction"]
LINEAR = OFFSET["linear_stiffness"]
CUBIC = OFFSET["cubic_stiffness"]
GAS = OFFSET["gas_spring"]
STOP = OFFSET["end_stop"]
POSITION = OFFSET["position_dependent_damping"]
FADE = OFFSET["temperature_fade"]
REVERSAL = OFFSET["reversal_force_lag"]
SERIES = OFFSET["series_compliance"]
PLAY = OFFSET["free_play"]
LAG = OFFSET["control_lag"]
DELAY = OFFSET["control_delay"]
SATURATION = OFFSET["control_saturation"]
HYSTERESIS = OFFSET["control_hysteresis"]
RELAXATION = OFFSET["relaxation_branch"]
FRACTIONAL = OFFSET["fractional_damping"]
COGGING = OFFSET["cogging"]
WHISTLE = OFFSET["speed_band_whistle"]
CROSSTALK = OFFSET["current_rate_crosstalk"]
HEATING = OFFSET["dissipation_heating"]
CHATTER = OFFSET["impact_chatter"]
INERTANCE = OFFSET["one_sided_inertance"]
MEMORY = OFFSET["peak_speed_memory"]
BUTTERFLY = OFFSET["leaf_spring_butterfly"]
LEAK = OFFSET["delayed_leak"]

# Indices in the state vector.
H, BRISTLE, TRAVEL, DIRECTION, LAGGED, SETTLED, PLAY_0, BRANCH, LADDER, HEAT, PEAK, LATE, LEAF, AGE, RATE = (
    *range(7),
    *range(9, 11),
    *range(15, 21),
)
LAST_CURRENT = 21
STATES = 22
LADDER_BRANCHES = 4
CONTACT_N_M, CONTACT_N_S_M = 3.0e7, 3.0e3
NEW, OLD = 0.55, 0.45  # weights near the trapezoidal rule, damped so that contact does not ring


@inlined
def control_step(p, s, i, i_delayed, dt):
    """Advance the control path by one fine step and return the effective current."""
    u = i
    if p[DELAY] != 0.0:
        smear = 0.3 * p[DELAY + 2] * p[DELAY + 1]
        u = i_delayed if smear == 0.0 else i_delayed + (s[SETTLED] - i_delayed) * exp(-dt / smear)
        s[SETTLED] = u
    if p[LAG] != 0.0:
        tau = p[LAG + 1] * (1.0 + p[LAG + 2] * laws.sign(u - s[LAGGED]))
        u += (s[LAGGED] - u) * exp(-dt / tau)
        s[LAGGED] = u
    if p[SATURATION] != 0.0:
        u = laws.coil_saturation(p[SATURATION + 1], u, p[SATURATION + 2])
    if p[HYSTERESIS] != 0.0:
        u = domain_wall_play(p, s, u)
    return u


@inlined
def domain_wall_play(p, s, u):
    """Three play operators of different width: the rounded loop of a magnetic circuit."""
    width, q = p[HYSTERESIS + 1], p[HYSTERESIS + 2]
    total = 0.0
    for j in range(3):
        s[PLAY_0 + j] = laws.play_step(s[PLAY_0 + j], u, width * (0.5 + 0.5 * j))
        total += s[PLAY_0 + j] * (1.0 - q if j == 1 else 0.5 * q)
    return total


@inlined
def viscous_like(p, w, u):
    """Sum of the core's terms that depend on velocity only."""
    speed, f = p[SPEED], 0.0
    if p[VISCOUS] != 0.0:
        f += laws.shear_thinning(p[VISCOUS + 1] + p[VISCOUS + 2] * u, w, p[VISCOUS + 3], speed)
    if p[ARCTAN] != 0.0:
        f += laws.saturating_valve(p[ARCTAN + 1], p[ARCTAN + 2], w, p[ARCTAN + 5]) + p[ARCTAN + 3] * w
    if p[PIECEWISE] != 0.0:
        f += laws.blow_off(p[PIECEWISE + 1], p[PIECEWISE + 2], p[PIECEWISE + 3], w, p[PIECEWISE + 4])
    if p[VALVE] != 0.0:
        v = VALVE
        f += laws.spool(p[v + 1], p[v + 2], p[v + 3], p[v + 4], p[v + 5], w, u, p[v + 6])
    if p[QUADRATIC] != 0.0:
        f += laws.orifice(p[QUADRATIC + 1], w, p[QUADRATIC + 2], speed)
    if p[RELIEF] != 0.0:
        f += laws.opening_relief(p[RELIEF + 1], p[RELIEF + 2], w, p[RELIEF + 3])
    if p[ASYMMETRY] != 0.0:
        f += laws.rebound_bias(p[ASYMMETRY + 1], w, p[ASYMMETRY + 2], speed)
    return f


@inlined
def friction_like(p, s, z, dz, w, u):
    """Sum of the core's hysteretic and dry terms."""
    speed, stroke, f = p[SPEED], p[STROKE], 0.0
    if p[TANH] != 0.0:
        alpha = p[TANH + 1] + p[TANH + 2] * u
        f += laws.sliding_tanh(alpha, p[TANH + 3], p[TANH + 4], z, w, p[TANH + 5], stroke)
    if p[WEN] != 0.0:
        h = laws.wen_step(s[H], dz, p[WEN + 2], p[WEN + 3], p[WEN + 4], p[WEN + 5])
        crest = (p[WEN + 2] / (p[WEN + 3] + p[WEN + 4])) ** (1.0 / p[WEN + 5])
        f += p[WEN + 1] * h * (1.0 + p[WEN + 6] * (abs(h) / crest - 0.5 + z / stroke))
    if p[COULOMB] != 0.0:
        f += laws.seal_friction(p[COULOMB + 1], z, w, p[COULOMB + 2], speed, stroke)
    if p[STRIBECK] != 0.0:
        f += laws.breakaway(p[STRIBECK + 1], p[STRIBECK + 2], p[STRIBECK + 3], w, p[STRIBECK + 4], speed)
    if p[PRESLIDING] != 0.0:
        f += laws.dahl_step(s[BRISTLE], dz, p[PRESLIDING + 1], p[PRESLIDING + 2], p[PRESLIDING + 3])
    return f


@inlined
def modifier(p, s, z, dz, w, temperature):
    """Factor on the dissipative sum."""
    factor = 1.0
    if p[POSITION] != 0.0:
        factor *= laws.bypass_groove(p[POSITION + 1], z, p[POSITION + 2], p[STROKE])
    if p[FADE] != 0.0:
        factor *= laws.thinning_oil(p[FADE + 1], p[FADE + 2], temperature, p[FADE + 3])
    if p[REVERSAL] != 0.0:
        travel = abs(dz) + (s[TRAVEL] if w * s[DIRECTION] > 0.0 else 0.0)
        factor *= laws.trapped_gas(travel, p[REVERSAL + 1], p[REVERSAL + 2])
    if p[HEATING] != 0.0:
        factor /= 1.0 + p[HEATING + 1] * s[HEAT]
    if p[MEMORY] != 0.0:
        factor /= 1.0 + p[MEMORY + 1] * s[PEAK] / p[SPEED]
    return factor


@inlined
def spring_like(p, z, temperature):
    stroke, f = p[STROKE], 0.0
    if p[ARCTAN] != 0.0:
        f += p[ARCTAN + 4]
    if p[LINEAR] != 0.0:
        f += laws.rubber(p[LINEAR + 1], z, p[LINEAR + 2], stroke)
    if p[CUBIC] != 0.0:
        f += laws.progressive(p[CUBIC + 1], z, p[CUBIC + 2], stroke)
    if p[GAS] != 0.0:
        f += laws.gas(p[GAS + 1], p[GAS + 2], p[GAS + 3], z, temperature, p[GAS + 4])
    if p[STOP] != 0.0:
        f += laws.bump_stop(p[STOP + 1], p[STOP + 2], z, p[STOP + 3], stroke)
    return f


@inlined
def ladder_branch(p, j):
    """Stiffness and time constant of one branch of the ladder that approximates a fractional derivative."""
    tau = 0.006 * 6.0**j
    return p[FRACTIONAL + 1] * tau ** (-p[FRACTIONAL + 2]), tau


@inlined
def odd_terms(p, s, z, dz, w, a, dt):
    """Sum of the terms outside the catalogue, except those that act on the whole force."""
    f = 0.0
    if p[RELAXATION] != 0.0:
        f += (s[BRANCH] + p[RELAXATION + 1] * dz) * exp(-dt / p[RELAXATION + 2])
    if p[FRACTIONAL] != 0.0:
        for j in range(LADDER_BRANCHES):
            k, tau = ladder_branch(p, j)
            f += (s[LADDER + j] + k * dz) * exp(-dt / tau)
    if p[COGGING] != 0.0:
        f += p[COGGING + 1] * np.sin(2.0 * np.pi * z / p[COGGING + 2] + p[COGGING + 3])
    if p[WHISTLE] != 0.0:
        f += p[WHISTLE + 1] * laws.sign(w) * exp(-(((abs(w) - p[WHISTLE + 2]) / p[WHISTLE + 3]) ** 2))
    if p[INERTANCE] != 0.0:
        f += p[INERTANCE + 1] * tanh(a / p[INERTANCE + 2]) * 0.5 * (1.0 + tanh(w / (0.05 * p[SPEED])))
    if p[BUTTERFLY] != 0.0:
        rub = laws.dahl_step(s[LEAF], dz, 1.0 / p[BUTTERFLY + 2], 1.0, 0.0)
        f += p[BUTTERFLY + 1] * rub * abs(z) / p[STROKE]
    if p[CHATTER] != 0.0:
        f += laws.ringing(s[AGE], p[CHATTER + 1], p[CHATTER + 2], p[CHATTER + 3])
    if p[CROSSTALK] != 0.0:
        f += p[CROSSTALK + 1] * s[RATE]
    return f


@compiled
def core_force(p, s, z, dz, w, u, temperature, a, dt):
    f = viscous_like(p, w, u)
    if p[RUBBED] != 0.0:
        f += friction_like(p, s, z, dz, w, u)
    if p[MODIFIED] != 0.0:
        f *= modifier(p, s, z, dz, w, temperature)
    if p[SPRUNG] != 0.0:
        f += spring_like(p, z, temperature)
    if p[ODD] != 0.0:
        f += odd_terms(p, s, z, dz, w, a, dt)
    if p[LEAK] != 0.0:
        f -= p[LEAK + 1] * max(0.0, s[LATE] - p[LEAK + 2]) * max(0.0, tanh(w / (0.02 * p[SPEED])))
    return f


@compiled
def mount_force(p, e, e_dot):
    """Force of the mount at extension e; a worn joint transmits no force of the wrong sign."""
    k, c, q = CONTACT_N_M, CONTACT_N_S_M, 0.0
    if p[SERIES] != 0.0:
        k, c, q = p[SERIES + 1], p[SERIES + 2], p[SERIES + 3]
    if p[PLAY] == 0.0:
        return k * e * (1.0 + q * (k * e / p[FORCE]) ** 2) + c * e_dot
    side = float(laws.sign(e))
    closed = abs(e) - 0.5 * p[PLAY + 1]
    if closed <= 0.0:
        return 0.0
    softness = p[PLAY + 2]
    seat = closed / (closed + softness * 0.02 * p[PLAY + 1]) if softness > 0.0 else 1.0
    return side * max(0.0, k * closed * seat + c * seat * side * e_dot)


@inlined
def core_speed(p, s, z, w, x1, v1, guess, u, temperature, a, dt):
    """Root w1 of core force − mount force at the end of the step: bracketed Newton."""
    low, high = -np.inf, np.inf
    tolerance, nudge = 1e-6 * p[FORCE], 1e-5 * p[SPEED]
    w1 = guess
    for _ in range(60):
        dz = dt * (OLD * w + NEW * w1)
        gap = core_force(p, s, z + dz, dz, w1, u, temperature, a, dt) - mount_force(p, x1 - z - dz, v1 - w1)
        if abs(gap) < tolerance:
            break
        if gap > 0.0:
            high = w1
        else:
            low = w1
        if high - low < 1e-10 * p[SPEED]:
            break
        w2, dz = w1 + nudge, dz + NEW * dt * nudge
        near = core_force(p, s, z + dz, dz, w2, u, temperature, a, dt) - mount_force(p, x1 - z - dz, v1 - w2)
        slope = (near - gap) / nudge
        w1 = w1 - gap / slope if slope > 0.0 else np.nan
        if not low < w1 < high:
            w1 = 0.5 * (low + high) if high - low < np.inf else (low + p[SPEED] if high == np.inf else high - p[SPEED])
    return w1


@inlined
def settle(p, s, z0, z, w, f, i, dt):
    """Update the states of all elements at the end of a fine step."""
    dz = z - z0
    if p[RUBBED] == 0.0 and p[MODIFIED] == 0.0 and p[ODD] == 0.0:
        return
    if p[WEN] != 0.0:
        s[H] = laws.wen_step(s[H], dz, p[WEN + 2], p[WEN + 3], p[WEN + 4], p[WEN + 5])
    if p[PRESLIDING] != 0.0:
        s[BRISTLE] = laws.dahl_step(s[BRISTLE], dz, p[PRESLIDING + 1], p[PRESLIDING + 2], p[PRESLIDING + 3])
    s[TRAVEL] = abs(dz) + (s[TRAVEL] if w * s[DIRECTION] > 0.0 else 0.0)
    s[DIRECTION] = w
    if p[ODD] != 0.0 or p[MODIFIED] != 0.0:
        settle_odd(p, s, z0, z, dz, w, f, i, dt)


@inlined
def settle_odd(p, s, z0, z, dz, w, f, i, dt):
    if p[RELAXATION] != 0.0:
        s[BRANCH] = (s[BRANCH] + p[RELAXATION + 1] * dz) * exp(-dt / p[RELAXATION + 2])
    if p[FRACTIONAL] != 0.0:
        for j in range(LADDER_BRANCHES):
            k, tau = ladder_branch(p, j)
            s[LADDER + j] = (s[LADDER + j] + k * dz) * exp(-dt / tau)
    if p[BUTTERFLY] != 0.0:
        s[LEAF] = laws.dahl_step(s[LEAF], dz, 1.0 / p[BUTTERFLY + 2], 1.0, 0.0)
    if p[HEATING] != 0.0:
        s[HEAT] += dt * (abs(f * w) / (p[FORCE] * p[SPEED]) - s[HEAT]) / p[HEATING + 2]
    if p[MEMORY] != 0.0:
        s[PEAK] = max(abs(w), s[PEAK] * exp(-dt / p[MEMORY + 2]))
    if p[LEAK] != 0.0:
        s[LATE] = f + (s[LATE] - f) * exp(-dt / p[LEAK + 3])
    if p[CHATTER] != 0.0:
        s[AGE] = 0.0 if z0 < p[CHATTER + 4] <= z else s[AGE] + dt
    if p[CROSSTALK] != 0.0:
        tau = p[CROSSTALK + 2]
        s[RATE] = s[RATE] * exp(-dt / tau) + (i - s[LAST_CURRENT]) / tau
        s[LAST_CURRENT] = i


@compiled
def integrate(p, x, v, a, current, temperature, fine, delay, dt):
    """Force at every fine instant, N. `x`, `v`, `a` are on the fine grid;
    current and temperature are constant over a sample."""
    s = np.zeros(STATES)
    s[AGE] = 1e9
    i = current[0]
    s[LAGGED] = s[SETTLED] = s[LAST_CURRENT] = i
    u0 = laws.coil_saturation(p[SATURATION + 1], i, p[SATURATION + 2]) if p[SATURATION] != 0.0 else i
    s[PLAY_0], s[PLAY_0 + 1], s[PLAY_0 + 2] = u0, u0, u0
    mounted = p[SERIES] != 0.0 or p[PLAY] != 0.0
    force = np.empty(x.size)
    z, w, w_before = x[0], v[0], v[0]
    for k in range(x.size):
        n = k // fine
        i = current[n]
        u = i
        if p[CONTROLLED] != 0.0:
            u = control_step(p, s, i, current[max(k - delay, 0) // fine], dt)
        z0 = z
        if mounted and k > 0:
            w1 = core_speed(p, s, z, w, x[k], v[k], 2.0 * w - w_before, u, temperature[n], a[k], dt)
            z += dt * (OLD * w + NEW * w1)
            w_before, w = w, w1
        else:
            z, w = x[k], v[k]
        f = core_force(p, s, z, z - z0, w, u, temperature[n], a[k], dt)
        force[k] = f
        settle(p, s, z0, z, w, f, i, dt)
    return force


def force_of(
    p: NDArray[np.float64],
    motion: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    current: NDArray[np.float64],
    temperature: NDArray[np.float64],
    fine: int,
    sample_rate_hz: float,
) -> NDArray[np.float64]:
    """Force between mount and load cell on the fine grid, N; `fine` steps to each sample."""
    dt = 1.0 / (sample_rate_hz * fine)
    delay = round(p[DELAY + 1] / dt) if p[DELAY] else 0
    result: NDArray[np.float64] = integrate(p, *motion, current, temperature, fine, delay, dt)
    return result
