"""Faults of a measured force: single samples that stand off both of their neighbours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rigctl.runfile import Run

Floats = NDArray[np.float64]

# A sample is a spike where it stands off both of its neighbours, on the same side, by more than this times the range of
# nine tenths of the samples, and of all samples that do not. Of 47 measured runs of three machines at 100 to 1 000 Hz
# none reaches 0.2 of the former, of 16 simulated ones with noise and coarse steps none 0.1; where a run is at rest for
# nine tenths, the peaks of its motion do. Half: the noise of a bad load cell is left out of a force; double: a glitch
# as large as the force stays, at a tenth of the damage.
_ALONE = 1.0
_RANGE = (0.05, 0.95)  # of the samples
_FEWEST = 64  # samples from which a range is known


def spikes_in(run: Run) -> NDArray[np.int64]:
    """The samples at which the force of a run is a spike; one that comes again in the period before or after is none.

    A peak of two samples or more is none either: a machine may strike its stop.
    """
    force = run.channels.get("force")
    if force is None or force.size < _FEWEST:
        return np.zeros(0, dtype=np.int64)
    low, high = np.quantile(force, _RANGE)
    before, after = (force - one for one in _neighbours(force))
    off = np.where(before * after > 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)
    found = np.flatnonzero(off > _ALONE * (high - low))
    found = found[off[found] > _ALONE * np.ptp(np.delete(force, found))]
    if run.period_samples:  # what every period has belongs to the machine
        found = found[~(np.isin(found + run.period_samples, found) | np.isin(found - run.period_samples, found))]
    return np.asarray(found, dtype=np.int64)


def spike_fault(run: Run) -> str | None:
    """What is wrong with a force that has spikes, in one line; None where it has none."""
    spikes = spikes_in(run)
    if not spikes.size:
        return None
    force, first = run.channels["force"], int(spikes[0])
    before, after = (one[first] for one in _neighbours(force))
    low, high = np.quantile(force, _RANGE)
    more = f" and for {spikes.size - 1} more" if spikes.size > 1 else ""
    return (
        f"it is {force[first]:.4g} N for one sample at {first / run.sample_rate_hz:.4g} s{more}, between neighbours of "
        f"{before:.4g} and {after:.4g} N, where nine tenths lie in [{low:.4g}, {high:.4g}] N: a "
        "glitch of its sensor or its recorder; check its cable and its ground"
    )


def bridged(run: Run) -> Run:
    """The run with the mean of the neighbours in the place of every spike of its force."""
    spikes = spikes_in(run)
    if not spikes.size:
        return run
    force = run.channels["force"].copy()
    before, after = _neighbours(force)
    force[spikes] = 0.5 * (before + after)[spikes]
    return replace(run, channels={**run.channels, "force": force})


def _neighbours(force: Floats) -> tuple[Floats, Floats]:
    """The samples before and after each, (N,) each; at an end twice the one that there is."""
    padded = np.pad(force, 1, mode="reflect")
    return padded[:-2], padded[2:]
