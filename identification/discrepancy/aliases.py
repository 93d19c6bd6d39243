"""What looks the same as a named effect under any motion of the actuator, and the physical test that splits them."""

from __future__ import annotations

from collections.abc import Collection

from identification.physical.elements import CATALOGUE


def aliases(names: Collection[str]) -> list[str]:
    """A sentence for every name that has an alias."""
    known = [(spec.title, spec.alias) for spec in (CATALOGUE[n] for n in names) if spec.alias is not None]
    return [f"{title}: {a.cause} would look the same in every run; to tell them apart, {a.test}" for title, a in known]
