"""The catalogue: every element that a model may hold, by its name, and the numbers by which the kernels know them."""

from __future__ import annotations

from typing import Final

from identification.physical.elements import control, damping, friction, modifiers, motion, mount, sensor, springs
from identification.physical.elements.spec import ElementSpec, Family

_PLACES: Final = 32  # codes that a family has room for

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


def _codes() -> dict[str, int]:
    counts = dict.fromkeys(Family, 0)
    codes = {}
    for row in _ROWS:
        codes[row.name] = row.family * _PLACES + counts[row.family]
        counts[row.family] += 1
    return codes


_CODES: Final = _codes()


def code_of(name: str) -> int:
    """The number of an element in the compiled kernels; `code // 32` is its family."""
    return _CODES[name]
