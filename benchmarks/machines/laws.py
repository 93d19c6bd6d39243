"""Force laws of real machines, compiled: flows, pressures, rubbing surfaces, gas, rubber, magnets.

None of them is a curve of the catalogue. Extension and tension are positive.
"""

from __future__ import annotations

from math import exp, log1p, sqrt

import numba


def compiled(function):  # type: ignore[no-untyped-def]
    """Compile without Python objects, cached, with IEEE division."""
    return numba.njit(cache=True, error_model="numpy")(function)


def inner(function):  # type: ignore[no-untyped-def]
    """The same for what only compiled functions call: without the wrappers that Python would need."""
    return numba.njit(cache=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)(function)


@inner
def opened(excess, width):
    """A passage that opens beyond zero, with a soft beginning: 0 … excess; the same unit as `width`."""
    if width <= 0.0:
        return max(excess, 0.0)
    r = excess / width
    if r > 30.0:
        return excess
    return width * log1p(exp(r)) if r > -30.0 else 0.0


@inner
def gap_flow(p, laminar, port):
    """Flow through a laminar gap with a turbulent port in series, p = Q/laminar + (Q/port)²; p ≥ 0."""
    if port <= 0.0:
        return laminar * p
    b = port * port / laminar
    return 0.5 * (sqrt(b * b + 4.0 * port * port * p) - b)


@inner
def valve_flow(p, laminar, port, shim_at, shim, blow_at, blow, rounding):
    """Flow of bleed, shim stack and blow-off side by side under a pressure p ≥ 0, m³/s."""
    q = gap_flow(p, laminar, port)
    if shim > 0.0:
        q += shim * (opened(p - shim_at, rounding * shim_at) - opened(-shim_at, rounding * shim_at))
    if blow > 0.0:
        q += blow * (opened(p - blow_at, 0.05 * blow_at) - opened(-blow_at, 0.05 * blow_at))
    return q


@inner
def spool(u, firm, at, width):
    """Resistance of a controlled valve, relative to that without current: rises by `firm` over a rounded ramp."""
    if firm == 0.0:
        return 1.0
    r = (u - at) / width
    return 1.0 + firm * 0.5 * (1.0 + r / sqrt(1.0 + r * r))


@inner
def rubbing(level, rise, speed, bias, w):
    """Sliding force of a seal: more at rest (a resonance curve over speed), and different for both directions."""
    side = 1.0 + bias if w > 0.0 else 1.0 - bias
    r = w / speed
    return level * side * (1.0 + rise / (1.0 + r * r))


@inner
def stick(state, dz, travel):
    """A spring that yields at ±1 after `travel`, moved on by dz."""
    return min(1.0, max(-1.0, state + dz / travel))


@inner
def progressive(z, rise, length):
    """Rubber that stiffens: rise·length·(sinh r − r), r = z/length within ±6, N."""
    r = min(6.0, max(-6.0, z / length))
    return rise * length * (0.5 * (exp(r) - exp(-r)) - r)


@inner
def bumper(depth, k, length):
    """A buffer pressed in by `depth`: k·depth·(1 + depth/length), N."""
    return k * depth * (1.0 + depth / length) if depth > 0.0 else 0.0


@inner
def groove(z, gain, length):
    """Losses grow away from the groove: 1 + gain·r²/(1 + r²/4), r = z/length."""
    r = z / length
    return 1.0 + gain * r * r / (1.0 + 0.25 * r * r)


@inner
def thinner(temperature, gain):
    """Viscosity relative to that at 25 °C: (1 + gain·ΔT/2)⁻², as oils between 0 and 90 °C."""
    r = max(1.0 + 0.5 * gain * (temperature - 25.0), 0.2)
    return 1.0 / (r * r)


@inner
def magnetised(u, saturation):
    """Flux of a coil whose iron saturates, in amperes of the linear coil: u/(1 + (|u|/i_s)^1.6)^(1/1.6)."""
    if saturation <= 0.0:
        return u
    return u / (1.0 + (abs(u) / saturation) ** 1.6) ** (1.0 / 1.6)


@inner
def yielding(w, speed):
    """Share of the yield force at a speed: r/√(1 + r²)."""
    r = w / speed
    return r / sqrt(1.0 + r * r)
