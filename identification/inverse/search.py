"""The search of a current sample by sample, compiled."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.compiled import compiled


@compiled
def nearest(forces, levels, wanted, stiffness, current):
    """The current of each sample into `current` (N,), A, whose entry before the search is where it begins.

    Minimises (F(c) − F*)² + stiffness·(c − c₋)² over the range of the `levels` (K,), with F straight between them and
    c₋ the current of the sample before: where the force hardly depends on the current, that one is held. The minimum
    of each stretch is known in closed form; the lowest of all is exact.
    """
    before = current[0]
    step = levels[1] - levels[0]
    for t in range(wanted.size):
        best, least = before, -1.0
        for k in range(levels.size - 1):
            slope = (forces[k + 1, t] - forces[k, t]) / step
            # d/dc [(F_k + s(c − c_k) − F*)² + q(c − c₋)²] = 0
            c = levels[k] + (slope * (wanted[t] - forces[k, t]) + stiffness * (before - levels[k])) / (
                slope * slope + stiffness
            )
            c = min(max(c, levels[k]), levels[k + 1])
            off = forces[k, t] + slope * (c - levels[k]) - wanted[t]
            cost = off * off + stiffness * (c - before) * (c - before)
            if least < 0.0 or cost < least:
                best, least = c, cost
        current[t] = best
        before = best
