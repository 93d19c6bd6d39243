"""The kinds of jobs that there are. A new one is a file like ``fit.py`` and its entries here."""

from __future__ import annotations

from api.jobs.characterise import CHARACTERISE, CharacteriseRequest
from api.jobs.explain import EXPLAIN, ExplainRequest
from api.jobs.fit import FIT, FitRequest

__all__ = ["KINDS", "AnyRequest"]

KINDS = {kind.name: kind for kind in (EXPLAIN, FIT, CHARACTERISE)}
AnyRequest = ExplainRequest | FitRequest | CharacteriseRequest
