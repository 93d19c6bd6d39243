"""What an effect is that a given model lacks, and the machine that its size refers to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

Values = dict[str, float]
Names = tuple[str, ...]
Rng = np.random.Generator


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """The machine without effects in the motions of the case: largest values, and the rms of its force."""

    force_n: float
    peak_n: float
    stroke_m: float
    speed_m_s: float
    current_a: float
    seconds: float
    rate_hz: float
    fastest_hz: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Something that the given model lacks: how it changes machine and chain, and the names that may be right.

    The first `sure` sets of names are what it is. The others are right where the runs can't tell. No set: it is outside
    the catalogue.
    """

    title: str
    names: tuple[Names, ...]
    draw: Callable[[Rng, Scale, Mapping[str, float]], Values]
    share: tuple[float, float, str]  # least and largest size, and of what
    needs_steps: bool = False  # of the current
    needs_warmth: bool = False  # temperatures far apart
    excludes: frozenset[str] = field(default_factory=frozenset)
    weight: float = 1.0  # how often it occurs
    least_rate_hz: float = 0.0  # of a record that can show it
    sure: int = 1  # trapped gas has a name by its cause, and one by what it does to a force


def usual(effect: Effect) -> Effect:
    """The effect, twice as often as others."""
    return replace(effect, weight=2.0)
