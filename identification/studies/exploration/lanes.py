"""The time loop of the enriched Maxwell model for many parameter sets at once, a set in each lane.

f = k1·e + y = F1·(2/π)·arctan(S·w) + d·w + F2, de/dt = v − w, dy/dt = k2·(v − w) − (k2/c2)·y, with e the extension of
the spring k1, y the force of the branch k2–c2 and w the velocity of the dashpot.

A step is SDIRK of order 3, three stages, L-stable and stiffly accurate (Alexander 1977). In every stage e and y are
eliminated: F1·(2/π)·arctan(u) + c·u = r with u = S·w, one monotone equation, solved by Halley's method from the
extrapolated last steps. A step whose force differs from that of the embedded method of order 2 by more than `ROUGH` is
repeated in four, up to three times: at the reversals of a stiff dashpot. That happens in all lanes of a group together,
so a group's answer depends on the group alone, wherever it runs. All numbers of a lane stand in one array, LANES apart:
nothing else lets the compiler put the lanes side by side into the processor's registers.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.compiled import inlined, summing

LANES = 16
"""Parameter sets at once: two registers of the widest processors; half or double is slower, the answer is as exact."""

ROUGH = 5e-5
"""Share of the dashpot's force at peak speed by which a step and the embedded method may differ, some 1e-6 of rms force
in the answer. Half: up to five times the time; double: 2e-6 at the sharpest reversals."""

_LEVELS = 4  # of refinement: 1, 4, 16 and 64 steps for a sample
_TOLERANCE = 1e-5  # last change of u over 1 + u; Halley's method cubes it
_CUBIC = 6  # iterations of Halley's method; after them Newton's, which never leaves the monotone side
_MOST = 60

_G = 0.435866521508458999416  # γ, the diagonal of the method
_A21 = 0.5 * (1.0 - _G)
_B1 = -0.25 * (6.0 * _G * _G - 16.0 * _G + 1.0)
_B2 = 0.25 * (6.0 * _G * _G - 20.0 * _G + 5.0)
_D2 = _B2 - (0.5 - _G) / (0.5 - 0.5 * _G)  # the weights less those of the embedded method, which leaves the third out
_D1 = -_G - _D2
_D3 = _G
_MIDDLE = 0.5 * (1.0 + _G)  # the node of the second stage

# Places of the rows in the array, in units of LANES. First what the caller fills in:
F1, F2, D, S, K1, K2, RATE = 0, 1, 2, 3, 4, 5, 6  # F1·2/π, F2, d, S, k1, k2, k2/c2
E, Y, U = 7, 8, 9  # the state; U + s is that of stage s, U + 2 that at the end of the last step
_LAST = 12  # u of the stages a step before
_KEPT = 15  # E, Y and U at the begin of a step
_EXT, _BRANCH, _SIDE, _NEW = 20, 21, 22, 23  # of the stage in work: e and y without its own rate, r, u
_FLOW, _RISE = 24, 26  # rates of e and y of the first two stages
_FADE, _STIFF, _SLOPE = 28, 32, 36  # constants of each level: 1/(1 + hγ·k2/c2), K, c
_APART, SCALE = 40, 41
ROWS = 42


@inlined
def _arctan(u):
    """arctan of a u that is not negative, to rounding (Cephes, Moshier 1989)."""
    large, middle = u > 2.41421356237309504880, u > 0.66
    over = -1.0 if large else (u - 1.0 if middle else u)
    under = u if large else (u + 1.0 if middle else 1.0)
    whole = 1.57079632679489661923 if large else (0.78539816339744830962 if middle else 0.0)
    x = over / under
    z = x * x
    p = ((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z - 7.500855792314704667340e1) * z
    p = (p - 1.228866684490136173410e2) * z - 6.485021904942025371773e1
    q = ((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z + 4.328810604912902668951e2
    q = (q * z + 4.853903996359136964868e2) * z + 1.945506571482613964425e2
    return whole + (x + x * z * p / q)


@inlined
def _constants(work, level, h):
    hg = h * _G
    for i in range(LANES):
        fade = 1.0 / (1.0 + hg * work[RATE * LANES + i])
        stiff = hg * (work[K1 * LANES + i] + work[K2 * LANES + i] * fade)
        work[(_FADE + level) * LANES + i] = fade
        work[(_STIFF + level) * LANES + i] = stiff
        work[(_SLOPE + level) * LANES + i] = (work[D * LANES + i] + stiff) / work[S * LANES + i]


@inlined
def _begin_stage(work, s, level, h, v, ahead):
    """The right side of the equation of stage s, and the first guess of its u; `ahead` is 1 to extrapolate."""
    a1 = 0.0 if s == 0 else (_A21 * h if s == 1 else _B1 * h)
    a2 = _B2 * h if s == 2 else 0.0
    fade, stiff = (_FADE + level) * LANES, (_STIFF + level) * LANES
    for i in range(LANES):
        e = work[E * LANES + i] + a1 * work[_FLOW * LANES + i] + a2 * work[(_FLOW + 1) * LANES + i]
        y = work[Y * LANES + i] + a1 * work[_RISE * LANES + i] + a2 * work[(_RISE + 1) * LANES + i]
        work[_EXT * LANES + i] = e
        work[_BRANCH * LANES + i] = y
        work[_SIDE * LANES + i] = (
            work[K1 * LANES + i] * e + y * work[fade + i] + work[stiff + i] * v - work[F2 * LANES + i]
        )
        last = work[(U + s) * LANES + i]
        work[_NEW * LANES + i] = last + ahead * (last - work[(_LAST + s) * LANES + i])
        work[(_LAST + s) * LANES + i] = last


@inlined
def _solve(work, level):
    """Solves the equation of a stage for u in every lane."""
    slope = (_SLOPE + level) * LANES
    for k in range(_MOST):
        cubic, left = 1.0 if k < _CUBIC else 0.0, 0
        for i in range(LANES):
            r, f1, c = work[_SIDE * LANES + i], work[F1 * LANES + i], work[slope + i]
            u = work[_NEW * LANES + i]
            u = -u if r < 0.0 else u  # the root has the sign of r; for positive r all is concave
            u = u if u > 0.0 else 0.0
            bend = 1.0 / (1.0 + u * u)
            g = f1 * _arctan(u) + c * u - abs(r)
            g_u = f1 * bend + c
            change = g * g_u / (g_u * g_u + cubic * g * f1 * bend * bend * u)
            left += 1 if abs(change) > _TOLERANCE * (1.0 + u) else 0
            u -= change
            work[_NEW * LANES + i] = -u if r < 0.0 else u
        if left == 0:
            break


@inlined
def _end_stage(work, s, level, h, v):
    hg, fade = h * _G, (_FADE + level) * LANES
    for i in range(LANES):
        u = work[_NEW * LANES + i]
        work[(U + s) * LANES + i] = u
        flow = v - u / work[S * LANES + i]
        y = (work[_BRANCH * LANES + i] + hg * work[K2 * LANES + i] * flow) * work[fade + i]
        if s == 2:
            work[E * LANES + i] = work[_EXT * LANES + i] + hg * flow
            work[Y * LANES + i] = y
            work[_APART * LANES + i] = _D1 * work[_FLOW * LANES + i] + _D2 * work[(_FLOW + 1) * LANES + i] + _D3 * flow
        else:
            work[(_FLOW + s) * LANES + i] = flow
            work[(_RISE + s) * LANES + i] = work[K2 * LANES + i] * flow - work[RATE * LANES + i] * y


@inlined
def _rough(work, level, h):
    """In how many lanes the force at the end of a step is not exact enough, by the embedded method of order 2."""
    count, slope, stiff = 0, (_SLOPE + level) * LANES, (_STIFF + level) * LANES
    for i in range(LANES):
        u = work[(U + 2) * LANES + i]
        g_u = work[F1 * LANES + i] / (1.0 + u * u) + work[slope + i]
        passed = 1.0 - work[stiff + i] / (work[S * LANES + i] * g_u)  # the dashpot yields to an error of the springs
        error = passed * h * abs(work[_APART * LANES + i]) * (work[K1 * LANES + i] + work[K2 * LANES + i])
        count += 1 if error > ROUGH * work[SCALE * LANES + i] else 0
    return count


@inlined
def _steps(work, level, count, h, slope, v0, v1, last):
    """One sample interval in `count` steps of h; whether a turn needs finer ones. `last`: there are none."""
    ahead = 1.0 if level == 0 else 0.0
    for k in range(count):
        for s in range(3):
            q = (k + (_G if s == 0 else (_MIDDLE if s == 1 else 1.0))) / count
            v = 6.0 * (q - q * q) * slope + (3.0 * q * q - 4.0 * q + 1.0) * v0 + (3.0 * q * q - 2.0 * q) * v1
            _begin_stage(work, s, level, h, v, ahead)
            _solve(work, level)
            _end_stage(work, s, level, h, v)
        if not last and _rough(work, level, h) > 0:
            return True
    return False


@inlined
def _copy(work, source, target):
    for k in range(5 * LANES):
        work[target * LANES + k] = work[source * LANES + k]


@summing
def cycle(x, v, dt, work, force):
    """Carries the state over one cycle of samples, which repeat.

    x, v : (N,) float64, m and m/s, of the cycle; between samples the displacement is cubic. dt : s
    work : (ROWS·LANES,) float64, the parameters and the state in its first rows
    force : (N, LANES) float64, N, is filled; its row n is the force at sample n + 1, the last that of sample 0 again
    """
    for level in range(_LEVELS):
        _constants(work, level, dt / 4.0**level)
    for n in range(x.size):
        m = n + 1 if n + 1 < x.size else 0
        slope = (x[m] - x[n]) / dt
        _copy(work, E, _KEPT)
        for level in range(_LEVELS):
            if not _steps(work, level, 4**level, dt / 4.0**level, slope, v[n], v[m], level + 1 == _LEVELS):
                break
            _copy(work, _KEPT, E)
        for i in range(LANES):
            force[n, i] = work[K1 * LANES + i] * work[E * LANES + i] + work[Y * LANES + i]
