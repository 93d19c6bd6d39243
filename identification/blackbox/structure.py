"""What a recurrent network sees: delayed signals in, delayed force back; and how many nodes it has."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

from identification.blackbox.stops import LIMITS
from identification.errors import ModelError

FORCE, MODEL = "force", "model"
SYMBOLS: Mapping[str, str] = {
    "F": FORCE,
    "x": "displacement",
    "v": "velocity",
    "a": "acceleration",
    "i": "current",
    "T": "temperature",
    "M": MODEL,
    **dict.fromkeys(LIMITS, "displacement"),
}
"""The symbol of every signal in the name of a regressor.

M is the force of the model that a hybrid builds on; P, Q, R and S are stop operators of the displacement.
"""

LANES = 4  # nodes that are computed at once: the loops take a multiple
MOST_NODES = 64
LONGEST_DELAY = 256  # samples
_NAMED = re.compile(rf"([{''.join(SYMBOLS)}])([0-9]{{1,3}})")


@dataclass(frozen=True, slots=True, order=True)
class Regressor:
    """A signal some samples ago: `F1` is the last force, `v0` the present velocity."""

    symbol: str
    delay: int

    def __post_init__(self) -> None:
        if self.symbol not in SYMBOLS:
            raise ModelError(f"regressor of {self.symbol!r}: the signals are {', '.join(SYMBOLS)}")
        least = 1 if self.symbol == "F" else 0
        if not least <= self.delay <= LONGEST_DELAY:
            raise ModelError(f"regressor {self} is {self.delay} samples old: it must be {least} … {LONGEST_DELAY}")

    def __str__(self) -> str:
        return f"{self.symbol}{self.delay}"

    @property
    def signal(self) -> str:
        """The channel, or `force`."""
        return SYMBOLS[self.symbol]


@dataclass(frozen=True, slots=True)
class Structure:
    """The regressors, those of the force first, and the number of nodes of the hidden layer; 0: a linear model."""

    regressors: tuple[Regressor, ...]
    nodes: int

    def __post_init__(self) -> None:
        order = {symbol: k for k, symbol in enumerate(SYMBOLS)}
        ordered = sorted(self.regressors, key=lambda one: (order[one.symbol], one.delay))
        object.__setattr__(self, "regressors", tuple(ordered))
        if not ordered:
            raise ModelError("regressors is empty: a model needs at least one")
        for one, other in pairwise(ordered):
            if one == other:
                raise ModelError(f"regressor {one} is given twice: leave one out")
        if not 0 <= self.nodes <= MOST_NODES:
            raise ModelError(f"nodes is {self.nodes}: it must lie within 0 … {MOST_NODES}")

    def __str__(self) -> str:
        return f"{' '.join(map(str, self.regressors))}, {self.nodes} nodes"

    @property
    def fed_back(self) -> tuple[int, ...]:
        """Delays of the force, samples."""
        return tuple(one.delay for one in self.regressors if one.signal == FORCE)

    @property
    def inputs(self) -> tuple[Regressor, ...]:
        """The regressors that are not the force."""
        return tuple(one for one in self.regressors if one.signal != FORCE)

    @property
    def signals(self) -> tuple[str, ...]:
        """The signals that drive it, each once."""
        return tuple(dict.fromkeys(one.signal for one in self.inputs))

    @property
    def longest(self) -> int:
        """The longest delay, samples."""
        return max(one.delay for one in self.regressors)

    @property
    def lanes(self) -> int:
        """Nodes that the loops compute: those beyond `nodes` have no weight, and no gradient."""
        return -(-self.nodes // LANES) * LANES

    @property
    def weights(self) -> int:
        """Number of weights in use."""
        width = len(self.regressors) + 1
        return self.nodes * (width + 1) + width

    @property
    def size(self) -> int:
        """Length of the vector of weights as the loops take it."""
        width = len(self.regressors) + 1
        return self.lanes * (width + 1) + width

    def with_regressor(self, new: Regressor) -> Structure:
        """The structure with one more regressor."""
        return Structure((*self.regressors, new), self.nodes)

    def without(self, old: Regressor) -> Structure:
        """The structure without one of its regressors."""
        return Structure(tuple(one for one in self.regressors if one != old), self.nodes)


def regressors(text: str | Iterable[str]) -> tuple[Regressor, ...]:
    """Regressors from names: `F1 F2 v0 v1 x0`; raises ModelError for what is none."""
    found = []
    for name in text.split() if isinstance(text, str) else text:
        match = _NAMED.fullmatch(name)
        if match is None:
            raise ModelError(f"regressor {name!r:.60}: write a signal of {', '.join(SYMBOLS)} and a delay, such as v1")
        found.append(Regressor(match[1], int(match[2])))
    return tuple(found)
