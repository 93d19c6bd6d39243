"""The catalogue: every element that a model may hold, by its name, and the numbers by which the kernels know them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from identification.errors import ModelError
from identification.physical.elements import control, damping, friction, modifiers, motion, mount, sensor, springs
from identification.physical.elements.spec import ElementSpec, Family

SHIFT: Final = 5
"""`code >> SHIFT` is the family of an element: a family has room for 2**SHIFT of them."""

_ROWS: Final[tuple[ElementSpec, ...]] = (
    *damping.ROWS,
    *friction.ROWS,
    *motion.ROWS,
    *springs.ROWS,
    *modifiers.ROWS,
    *mount.ROWS,
    *control.ROWS,
    *sensor.ROWS,
)

CATALOGUE: Final[dict[str, ElementSpec]] = {row.name: row for row in _ROWS}
"""Every element by its name."""

(TONE,) = (row for row in _ROWS if row.tone)  # what the search for a tone finds


def codes_of(rows: Sequence[ElementSpec]) -> dict[str, int]:
    """The number of each row in the compiled kernels, by its name; raises ModelError where a family has too many."""
    counts = dict.fromkeys(Family, 0)
    codes = {}
    for row in rows:
        own = counts[row.family]
        if own == 1 << SHIFT:
            raise ModelError(
                f"{row.name}: the family {row.family.name} has room for {1 << SHIFT} elements: raise SHIFT"
            )
        codes[row.name] = (row.family << SHIFT) + own
        counts[row.family] += 1
    return codes


_CODES: Final = codes_of(_ROWS)


def code_of(name: str) -> int:
    """The number of an element in the compiled kernels."""
    return _CODES[name]
