"""The signals of a motion."""

from __future__ import annotations

from collections.abc import Mapping

SIGNALS: Mapping[str, str] = {
    "displacement": "x",
    "velocity": "v",
    "acceleration": "a",
    "current": "i",
    "temperature": "temperature",
}
"""Name of the channel, and of the series in `Motion`."""

UNITS: Mapping[str, str] = {
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s²",
    "current": "A",
    "temperature": "°C",
}
"""The unit of every signal, for sentences."""
