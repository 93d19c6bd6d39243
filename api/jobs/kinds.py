"""The kinds of jobs. A new kind is a file like ``fit.py`` and its entries here."""

from __future__ import annotations

from api.errors import InputError
from api.jobs.characterise import CHARACTERISE, CharacteriseRequest
from api.jobs.compare import COMPARE, CompareRequest
from api.jobs.explain import EXPLAIN, ExplainRequest
from api.jobs.fit import FIT, FitRequest
from api.jobs.kind import Kind

__all__ = ["KINDS", "AnyRequest", "find_kind"]

KINDS = {kind.name: kind for kind in (EXPLAIN, FIT, CHARACTERISE, COMPARE)}
AnyRequest = ExplainRequest | FitRequest | CharacteriseRequest | CompareRequest


def find_kind(name: str) -> Kind:
    """The kind with this name; raises InputError for a name that this version does not have."""
    if name not in KINDS:
        raise InputError(f"kind is {name!a:.60}: this version has {', '.join(KINDS)}")
    return KINDS[name]
