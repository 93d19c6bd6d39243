"""The damper, compiled: its state, and one fine step of it.

No equation of the catalogue is used here: each effect has its own, as real parts have. An effect whose
size is zero is absent. The core is solved implicitly for its velocity, so that stiff parts need no finer step.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim_rig.compiled import compiled, pasted
from sim_rig.parameters import ARCTAN, BILINEAR, VALVE, Damper

# Indices in the state vector.
Z, W, U, BODY, TRAVEL, SIGN, DAHL, LOOP, LEAK, CAVITY, MAXWELL, EXTENSION, PLAY_1, PLAY_2, PLAY_3 = range(15)
STUCK, PEAK, CURRENT_AT, FORCE_AT, TIME, FORCE, SLOPE = range(15, 22)
RINGS: Final = 32
RING: Final = 2048
STATE: Final = RINGS + 2 * RING


REFERENCE_DEGC: Final = 25.0
CONTACT: Final = 3e7
CONTACT_C: Final = 3e3
TOLERANCE: Final = 1e-3  # N


@pasted
def _soft(x: float, width: float) -> float:
    """max(0, x), rounded by a parabola within ± the given width; nothing at all before it."""
    return max(x, 0.0) if abs(x) >= width else 0.25 * (x + width) ** 2 / width


@compiled
def designed(p: Damper, z: float, w: float, u: float, peak: float) -> float:
    """Force of the valves and orifices that the specimen has by design, N."""
    force = 0.0
    if p.base == VALVE:
        q = min(max((u - p.u_soft) / (p.u_firm - p.u_soft), 0.0), 1.0)
        c = p.c_soft + (p.c_firm - p.c_soft) * q * (1.0 + 0.004 * (1.0 - q))
        force = c * w / (1.0 + abs(w / p.knee) ** 2.03) ** (1.0 / 2.03)
    elif p.base == ARCTAN:
        y = p.slope * w
        force = p.f1 * ((2.0 / math.pi) * 0.992 * math.atan(y) + 0.008 * y / (1.0 + abs(y))) + p.c * w
    elif p.base == BILINEAR:
        knee = p.f1 / p.c
        force = p.c2 * w + (p.c - p.c2) * math.copysign(min(abs(w), knee), w)
        force -= (p.c - p.c2) * math.copysign(0.02 * knee * math.exp(-abs(abs(w) - knee) / (0.05 * knee)), w)
    else:
        force = (p.c + p.c_control * u) * w
    if p.hysteresis != 0.0 or p.hysteresis_control != 0.0:
        turn = math.tanh(z / (0.0002 * p.scale_m))
        slope, shift = p.hysteresis_slope, p.hysteresis_shift + p.hysteresis_shift_control * u
        level = p.hysteresis + p.hysteresis_control * u
        if p.hysteresis_power != 0.0:  # the slope of the loop falls with the recent peak speed
            fast = max(peak, 0.05 * p.hysteresis_at)
            slope *= (fast / p.hysteresis_at) ** p.hysteresis_power
            level *= max(1.0 + p.hysteresis_rise * fast - p.hysteresis_fall * fast * fast, 0.2)
        force += level * math.tanh(slope * w + shift * turn)
    return force


@compiled
def friction(p: Damper, w: float) -> float:
    """Dry friction: regularised, and falling a little with speed, N."""
    near = 0.004 * p.scale_m_s
    side = math.tanh(w / near)
    fast = abs(w) / p.scale_m_s
    force = p.coulomb * side * (1.0 - 0.05 * fast / (1.0 + fast))
    if p.stribeck != 0.0:
        rise = p.stribeck_rise / (1.0 + (w / p.stribeck_speed) ** 2 * (1.0 + 0.3 * abs(w / p.stribeck_speed)))
        force += (p.stribeck + rise) * side
    return force


@compiled
def orifices(p: Damper, w: float, u: float) -> float:
    """Force of the hidden effects that depend on velocity only, N."""
    s = abs(w)
    force = (p.viscous + p.viscous_control * u) * w * (1.0 + 0.03 * s / (s + p.scale_m_s))
    if p.arctan_force != 0.0:
        y = p.arctan_slope * w
        force += p.arctan_force * (2.0 / math.pi) * math.atan(y) * (1.0 - 0.04 * math.exp(-abs(y)))
    if p.bilinear_c != 0.0:
        force += (
            p.bilinear_force * math.tanh((p.bilinear_c * w / p.bilinear_force) ** 3) ** (1.0 / 3.0) if w > 0 else 0.0
        )
        force -= (
            p.bilinear_force * math.tanh((-p.bilinear_c * w / p.bilinear_force) ** 3) ** (1.0 / 3.0) if w < 0 else 0.0
        )
    if p.valve_soft != 0.0 or p.valve_firm != 0.0:
        c = p.valve_soft + (p.valve_firm - p.valve_soft) * min(max(u, 0.0), 2.0)
        force += c * w / (1.0 + (s / p.valve_knee) ** 2.2) ** (1.0 / 2.2)
    if p.quadratic != 0.0:
        force += p.quadratic * math.copysign(s**1.92 * p.scale_m_s**0.08, w)
    if p.relief != 0.0:
        force -= p.relief * math.copysign(_soft(s - p.relief_knee, 0.12 * p.relief_knee), w)
    if p.asymmetry != 0.0:
        rounded = 0.02 * p.scale_m_s
        force += p.asymmetry * (math.sqrt(w * w + rounded * rounded) - rounded) * (1.0 - 0.03 * s / p.scale_m_s)
    return force


@compiled
def loops(p: Damper, s: NDArray[np.float64], n: NDArray[np.float64], z: float, w: float, h: float) -> float:
    """Force of the hidden effects with a state, N; their next states are written to `n`."""
    force = 0.0
    if p.tanh_force != 0.0:
        turn = math.tanh(z / (0.02 * p.scale_m))
        force += p.tanh_force * math.tanh(p.tanh_slope * w + p.tanh_shift * turn) * (1.0 + 0.02 * turn)
    if p.loop_force != 0.0:
        rate = w / p.loop_travel
        h_now = s[LOOP]
        grow = rate - 0.55 * abs(rate) * h_now * abs(h_now) ** 0.1 - 0.45 * rate * abs(h_now) ** 1.1
        n[LOOP] = min(max(h_now + h * grow, -1.5), 1.5)
        force += p.loop_force * n[LOOP]
    if p.presliding != 0.0:
        y = s[DAHL]
        toward = math.copysign(1.0, w) * y
        grow = w / p.presliding_travel * math.copysign(abs(1.0 - toward) ** 1.1, 1.0 - toward)
        n[DAHL] = min(max(y + h * grow, -1.0), 1.0)
        force += p.presliding * n[DAHL]
    if p.leak_stiffness != 0.0:
        n[LEAK] = (s[LEAK] + h * p.leak_stiffness * w) / (1.0 + h / p.leak_time)
        force += n[LEAK]
    if p.patch != 0.0:
        near = (z - p.patch_at) / p.patch_width
        force += p.patch * math.exp(-near * near) * math.tanh(w / (0.004 * p.scale_m_s))
    return force


@compiled
def springs(p: Damper, z: float, body_degc: float) -> float:
    """Force outside the dissipative sum, N."""
    x = z / p.scale_m
    force = p.preload + p.stiffness * z + p.linear * z * (1.0 - 0.03 * x * x / (1.0 + x * x))
    if p.cubic != 0.0:
        force += p.cubic * z * z * z / (1.0 + 0.02 * x * x)
    if p.gas != 0.0:
        volume = max(1.0 + z / p.gas_length, 0.05)
        force -= p.gas * volume ** (-p.gas_exponent) * (1.0 + (body_degc - REFERENCE_DEGC) / 2000.0)
    if p.stop != 0.0:
        into = _soft(abs(z) - p.stop_at, 0.02 * p.stop_at)
        force += p.stop * math.copysign(into * (1.0 + 2.0 * into / p.stop_at), z)
    return force


@compiled
def modifier(
    p: Damper, s: NDArray[np.float64], n: NDArray[np.float64], z: float, w: float, u: float, h: float
) -> float:
    """Factor on the dissipative sum: position, temperature, travel since the last reversal."""
    factor = 1.0
    if p.position != 0.0:
        x = z / p.scale_m
        factor *= 1.0 + p.position * z * z / (1.0 + 0.04 * x * x)
    if p.fade != 0.0:  # viscosity falls like Vogel's law, not like an exponential
        factor *= math.exp(p.fade * 95.0 * 120.0 * (1.0 / (s[BODY] + 95.0) - 1.0 / (REFERENCE_DEGC + 95.0)) * 1.0105)
    turned = w * s[SIGN] < 0.0
    travel = abs(w) * h if turned else s[TRAVEL] + abs(w) * h
    n[TRAVEL], n[SIGN] = travel, (math.copysign(1.0, w) if w != 0.0 else s[SIGN])
    if p.distortion != 0.0:
        factor *= 1.0 - math.exp(-travel / (p.distortion + p.distortion_control * max(u, 0.0)))
    if p.reversal != 0.0:
        factor *= 1.0 - math.exp(-((travel / p.reversal) ** 1.08))
    if p.cavitation != 0.0:
        grow = max(-w - p.cavitation_speed, 0.0) / p.cavitation_speed
        n[CAVITY] = (s[CAVITY] + h * grow / (0.2 * p.cavitation_time)) / (
            1.0 + h * (1.0 + grow / 0.2) / p.cavitation_time
        )
        factor *= 1.0 - p.cavitation * n[CAVITY]
    if p.amplitude != 0.0:
        factor *= 1.0 - p.amplitude * (n[PEAK] / (n[PEAK] + p.amplitude_speed) - 0.5)
    return factor


@compiled
def core(p: Damper, s: NDArray[np.float64], n: NDArray[np.float64], z: float, w: float, u: float, h: float) -> float:
    """Force of the damper's core at displacement z and velocity w, N."""
    peak = s[PEAK] * (
        1.0 - h / p.peak_time
    )  # of earlier steps: it must not depend on the velocity that is searched for
    if p.amplitude != 0.0 or p.hysteresis_power != 0.0:
        n[PEAK] = max(abs(w), peak)
    dissipative = designed(p, z, w, u, peak) + friction(p, w) + orifices(p, w, u) + loops(p, s, n, z, w, h)
    return dissipative * modifier(p, s, n, z, w, u, h) + springs(p, z, s[BODY])


@compiled
def mount(p: Damper, s: NDArray[np.float64], n: NDArray[np.float64], e: float, rate: float, h: float) -> float:
    """Force over the mount at extension e, N."""
    stiffness, c = (p.mount, p.mount_c) if p.mount != 0.0 else (CONTACT, CONTACT_C)
    touch, gap = e, 1.0
    if p.play != 0.0:
        into = _soft(abs(e) - 0.5 * p.play, 0.06 * p.play)
        touch = math.copysign(into, e)
        gap = into / (into + 0.03 * p.play)
    force = stiffness * touch + c * rate * gap
    if p.mount_branch != 0.0:
        n[MAXWELL] = (s[MAXWELL] + p.mount_branch * (e - s[EXTENSION])) / (1.0 + h * p.mount_branch / p.mount_branch_c)
        force += n[MAXWELL]
    n[EXTENSION] = e
    return force


@compiled
def _gap(
    p: Damper, s: NDArray[np.float64], n: NDArray[np.float64], x: float, v: float, w: float, u: float, h: float
) -> float:
    z = s[Z] + h * (0.45 * s[W] + 0.55 * w)  # near the trapezoidal rule, without ringing
    n[FORCE] = core(p, s, n, z, w, u, h)
    n[Z], n[W] = z, w
    surplus: float = n[FORCE] - mount(p, s, n, x - z, v - w, h)
    return surplus


@compiled
def solve(p: Damper, s: NDArray[np.float64], n: NDArray[np.float64], x: float, v: float, u: float, h: float) -> None:
    """Find the core velocity at which core and mount carry the same force: secant steps, then a bracket.

    The difference of core force and mount force rises with the velocity. The first slope is that of the last step.
    """
    least = 1e-8 * p.scale_m_s
    a = s[W]
    ga = _gap(p, s, n, x, v, a, u, h)
    step = -ga / s[SLOPE] if s[SLOPE] > 0.0 else -math.copysign(1e3 * least, ga)
    for _ in range(100):
        if abs(ga) <= TOLERANCE:
            return
        if abs(step) < least:  # a slope that is far too steep must not end the search
            step = -math.copysign(least, ga)
        b = a + step
        gb = _gap(p, s, n, x, v, b, u, h)
        slope = (gb - ga) / step
        if slope > 0.0:
            n[SLOPE] = slope
        if ga * gb < 0.0:
            _narrow(p, s, n, x, v, u, h, a, ga, b, gb)
            return
        reach = 20.0 * abs(step)
        a, ga = b, gb
        step = -math.copysign(min(abs(gb) / slope, reach) if slope > 0.0 else reach, gb)


@compiled
def _narrow(
    p: Damper,
    s: NDArray[np.float64],
    n: NDArray[np.float64],
    x: float,
    v: float,
    u: float,
    h: float,
    a: float,
    ga: float,
    b: float,
    gb: float,
) -> None:
    """Close a bracket: regula falsi in the Illinois form, until the forces agree or the bracket encloses a jump."""
    for _ in range(100):
        if abs(gb) <= TOLERANCE or abs(b - a) <= 1e-12 * p.scale_m_s:
            return
        m = b - gb * (b - a) / (gb - ga)
        gm = _gap(p, s, n, x, v, m, u, h)
        if gm * gb < 0.0:
            a, ga = b, gb
        else:
            ga *= 0.5
        b, gb = m, gm


@compiled
def control(p: Damper, s: NDArray[np.float64], current: float, h: float) -> float:
    """Effective current behind the amplifier, the coil and the valve, A."""
    u = current
    if p.lag != 0.0:
        tau = p.lag * (1.0 + 0.01 * math.copysign(1.0, current - s[U]))
        s[U] += (current - s[U]) * (1.0 - math.exp(-h / tau))
        u = s[U]
    if p.delay != 0.0:
        u = _delayed(s, RINGS, CURRENT_AT, u, p.delay, h)
    if p.saturation != 0.0:
        u = u / (1.0 + abs(u / p.saturation) ** 2.3) ** (1.0 / 2.3)
    if p.hysteresis_width != 0.0:
        s[PLAY_1] = min(max(s[PLAY_1], u - 0.43 * p.hysteresis_width), u + 0.43 * p.hysteresis_width)
        s[PLAY_2] = min(max(s[PLAY_2], u - 0.5 * p.hysteresis_width), u + 0.5 * p.hysteresis_width)
        s[PLAY_3] = min(max(s[PLAY_3], u - 0.57 * p.hysteresis_width), u + 0.57 * p.hysteresis_width)
        u = (s[PLAY_1] + s[PLAY_2] + s[PLAY_3]) / 3.0
    if p.backlash != 0.0:  # a spool that sticks, then jumps
        if abs(u - s[STUCK]) > p.backlash:
            s[STUCK] = u
        u = s[STUCK]
    return u


@compiled
def _delayed(s: NDArray[np.float64], ring: int, place: int, value: float, delay: float, h: float) -> float:
    """Value `delay` seconds ago from a ring buffer, linear between steps."""
    at = int(s[place])
    s[ring + at] = value
    back = delay / h
    whole = int(back)
    part = back - whole
    first, second = s[ring + (at - whole) % RING], s[ring + (at - whole - 1) % RING]
    s[place] = (at + 1) % RING
    value_then: float = first + part * (second - first)
    return value_then


@compiled
def step(
    p: Damper, s: NDArray[np.float64], n: NDArray[np.float64], x: float, v: float, a: float, current: float, h: float
) -> float:
    """Advance by h to rig displacement x, velocity v, acceleration a; return the force at the load cell, N."""
    u = control(p, s, current, h)
    n[:] = s[:RINGS]
    if p.mount == 0.0 and p.play == 0.0:
        n[FORCE] = core(p, s, n, x, v, u, h)
        n[Z], n[W] = x, v
    else:
        solve(p, s, n, x, v, u, h)
    s[:RINGS] = n
    s[BODY] += h / p.heat_capacity * (abs(s[FORCE] * s[W]) - p.cooling * (s[BODY] - p.ambient))
    s[TIME] += h
    force: float = s[FORCE]
    if p.force_delay != 0.0:
        force = _delayed(s, RINGS + RING, FORCE_AT, force, p.force_delay, h)
    t = s[TIME]
    force += p.offset + p.mass * a + p.drift * t * (1.0 - t / 6000.0)
    if p.hum != 0.0:
        phase = 2.0 * math.pi * p.hum_frequency * t
        force += p.hum * (math.sin(phase + 0.7) + 0.05 * math.sin(3.0 * phase))
    return force
