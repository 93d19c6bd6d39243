"""What has samples, as the design that makes them again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from excitation.errors import ExcitationError
from excitation.kinds import FILE, HOMOGENISED, NOISE, REPLAY, Kind
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config, reads_a_file

__all__ = ["as_design", "is_searched"]

_QUICK: Final = (Kind.MULTISINE, Kind.SINE, Kind.TRIANGLE, Kind.STEPS, Kind.SWEEP, NOISE, Kind.ROAD)
"""Kinds whose samples are made again in about the time that reading them takes."""


def is_searched(design: Mapping[str, JSON]) -> bool:
    """Whether its phases are found by a search, which takes longer than reading samples."""
    return design.get("kind") == HOMOGENISED or design.get("phases", "random") != "random"


def as_design(given: Excitation, *, files: bool = False) -> Excitation:
    """What has samples, as its design where that makes the same bytes: a plan then keeps no samples.

    ``files``: also where the design reads a record; never of a design that somebody else has sent.
    """
    design = given.design
    asked = _QUICK if not files else (*_QUICK, REPLAY, FILE)
    unread = reads_a_file(design) and not files
    if given.sources is not None or design.get("kind") not in asked or is_searched(design) or unread:
        return given
    try:
        made = excitation_from_config(design)
    except ExcitationError:
        return given
    stated = (made.kind, made.sample_rate_hz, made.period_samples, made.samples)
    same = stated == (given.kind, given.sample_rate_hz, given.period_samples, given.samples)
    if not (same and np.array_equal(made.displacement_m, given.displacement_m)):
        return given
    current, stored = made.current_a, given.current_a
    same = current is stored if current is None or stored is None else np.array_equal(current, stored)
    return made.with_figures(given.figures) if same else given
