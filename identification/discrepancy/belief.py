"""Belief in a name before its rivals, from what speaks against it by itself."""

from __future__ import annotations

import numpy as np

from identification.discrepancy.confidence import Features

ONE_RUN = 0.7  # belief in a name that no second run can bear out
TWO_RUNS = 0.88  # or that only one other does
BESIDE_A_CURVE = 0.88  # in a curve over velocity beside the base's own: that one may be of another family instead
_SPREAD_LIMIT = 0.12  # a true effect has one strength: what differs more than this from run to run is another effect
_SPREAD_SCALE = 0.02
_BUT_ONE = 0.85  # belief in an effect that has one strength in all runs but one
_LEFT = (0.9, 0.40, 0.06)  # of the belief goes where this share of the gap is left, ± so much: it is not explained
_PART = (0.25, 0.08, 0.015)  # something else is there too, or instead
_POOR = (0.3, 0.25, 0.04)  # the same for the share of what was missing without the name: a better one may be there
_REWRITTEN = (1.0, 0.5, 0.05)  # or of its given force by which a base changed beside a curve: a third, half for luck


def belief(f: Features) -> float:
    """Belief in a name before its rivals, 0 … 1."""
    out = max(_steady(f.spread), _BUT_ONE * _steady(f.spread_but_one))
    out *= _less(f.left, *_LEFT)
    out *= _less(f.left, *_PART)
    out *= _less(f.left_beside, *_POOR)
    if f.whole_curve:
        out *= _less(f.rewritten, *_REWRITTEN)
    return out * {0: ONE_RUN, 1: ONE_RUN, 2: TWO_RUNS}.get(f.runs, 1.0)


def _steady(spread: float) -> float:
    """Belief in an effect whose strength scatters so from run to run."""
    return _less(spread, 1.0, _SPREAD_LIMIT, _SPREAD_SCALE)


def _less(value: float, share: float, limit: float, scale: float) -> float:
    """What is left of a belief of which `share` goes where a value is over its limit, gradually over the scale."""
    return 1.0 - share * float(1.0 / (1.0 + np.exp(-np.clip((value - limit) / scale, -60.0, 60.0))))
