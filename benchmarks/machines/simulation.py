"""A machine moved in fine steps: chambers, friction, gas, magnets, and what stands in series with them.

Every state is advanced by an implicit rule, so that stiff oil and contact need no smaller step. With a bush or a joint
in series, and where a force drives the machine, the speed of its core is the root of the balance of forces at the end
of the step, its place follows by the trapezoidal rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray

from benchmarks.machines import laws
from benchmarks.machines.laws import compiled, inner
from benchmarks.machines.organs import AT, Values, vector

Row = NDArray[np.float64]

# Places in the vector of numbers, by organ.
AREA_R, AREA_C, BLEED_R, BLEED_C, PORT_R, PORT_C = (
    AT[n] for n in ("area_r", "area_c", "bleed_r", "bleed_c", "port_r", "port_c")
)
SHIM_AT_R, SHIM_AT_C, SHIM_R, SHIM_C = (AT[n] for n in ("shim_at_r", "shim_at_c", "shim_r", "shim_c"))
BLOW_AT_R, BLOW_AT_C, BLOW_R, BLOW_C = (AT[n] for n in ("blow_at_r", "blow_at_c", "blow_r", "blow_c"))
ROUND, ELASTANCE, AIR, AIR_AT, DEAD, SUCTION = (
    AT[n] for n in ("shim_round", "elastance", "air", "air_at", "dead_length", "suction")
)
FIRM, FIRM_AT, FIRM_WIDTH = (AT[n] for n in ("firm", "firm_at", "firm_width"))
GAS, GAS_LENGTH, GAS_N, GAS_TIME = (AT[n] for n in ("gas_force", "gas_length", "gas_exponent", "gas_time"))
RUB, RUB_TRAVEL, RUB_RISE, RUB_SPEED, RUB_BIAS = (
    AT[n] for n in ("rub", "rub_travel", "rub_rise", "rub_speed", "rub_bias")
)
SLIP, SLIP_TRAVEL, FILM, DRAG, FILM_BIAS = (AT[n] for n in ("slip", "slip_travel", "film", "drag", "film_bias"))
SPRING, RISE, RISE_LENGTH = (AT[n] for n in ("spring", "rise", "rise_length"))
BUFFER, BUFFER_AT, BUFFER_LENGTH, ONE_SIDE = (
    AT[n] for n in ("buffer", "buffer_at", "buffer_length", "buffer_one_side")
)
GROOVE, GROOVE_LENGTH, THIN, HOT, HOT_TIME = (AT[n] for n in ("groove", "groove_length", "thin", "hot", "hot_time"))
YIELD_0, YIELD_I, YIELD_SPEED = (AT[n] for n in ("yield_0", "yield_i", "yield_speed"))
COIL_RISE, COIL_FALL, COIL_SAT, COIL_PLAY, DELAY = (
    AT[n] for n in ("coil_rise", "coil_fall", "coil_sat", "coil_play", "driver_delay")
)
MASS, BUSH, BUSH_LOSS, PLAY = (AT[n] for n in ("mass", "bush", "bush_loss", "play"))
COG, COG_PITCH, POWER, ORDER, KICK, KICK_TIME = (
    AT[n] for n in ("cog", "cog_pitch", "power_law", "power_order", "kick", "kick_time")
)

# Places in the vector of states: pressure, empty volume and its filling, gas temperature, coil current, its play, heat,
# kick, last current, largest force, slope of the balance; then the springs of the seal, those of the long friction, and
# the branches of the power law.
P, VOID, FILLING, GAS_T, COIL, PLAYED, HEAT, KICKED, LAST, LEVEL, SLOPE = range(11)
SEAL, SLIPS, LADDER = 11, 14, 20
SEALS, SLIP_COUNT, BRANCHES = 3, 6, 6
STATES = LADDER + BRANCHES
NEWTON_STEPS = 40  # at most; three to five are taken
BALANCE_STEPS = 80  # at most; three to five are taken
BALANCED = 1e-7  # of the largest force so far
JOINT_N_M = 2.0e7  # metal on metal in a joint without a bush


@inner
def flow(p, s, k, thin):
    """Flow out of the chamber under its pressure s (signed), m³/s, at a resistance k of the spool."""
    if s >= 0.0:
        q = laws.valve_flow(
            s, p[BLEED_R] / k, p[PORT_R], p[SHIM_AT_R] * k, p[SHIM_R], p[BLOW_AT_R], p[BLOW_R], p[ROUND]
        )
    else:
        q = -laws.valve_flow(
            -s, p[BLEED_C] / k, p[PORT_C], p[SHIM_AT_C] * k, p[SHIM_C], p[BLOW_AT_C], p[BLOW_C], p[ROUND]
        )
    return q / thin


@inner
def elastance(p, s, z):
    """Pressure rise for a volume, Pa/m³: stiff oil in series with free air that is soft at low pressure."""
    e = p[ELASTANCE]
    if p[DEAD] > 0.0:
        r = min(abs(z) / p[DEAD], 0.95)
        e /= 1.0 - r * r
    if p[AIR] > 0.0:
        r = 1.0 + abs(s) / p[AIR_AT]
        e /= 1.0 + p[AIR] / (r * r)
    return e


@inner
def pressure(p, before, void, filling, z, w, k, thin, dt):
    """(pressure at the end of the step, empty volume, its filling): inflow = outflow + what the oil takes up."""
    inflow = (p[AREA_R] if w > 0.0 else p[AREA_C]) * w
    s = before
    soft = p[ELASTANCE] > 0.0
    low, high = -1e10, 1e10
    for _ in range(NEWTON_STEPS):
        q = flow(p, s, k, thin)
        step = max(1e-6 * abs(s), 1.0)
        slope = (flow(p, s + step, k, thin) - q) / step
        if soft:
            e = elastance(p, 0.5 * (s + before), z)
            g, slope = (s - before) / (e * dt) - inflow + q, 1.0 / (e * dt) + slope
        else:
            g = q - inflow
        if g > 0.0:
            high = s
        else:
            low = s
        new = s - g / slope
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - s) <= 1e-7 * abs(new) + 1e-2:
            s = new
            break
        s = new
    if p[SUCTION] > 0.0 and (void > 0.0 or s < -p[SUCTION]):
        now = inflow - flow(p, -p[SUCTION], k, thin)
        void -= 0.5 * dt * (now + filling)
        if void > 0.0:
            return -p[SUCTION], void, now
        s = max(s, -p[SUCTION])
    return s, 0.0, 0.0


@inner
def branch(p, j):
    """Stiffness and time constant of one branch of a ladder whose sum relaxes as time to the power −order."""
    tau = 0.003 * 5.0**j
    return p[POWER] * tau ** (-p[ORDER]), tau


@inner
def core_force(p, s, z0, z, w, u, temperature, dt, settle):
    """Force of the core at the end of a step from z0 to z with speed w; the states are moved on if `settle`."""
    dz, lost = z - z0, 0.0
    thin = laws.thinner(temperature, p[THIN]) if p[THIN] != 0.0 else 1.0
    if p[AREA_R] > 0.0:
        k = laws.spool(u, p[FIRM], p[FIRM_AT], p[FIRM_WIDTH])
        now, void, filling = pressure(p, s[P], s[VOID], s[FILLING], z, w, k, thin, dt)
        lost += (p[AREA_R] if now > 0.0 else p[AREA_C]) * now
        if settle:
            s[P], s[VOID], s[FILLING] = now, void, filling
    lost += thin * (p[FILM] * (1.0 + (p[FILM_BIAS] if w > 0.0 else -p[FILM_BIAS])) * w + p[DRAG] * w * sqrt(abs(w)))
    if p[YIELD_0] != 0.0 or p[YIELD_I] != 0.0:
        lost += (p[YIELD_0] + p[YIELD_I] * max(u, 0.0)) * laws.yielding(w, p[YIELD_SPEED])
    lost += rubbed(p, s, dz, w, settle)
    if p[GROOVE] != 0.0:
        lost *= laws.groove(z, p[GROOVE], p[GROOVE_LENGTH])
    if p[HOT] != 0.0:
        lost /= 1.0 + p[HOT] * s[HEAT]
        if settle:
            s[HEAT] += dt * (abs(lost * w) - s[HEAT] / p[HOT_TIME])
    return lost + sprung(p, s, z0, z, w, dt, settle)


@inner
def rubbed(p, s, dz, w, settle):
    """Friction of the seals, and of what slips over a longer travel."""
    f = 0.0
    if p[RUB] > 0.0:
        total = 0.0
        for j in range(SEALS):
            new = laws.stick(s[SEAL + j], dz, p[RUB_TRAVEL] * 2.5**j)
            total += new
            if settle:
                s[SEAL + j] = new
        f += total / SEALS * laws.rubbing(p[RUB], p[RUB_RISE], p[RUB_SPEED], p[RUB_BIAS], w)
    if p[SLIP] > 0.0:
        total = 0.0
        for j in range(SLIP_COUNT):
            new = laws.stick(s[SLIPS + j], dz, p[SLIP_TRAVEL] * (0.15 + 0.34 * j))
            total += new
            if settle:
                s[SLIPS + j] = new
        f += total / SLIP_COUNT * p[SLIP]
    return f


@inner
def sprung(p, s, z0, z, w, dt, settle):
    """Springs, gas, buffers, rubber with a power law, and tooth passing."""
    f = p[SPRING] * z
    if p[RISE] != 0.0:
        f += laws.progressive(z, p[RISE], p[RISE_LENGTH])
    if p[BUFFER] > 0.0:
        f += laws.bumper(z - p[BUFFER_AT], p[BUFFER], p[BUFFER_LENGTH])
        if p[ONE_SIDE] == 0.0:
            f -= laws.bumper(-z - p[BUFFER_AT], p[BUFFER], p[BUFFER_LENGTH])
    if p[GAS] != 0.0:
        volume = max(1.0 + z / p[GAS_LENGTH], 0.05)
        change = (z - z0) / p[GAS_LENGTH] / volume
        warm = (s[GAS_T] + dt / p[GAS_TIME]) / (1.0 + (p[GAS_N] - 1.0) * change + dt / p[GAS_TIME])
        f -= p[GAS] * warm / volume
        if settle:
            s[GAS_T] = warm
    if p[POWER] > 0.0:
        for j in range(BRANCHES):
            stiffness, tau = branch(p, j)
            new = (s[LADDER + j] + stiffness * (z - z0)) / (1.0 + dt / tau)
            f += new
            if settle:
                s[LADDER + j] = new
    if p[COG] != 0.0:
        f += p[COG] * np.sin(2.0 * np.pi * z / p[COG_PITCH])
    return f


@inner
def effective_current(p, s, i, dt):
    """Current that acts, after the coil's lag (other on rise than on fall), its saturation and its remanence."""
    u = i
    if p[COIL_RISE] > 0.0:
        tau = p[COIL_RISE] if u > s[COIL] else p[COIL_FALL]
        u += (s[COIL] - u) * exp(-dt / tau)
        s[COIL] = u
    u = laws.magnetised(u, p[COIL_SAT])
    if p[COIL_PLAY] > 0.0:
        half = 0.5 * p[COIL_PLAY]
        s[PLAYED] = min(u + half, max(u - half, s[PLAYED]))
        u = s[PLAYED]
    return u


@inner
def kicked(p, s, i, dt):
    """Force of a current that changes: a spike that dies away."""
    s[KICKED] = s[KICKED] * exp(-dt / p[KICK_TIME]) + p[KICK] * (i - s[LAST])
    s[LAST] = i
    return s[KICKED]


@inner
def in_series(p, e, de):
    """Force of bush and joint at the stretch e and its rate: hardens with stretch, nothing within the play."""
    k = p[BUSH] if p[BUSH] > 0.0 else JOINT_N_M
    loss = p[BUSH_LOSS] if p[BUSH] > 0.0 else 1e-4 * JOINT_N_M
    half = 0.5 * p[PLAY]
    if half > 0.0:
        width = 0.08 * half
        a, b = laws.opened(e - half, width), laws.opened(-e - half, width)
        share = min((a + b) / (a + b + 4.0 * width), 1.0)
        return k * (a - b) + loss * share * de
    return k * e + loss * de


@inner
def balance(p, s, z, w, w1, x1, v1, drive, held, u, temperature, dt):
    """Force of the core minus what drives it, if its speed at the end of the step were w1."""
    z1 = z + 0.5 * dt * (w + w1)
    f = core_force(p, s, z, z1, w1, u, temperature, dt, False)
    if np.isnan(drive):
        return f - in_series(p, x1 - z1, v1 - w1)
    return 0.5 * (f + held) + p[MASS] * (w1 - w) / dt - drive


@inner
def speed_of_core(p, s, z, w, guess, x1, v1, drive, held, u, temperature, dt):
    """Root of `balance` over w1: a step by the last slope, a bracket, then regula falsi with the Illinois rule."""
    s[LEVEL] = max(s[LEVEL], abs(held))
    low, high, g_low, g_high = np.nan, np.nan, np.nan, np.nan
    trial, root, g_before, side, reach = guess, guess, 0.0, 0, 0.0
    for step in range(BALANCE_STEPS):
        before, root = root, trial
        g = balance(p, s, z, w, root, x1, v1, drive, held, u, temperature, dt)
        if step == 1 and root != before:
            s[SLOPE] = max((g - g_before) / (root - before), 1e-6 * s[SLOPE])
        if abs(g) <= BALANCED * (s[LEVEL] + 1e-9):
            break
        if g > 0.0:
            g_low, side = (0.5 * g_low, 1) if side == 1 else (g_low, 1)
            high, g_high = root, g
        else:
            g_high, side = (0.5 * g_high, -1) if side == -1 else (g_high, -1)
            low, g_low = root, g
        if np.isnan(g_low) or np.isnan(g_high):
            reach = 3.0 * reach if step else max(1.2 * abs(g) / s[SLOPE], 1e-9)
            trial = root - reach if g > 0.0 else root + reach
        elif high - low <= 1e-10 + 1e-9 * abs(root):
            break
        else:
            trial = (low * g_high - high * g_low) / (g_high - g_low)
        g_before = g
    return root


@inner
def started(p, z, i):
    """States of a machine at rest at z with the current i."""
    s = np.zeros(STATES)
    s[GAS_T] = 1.0
    s[COIL] = s[LAST] = i
    s[PLAYED] = laws.magnetised(i, p[COIL_SAT])
    s[SLOPE] = 1.0
    return s


@inner
def warmed(p, x):
    """Temperature of a gas at the first instant of a motion that has lasted, over that around it."""
    before = 0.0
    for z in x:
        before += max(1.0 + z / p[GAS_LENGTH], 0.05) ** (p[GAS_N] - 1.0) / x.size
    return before * max(1.0 + x[0] / p[GAS_LENGTH], 0.05) ** (1.0 - p[GAS_N])


@compiled
def moved(p, x, v, a, current, temperature, fine, dt, lasted):
    """Force at every fine instant of a machine whose end is moved, N; current and temperature held over a sample.

    lasted : whether it has long moved when it begins, or was at rest.
    """
    late = round(p[DELAY] / dt)
    s = started(p, x[0], current[0])
    if lasted and p[GAS] != 0.0:
        s[GAS_T] = warmed(p, x)
    mounted = p[BUSH] > 0.0 or p[PLAY] > 0.0
    force = np.empty(x.size)
    z, w, before, f = x[0], v[0], v[0], 0.0
    for n in range(x.size):
        i = current[max(n - late, 0) // fine]
        u = effective_current(p, s, i, dt)
        warm = temperature[n // fine]
        z0 = z
        if mounted and n > 0:
            w1 = speed_of_core(p, s, z, w, 2.0 * w - before, x[n], v[n], np.nan, f, u, warm, dt)
            z += 0.5 * dt * (w + w1)
            before, w = w, w1
        else:
            z, w = x[n], v[n]
        f = core_force(p, s, z0, z, w, u, warm, dt, True)
        force[n] = f + p[MASS] * a[n]
        if p[KICK] != 0.0:
            force[n] += kicked(p, s, i, dt)
    return force


@compiled
def driven(p, drive, temperature, fine, dt):
    """Displacement, speed and acceleration of a mass that a force drives from rest."""
    s = started(p, 0.0, 0.0)
    x, v, a = np.zeros(drive.size), np.zeros(drive.size), np.zeros(drive.size)
    z, w, before, f = 0.0, 0.0, 0.0, 0.0
    for n in range(1, drive.size):
        warm = temperature[n // fine]
        push = 0.5 * (drive[n] + drive[n - 1])
        w1 = speed_of_core(p, s, z, w, 2.0 * w - before, 0.0, 0.0, push, f, 0.0, warm, dt)
        z0, z = z, z + 0.5 * dt * (w + w1)
        before, w = w, w1
        f = core_force(p, s, z0, z, w, 0.0, warm, dt, True)
        x[n], v[n], a[n] = z, w, (drive[n] - f) / p[MASS]
    return x, v, a


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """What a machine is put through, on the fine grid; current and temperature on samples of the record."""

    x: Row  # m
    v: Row  # m/s
    a: Row  # m/s²
    current: Row  # A
    temperature: Row  # °C
    fine: int  # steps a sample
    rate_hz: float  # of the record
    lead: int  # samples before the record begins

    @property
    def dt(self) -> float:
        """The fine step, s."""
        return 1.0 / (self.rate_hz * self.fine)


def force_of(values: Values, motion: Motion) -> Row:
    """Force between machine and load cell on the fine grid, N."""
    m = motion
    result: Row = moved(vector(values), m.x, m.v, m.a, m.current, m.temperature, m.fine, m.dt, m.lead > 0)
    return result


def motion_under(values: Values, drive: Row, motion: Motion) -> Motion:
    """The motion of a mass from rest under a force on the fine grid, N."""
    x, v, a = driven(vector(values), drive, motion.temperature, motion.fine, motion.dt)
    return Motion(
        x=x, v=v, a=a, current=motion.current, temperature=motion.temperature, fine=motion.fine,
        rate_hz=motion.rate_hz, lead=motion.lead,
    )  # fmt: skip
