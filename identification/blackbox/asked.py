"""The structures of a black box that a user asks for."""

from __future__ import annotations

from collections.abc import Sequence

from identification.blackbox.given import KINDS, check_layered
from identification.blackbox.layers import Layers
from identification.blackbox.recipes import NODES, RECIPES
from identification.blackbox.search import LONGEST, SHORTLIST, Offer
from identification.blackbox.structure import Structure, regressors
from identification.errors import DataError


def structures_asked(kind: str, given: Sequence[str], nodes: int | None, *, searched: bool = False) -> list[Structure]:
    """The structures that the texts state, such as ``F1 v0 v1``; none: those that the kind tries.

    `searched`: a search finds the regressors.

    Raises
    ------
    DataError
        Where the kind does not exist or has no nodes to state, or nodes are stated without regressors.
    """
    if kind in ("inverse", "multiaxis"):
        raise DataError(f"kind is '{kind}': identify it with 'damper-rig identify {kind}' or identification.{kind}")
    if kind not in KINDS:
        raise DataError(f"kind is '{kind}': use {', '.join(KINDS)}, inverse or multiaxis")
    if nodes is not None and not given and not searched:
        raise DataError(
            "nodes are stated without regressors, and none are searched: they are those of the hidden layer"
        )
    if nodes is not None and kind in ("arx", "polynomial"):
        raise DataError(f"{nodes} nodes are stated: {kind} is a kind without nodes, leave them out")
    if kind not in RECIPES:
        return [Structure(regressors(text), 0) for text in given]
    count = RECIPES[kind].nodes if nodes is None else nodes
    return [Structure(regressors(text), count) for text in given]


def layers_asked(
    kind: str, text: str | None, activation: str | None, *, evolved: bool, nodes: int | None, searched: bool = False
) -> Layers | None:
    """The layers that a user states, such as ``14,8``; None: those of the kind.

    Raises
    ------
    DataError
        Where the kind has none to state, an activation and an evolution are both asked for, or they go with a search.
    ModelError
        Where there can be no such layers, or no such activation.
    """
    if text is None and activation is None and not evolved:
        return None
    check_layered(kind)
    if nodes is not None:
        raise DataError("nodes and layers are stated: give layers only, such as 14, or 14,8 for two")
    if searched:
        raise DataError("layers, activations and an evolution do not go with a search: give regressors")
    if activation is not None and evolved:
        raise DataError("an activation and an evolution are asked for: the evolution chooses the activations")
    counts = (NODES,) if text is None else _counts(text)
    return Layers(counts) if activation is None else Layers(counts, activation)


def _counts(text: str) -> tuple[int, ...]:
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isascii() and part.isdecimal() and len(part) < 6 for part in parts):
        raise DataError(f"layers are {text!r:.60}: give the nodes of each hidden layer, such as 14, or 14,8 for two")
    return tuple(map(int, parts))


def offer_asked(*, nodes: int | None, longest: int | None, every: bool) -> Offer:
    """What a search may choose from; `every` structure is trained, or the most promising. Raises DataError."""
    return Offer(nodes=nodes, longest=LONGEST if longest is None else longest, shortlist=None if every else SHORTLIST)
