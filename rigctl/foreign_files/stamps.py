"""Dates and times of day as seconds since the first of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import ForeignFileError
from rigctl.foreign_files.arrow import seconds_since_first

__all__ = ["seconds_of"]

_DAY_S: Final = 86400.0
_CLOCK = re.compile(
    r"(?P<date>.*?)[T ]?\s*(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2})(?:[.,:](?P<f>\d+))?)?\s*(?P<half>[AaPp][Mm])?"
    r"(?:Z|[+-]\d{2}:?\d{2})?"
)


def seconds_of(texts: Sequence[str | None]) -> NDArray[np.float64]:
    """Seconds since the first, (N,); NaN where a cell is empty.

    Only the time of day counts. A midnight between two samples is one day more, so no file may skip a whole day.

    Raises ForeignFileError for a text that is no time of day.
    """
    iso = _by_arrow(texts)
    if iso is not None:
        return iso
    seconds = np.array([_of_day(text) for text in texts])
    back = np.diff(seconds) < -0.5 * _DAY_S
    seconds[1:] += _DAY_S * np.cumsum(back)
    first = seconds[np.isfinite(seconds)][:1]
    return seconds - (first[0] if first.size else 0.0)


def _by_arrow(texts: Sequence[str | None]) -> NDArray[np.float64] | None:
    """ISO 8601, which Arrow reads in a hundredth of the time; None for another form."""
    import pyarrow as pa

    try:
        ticks = pa.array(texts, pa.string()).cast(pa.timestamp("us"))
    except pa.ArrowInvalid:
        return None
    return seconds_since_first(ticks)


def _of_day(text: str | None) -> float:
    if text is None or not text.strip():
        return float("nan")
    found = _CLOCK.fullmatch(text.strip())
    if found is None:
        raise ForeignFileError(f"{text!r:.40} is no time of day: hours:minutes:seconds is one")
    hours = int(found["h"]) % 12 + 12 * (found["half"].casefold() == "pm") if found["half"] else int(found["h"])
    fraction = float(f"0.{found['f']}") if found["f"] else 0.0
    return 3600.0 * hours + 60.0 * int(found["m"]) + int(found["s"] or 0) + fraction
