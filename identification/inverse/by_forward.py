"""The inversion of a forward model of any kind: held currents first, then corrections by its own simulation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.layered import LayeredNarx
from identification.blackbox.model import BlackBox
from identification.blackbox.polynomial import PolynomialNarx
from identification.inverse.by_network import by_network
from identification.inverse.reach import Limits, Reach, check_reached, reach_of
from identification.inverse.wanted import Wanted
from identification.models.protocol import SimulationModel

Floats = NDArray[np.float64]

# Error of the force, as a share of its size, that is taken for a change of the current over its whole range from one
# sample to the next. Half: the current jumps more where it matters little; double: it follows steps later by a sample.
_STILL = 0.01
_MOST = 40  # corrections; each is one simulation
_ENOUGH = 1e-3  # of the size of the force: a smaller error ends them
_QUIET = 4  # corrections in a row that make the error no smaller


def by_forward(forward: SimulationModel, wanted: Wanted, limits: Limits) -> Floats:
    """The current (N,), A, within the limits, with which a forward model gives the wanted force as nearly as it can.

    The force of sample t at a current that was always held, F(t; c), is known from one simulation of each level. Its
    root is sought sample by sample. Then the model is simulated along the current that was found, with all that it
    remembers of it, and the wanted force of each sample is corrected by what is missing; the root is sought again, and
    so on (iterative learning control, Arimoto, Kawamura and Miyazaki 1984, with F(t; c) in place of a learning gain).
    A model whose force depends on the present current alone is met at once; one with memory after some corrections.
    The current of a sample depends on motion and wanted force up to that sample alone. A network answers a current over
    several samples, with which these corrections do not converge: it is inverted by `by_network`.

    Raises
    ------
    DataError
        one line, as `reach_of` does, and where no sample of the wanted force can be made.
    SimulationError
        as the model does.
    """
    told = told_apart(forward, limits)
    reach = reach_of(forward, wanted, told)
    check_reached(reach, wanted, limits)
    return inverted(forward, wanted, told, reach)


def inverted(forward: SimulationModel, wanted: Wanted, limits: Limits, reach: Reach) -> Floats:
    """The same within a reach that is known. A network is followed from sample to sample, see `by_network`."""
    if isinstance(forward, BlackBox):
        return by_network(forward, wanted, limits, (_STILL * reach.size / limits.span) ** 2)
    can = ~reach.cannot(wanted.force)
    current = _searched(reach, wanted.force, limits)
    best, least, gain, quiet = current, np.inf, 1.0, 0
    sought = wanted.force
    for _ in range(_MOST):
        given = forward.force(wanted.driven(current))
        error = float(np.sqrt(np.mean((wanted.force - given)[can] ** 2)))
        if error < least * (1.0 - 1e-3):
            best, least, quiet = current, error, 0
        else:
            quiet, gain = quiet + 1, 0.5 * gain
        if quiet >= _QUIET or least < _ENOUGH * reach.size:
            break
        missing = wanted.force - given
        # Beyond the reach nothing is gained, and a correction that grew without end would be felt long after.
        sought = np.where(can, reach.at(current) + gain * missing, wanted.force)
        current = _searched(reach, sought, limits)
    return best


def told_apart(forward: SimulationModel, limits: Limits) -> Limits:
    """The part of some limits within which a model tells currents apart: beyond, a black box sees its edge.

    The levels of a reach lie closer there, and nothing is lost. Where the limits lie beyond, they are as they were.
    """
    known = forward.scales.get("current") if isinstance(forward, BlackBox | LayeredNarx | PolynomialNarx) else None
    if known is None:
        return limits
    low, high = known.told_apart
    low, high = max(low, limits.low), min(high, limits.high)
    return Limits(low, high) if low < high else limits


def _searched(reach: Reach, wanted: Floats, limits: Limits) -> Floats:
    from identification.inverse.search import nearest  # compiled where it is used

    current = np.full(wanted.size, limits.low)
    nearest(reach.forces, reach.levels, wanted, (_STILL * reach.size / limits.span) ** 2, current)
    return current
