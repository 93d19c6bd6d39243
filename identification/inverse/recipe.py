"""What a learned inverse tries by default."""

from __future__ import annotations

from typing import Final

from identification.blackbox.recipes import NODES, Recipe
from identification.blackbox.structure import Regressor, regressors
from identification.blackbox.training import FULL, QUICK

_PLACES: Final = {"F": "i", "i": "F"}


def swapped(name: str) -> str:
    """The name of a regressor with force and current in each other's place: `F0` is `i0` to the network.

    >>> swapped("F0"), swapped("i2"), swapped("v1")
    ('i0', 'F2', 'v1')
    """
    return _PLACES.get(name[:1], name[:1]) + name[1:]


def inverse_regressors(text: str) -> tuple[Regressor, ...]:
    """Regressors of an inverse as the network has them, from names such as `F0 F1 v0 v1 i1`; raises ModelError."""
    return regressors([swapped(name) for name in text.split()])


# The wanted force at present, beside the motion; and with the past of both, and of the current itself, as Lin et al.
# do (2020, eq. 11, delay 2).
_SETS = (
    "F0 x0 v0 a0",
    "F0 F1 F2 x0 v0 v1 v2",
    "F0 F1 F2 F3 x0 v0 v1 v2 v3 a0",
    "i1 i2 F0 F1 F2 v0 v1 v2",
)

RECIPE: Final = Recipe(
    regressors=tuple(" ".join(map(swapped, text.split())) for text in _SETS),
    nodes=NODES,
    decays=(0.02, 0.2),
    quick=QUICK,
    full=FULL,
    best=3,
    starts=2,
)
