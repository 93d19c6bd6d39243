"""Amplitude, frequency and current of tests as they were asked, for labels: 25 mm, not 24.999999975 mm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_ONE_LEVEL = 0.02  # relative step between neighbours of one level; rigs hold an amplitude to 1 %. At 4 %: 10 and 10.4
_ROUNDED = 0.005  # relative width about the mean of a level within which the shortest number is its label


def asked(measured: Sequence[float], designed: Sequence[float | None], *, least_step: float = 0.0) -> list[float]:
    """The value that each test was asked for: of its design where it has one, else of the level it lies in.

    Tests within 2 % of their neighbour, or within `least_step`, are of one level; its label is the shortest number
    within half a percent of its mean.
    """
    found = [float("nan") if value is None else value for value in designed]
    open_ones = sorted((k for k, value in enumerate(found) if not np.isfinite(value)), key=lambda k: measured[k])
    for level in _levels(open_ones, measured, least_step):
        label = _shortest(float(np.mean([measured[k] for k in level])), least_step)
        for k in level:
            found[k] = label
    return found


def _levels(order: Sequence[int], values: Sequence[float], least_step: float) -> list[list[int]]:
    levels: list[list[int]] = []
    for k in order:
        before = values[levels[-1][-1]] if levels else None
        if before is not None and abs(values[k] - before) <= max(_ONE_LEVEL * abs(before), least_step):
            levels[-1].append(k)
        else:
            levels.append([k])
    return levels


def _shortest(value: float, least_step: float) -> float:
    """The number with the fewest digits near `value`."""
    width = max(_ROUNDED * abs(value), 0.5 * least_step)
    if abs(value) <= width:
        return 0.0
    return next(
        r for digits in range(1, 18) if abs((r := float(f"{value:.{digits}g}")) - value) <= width or digits == 17
    )
