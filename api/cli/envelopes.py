"""``--envelope RIG.toml``: what a rig and a specimen can do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from excitation import TestPlan
    from excitation.rig import Envelope

__all__ = ["envelopes_for"]


def envelopes_for(files: Sequence[Path], plans: Iterable[TestPlan]) -> tuple[Envelope, ...]:
    """Read the envelopes and check every test of the plans against each.

    Raises DesignError for a file that cannot be read, EnvelopeError for a test that exceeds an envelope: one line.
    """
    from excitation.envelope import check_plan
    from excitation.rig import read_envelope

    envelopes = tuple(read_envelope(file) for file in files)
    for plan in plans if envelopes else ():
        for one in envelopes:
            check_plan(plan, one)
    return envelopes
