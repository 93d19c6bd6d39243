"""How many samples of an RPC III file are signal: stated by its writer, or found where the last frame is padded."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from excitation.errors import ExcitationFileError

__all__ = ["samples_without_padding", "stated_samples"]

_LEAST_HELD: Final = 8
"""Samples from which on a value held in all channels at the end is padding.

At half of it a slow 16-bit signal loses its last samples now and then, at double a shorter padding is played as a rest;
neither makes a step.
"""
_NAMES: Final = (
    "SAMPLES", "NUM_SAMPLES", "NUMBER_OF_SAMPLES", "TOTAL_SAMPLES", "NUM_POINTS", "TOTAL_POINTS", "PTS_PER_CHANNEL",
    "POINTS_PER_CHANNEL",
)  # fmt: skip
"""Keywords, alone or beside others with a dot (ACME.SAMPLES, SAMPLES.CHAN_1), by which writers state the samples of a
channel."""


def stated_samples(path: Path, keywords: Mapping[str, str], held: int) -> int | None:
    """The samples of each channel that the header states; None where it states none.

    Raises ExcitationFileError where it states more than the ``held`` ones, or no whole number.
    """
    for keyword, text in keywords.items():
        if not any(part in _NAMES for part in keyword.upper().split(".")):
            continue
        number = int(text) if text.isdecimal() else 0
        if not 0 < number <= held:
            raise ExcitationFileError(f"{path}: {keyword} is {text!r}: the data hold {held} samples, from 1 on")
        return number
    return None


def samples_without_padding(data: NDArray[Any], group: int) -> int:
    """Samples of ``data``, (N, channels) as stored, without what fills the last group of frames, of ``group`` samples.

    Padding is a run at the end, inside the last group, in which all channels are zero after a step larger than any
    other of the signal, or in which all channels hold one value.
    """
    samples = int(data.shape[0])
    changes = np.flatnonzero((data[1:] != data[:-1]).any(axis=1))
    if changes.size == 0:
        return samples
    last = int(changes[-1]) + 1  # the first sample of the run
    if samples - last > group or last <= samples - group:
        return samples
    if not data[last].any() and _is_a_step(data[: last + 1].astype(np.float64)):
        return last
    return last + 1 if samples - last > _LEAST_HELD else samples


def _is_a_step(data: NDArray[np.float64]) -> bool:
    """Whether the last change, of some channel, is larger than twice all others of the channel."""
    change = np.abs(np.diff(data, axis=0))
    return bool(np.any(change[-1] > 2.0 * change[:-1].max(axis=0, initial=0.0)))
