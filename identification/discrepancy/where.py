"""Where simulation and measurement disagree: over which variable, in which region, in which runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.criteria import TEXT
from identification.record import Record
from identification.report.page_data import Profile

Floats = NDArray[np.float64]

_BINS = 48


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """The shortest stretch of one variable that holds at least half of the gap's energy."""

    variable: str
    low: float
    high: float
    unit: str
    share_of_gap: float
    share_of_samples: float
    runs: tuple[str, ...]
    text: str


def variables(record: Record) -> dict[str, tuple[Floats, str]]:
    """Everything a gap may depend on, in the record's window: name → (values (M,), unit)."""
    m, window = record.motion, record.window
    out: dict[str, tuple[Floats, str]] = {
        "velocity": (m.v[window], "m/s"),
        "speed": (np.abs(m.v[window]), "m/s"),
        "displacement": (m.x[window], "m"),
        "stroke": (np.abs(m.x[window] - np.mean(m.x[window])), "m"),
        "acceleration": (m.a[window], "m/s²"),
        "travel_since_reversal": (_travel(m.x, m.v)[window], "m"),
    }
    if record.has_current:
        out["current"] = (m.i[window], "A")
        since = _since_step(m.i, record.dt)
        if since is not None:
            out["time_since_current_step"] = (since[window], "s")
    if record.has_temperature:
        out["temperature"] = (m.temperature[window], "degC")
    return out


def _travel(x: Floats, v: Floats) -> Floats:
    """Distance from the last point of reversal, (N,), m."""
    turns = np.flatnonzero(np.diff(np.sign(v)) != 0) + 1
    last = np.zeros(x.size, dtype=np.int64)
    last[turns] = turns
    return np.abs(x - x[np.maximum.accumulate(last)])


def _since_step(i: Floats, dt: float) -> Floats | None:
    """Time since the current last stepped, (N,), s; None where it never does."""
    jumps = np.abs(np.diff(i)) > TEXT.step * max(float(np.ptp(i)), 1e-300)
    if not np.any(jumps) or np.mean(jumps) > TEXT.steady:
        return None
    index = np.arange(i.size)
    last = np.where(np.concatenate([[False], jumps]), index, 0)
    return np.asarray((index - np.maximum.accumulate(last)) * dt, dtype=np.float64)


def locate(residuals: Sequence[Floats], records: Sequence[Record]) -> tuple[list[Region], list[Profile]]:
    """Regions that hold half of the gap, the most concentrated first, and the profiles behind them.

    `residuals` are those of the refitted base, N, one (M,) array per record. Energy is counted beyond the noise.
    """
    names = sorted(set().union(*(variables(r) for r in records)))
    regions, profiles = [], []
    for name in names:
        chosen = [(r, e) for r, e in zip(records, residuals, strict=True) if name in variables(r)]
        values = np.concatenate([variables(r)[name][0] for r, _ in chosen])
        unit = variables(chosen[0][0])[name][1]
        if np.ptp(values) == 0.0:
            continue
        stacked = np.concatenate([e for _, e in chosen])
        noise = np.concatenate([np.full(e.size, r.sigma**2) for r, e in chosen])
        low, high = np.quantile(values, (0.001, 0.999))
        edges = np.linspace(low, high, _BINS + 1)
        index = np.clip(np.digitize(values, edges) - 1, 0, _BINS - 1)
        count = np.bincount(index, minlength=_BINS).astype(np.float64)
        energy = np.bincount(index, weights=stacked**2 - noise, minlength=_BINS)
        mean = np.bincount(index, weights=stacked, minlength=_BINS) / np.maximum(count, 1.0)
        rms = np.sqrt(np.bincount(index, weights=stacked**2, minlength=_BINS) / np.maximum(count, 1.0))
        seen = count > 0
        band = _between_runs([e for _, e in chosen], index, mean)
        centre = 0.5 * (edges[1:] + edges[:-1])
        profiles.append(
            Profile(variable=name, unit=unit, centre=centre[seen], mean=mean[seen], rms=rms[seen], band=band[seen])
        )
        regions.append(_region(name, unit, edges, np.maximum(energy, 0.0), count, _loudest(chosen)))
    order = sorted(
        regions, key=lambda g: -_telling(g.variable) * g.share_of_gap / max(g.share_of_samples, TEXT.least_samples)
    )
    return order[: TEXT.most_regions], profiles


def _between_runs(residuals: Sequence[Floats], index: NDArray[np.int64], mean: Floats) -> Floats:
    """Scatter of the means of single runs per bin, weighted by their samples, (B,); zero where one run alone is."""
    square, weight, start = np.zeros(_BINS), np.zeros(_BINS), 0
    for e in residuals:
        own = index[start : start + e.size]
        start += e.size
        count = np.bincount(own, minlength=_BINS)
        away = np.bincount(own, weights=e, minlength=_BINS) / np.maximum(count, 1) - mean
        square += count * away**2
        weight += count
    return np.asarray(np.sqrt(square / np.maximum(weight, 1)))


def _telling(variable: str) -> float:
    """How much a concentration means: one over what is nearly constant within a run only tells the runs apart."""
    return TEXT.between_runs if variable in ("temperature", "current") else 1.0


def _loudest(chosen: Sequence[tuple[Record, Floats]]) -> tuple[str, ...]:
    energy = {r.name: float(np.sum(e**2)) for r, e in chosen}
    total = sum(energy.values())
    return tuple(name for name, value in sorted(energy.items(), key=lambda i: -i[1]) if value > TEXT.loud * total)


def _region(name: str, unit: str, edges: Floats, energy: Floats, count: Floats, runs: tuple[str, ...]) -> Region:
    total, samples = max(float(energy.sum()), 1e-300), float(count.sum())
    sums, counts = np.concatenate([[0.0], np.cumsum(energy)]), np.concatenate([[0.0], np.cumsum(count)])
    best = (0, len(energy))
    for start in range(len(energy)):
        stop = int(np.searchsorted(sums, sums[start] + 0.5 * total, side="left"))
        if stop < len(sums) and counts[stop] - counts[start] < counts[best[1]] - counts[best[0]]:
            best = (start, stop)
    low, high = float(edges[best[0]]), float(edges[best[1]])
    share = float((sums[best[1]] - sums[best[0]]) / total)
    part = float((counts[best[1]] - counts[best[0]]) / samples)
    even = share < TEXT.even * part
    text = f"nearly even over {name.replace('_', ' ')}" if even else _words(name, low, high, edges)
    return Region(
        variable=name, low=low, high=high, unit=unit, share_of_gap=share, share_of_samples=part, runs=runs,
        text=f"{text}: {100 * share:.0f} % of the gap in {100 * part:.0f} % of the samples",
    )  # fmt: skip


def _words(name: str, low: float, high: float, edges: Floats) -> str:
    span = float(edges[-1] - edges[0])
    if name == "velocity" and low < 0.0 < high and high - low < TEXT.narrow * span:
        return "near zero velocity, at every reversal"
    if name == "travel_since_reversal" and low <= edges[0] + TEXT.at_edge * span:
        return "just after each reversal of the motion"
    if name == "time_since_current_step" and low <= edges[0] + TEXT.at_edge * span:
        return "just after each step of the current"
    outer = TEXT.outer * span
    place = "low" if high < edges[0] + outer else "high" if low > edges[-1] - outer else "middle"
    if high - low > TEXT.wide * span:
        return f"all over the range of {name.replace('_', ' ')}"
    return f"at {place} {name.replace('_', ' ')}"
