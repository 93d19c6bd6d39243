"""The catalogue: every element that a model may hold, by its name."""

from __future__ import annotations

from typing import Final

from identification.physical.elements import control, damping, friction, modifiers, motion, mount, sensor, springs
from identification.physical.elements.spec import ElementSpec

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
