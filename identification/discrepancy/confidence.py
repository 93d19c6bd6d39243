"""What speaks for one name, in numbers without a unit."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Features:
    """What speaks for and against one name, as the search left it."""

    spread: float  # of its strengths from run to run, beyond noise; 1 is the common strength
    spread_but_one: float  # the same without the oddest run
    runs: int  # that know something of its strength
    left: float  # share of the base's gap energy that all names together leave
    left_beside: float  # share of what was missing without this name that is left with it
    margin: float  # to the best rival, in units of the form tolerance; a parameter more counts as one
    own_share: float  # of its signature: what no refit of the base could imitate
    beside_curve: bool  # it is a curve over velocity, and the base has one of its own
    whole_curve: bool  # it is a whole damping curve
    rewritten: float  # share of its force by which the base's own curves moved from the given ones
