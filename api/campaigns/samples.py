"""Samples of a run for a chart or a table: a range, reduced so that no peak is lost."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from api.errors import InputError
from rigctl.runfile import Run

__all__ = ["Samples", "samples_of", "to_csv"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """Lowest and highest value of each channel in equal steps of ``step`` samples; step 1: the samples themselves."""

    start: int  # first sample
    end: int  # one behind the last sample
    step: int
    sample_rate_hz: float
    units: dict[str, str]
    lowest: dict[str, NDArray[np.float64]]  # (n,) each
    highest: dict[str, NDArray[np.float64]]  # (n,) each

    @property
    def time_s(self) -> NDArray[np.float64]:
        """(n,) begin of each step, from sample 0."""
        return np.arange(self.start, self.end, self.step) / self.sample_rate_hz


def samples_of(run: Run, channels: Sequence[str], start: int, end: int | None, points: int) -> Samples:
    """At most ``points`` steps of the samples ``start`` … ``end`` − 1; no channels: all of them.

    Raises InputError for a channel that the run does not have, and for an empty range.
    """
    unknown = [name for name in channels if name not in run.channels]
    if unknown:
        raise InputError(f"channels: the run has no {unknown[0]!r:.60}: it has {', '.join(run.channels)}")
    last = run.samples if end is None else min(end, run.samples)
    if not start < last:
        raise InputError(f"from {start} to {last}: the range is empty, the run has {run.samples} samples")
    step = -(-(last - start) // points)
    edges = np.arange(0, last - start, step)
    cut = {name: run.channels[name][start:last] for name in (channels or run.channels)}
    return Samples(
        start=start,
        end=last,
        step=step,
        sample_rate_hz=run.sample_rate_hz,
        units={name: run.units[name] for name in cut},
        lowest={name: np.minimum.reduceat(values, edges) for name, values in cut.items()},
        highest={name: np.maximum.reduceat(values, edges) for name, values in cut.items()},
    )


def to_csv(samples: Samples) -> str:
    """A line for each step: its time, and of each channel the lowest and highest value, or the sample."""
    parts = [("", samples.lowest)] if samples.step == 1 else [(" min", samples.lowest), (" max", samples.highest)]
    names = [(name, suffix, values[name]) for name in samples.units for suffix, values in parts]
    text = io.StringIO()
    out = csv.writer(text)
    out.writerow(["time (s)", *(f"{name}{suffix} ({samples.units[name]})" for name, suffix, _ in names)])
    out.writerows(zip(samples.time_s.tolist(), *(values.tolist() for _, _, values in names), strict=True))
    return text.getvalue()
