"""How large force and gap are by kind before any model: linear, odd, even, noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis import Analysis, Level
from excitation.analysis.spectra import rms_lines
from excitation.errors import AnalysisError
from identification.analysis import analyse_runs
from identification.discrepancy.explanation import Distortion, Traces
from identification.errors import DataError
from rigctl.runfile import Run

__all__ = ["distortion_of"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Analysed:
    """A run whose distortion is known, with the traces of its force."""

    found: Analysis
    trace: Traces


def distortion_of(runs: Sequence[Run], traces: Sequence[Traces]) -> Distortion | None:
    """Parts of the force and of the gap of the refitted base, over the runs that tell odd from even; None without one.

    Those are periodic runs on odd lines alone: multisines with detection lines, and sines, by their harmonics.
    """
    by_name = {trace.record.name: trace for trace in traces}
    known = [one for run in runs if (one := _analysed(run, by_name)) is not None]
    if not known:
        return None
    gap = _mean([_gap(one.trace) for one in known])
    force = {**_force([one.found for one in known]), "noise": gap["noise"]}  # up to half the sample rate
    names = tuple(one.trace.record.name for one in known)
    return Distortion(runs=names, force=force, gap=gap, text=_text(force, gap, len(names), len(runs)))


def _analysed(run: Run, traces: Mapping[str, Traces]) -> _Analysed | None:
    try:
        found = analyse_runs([run])
    except (DataError, AnalysisError):
        return None  # it has no period, or nothing can be told of it
    trace = traces.get(found.played[0].name)
    told = found.lines.splits and found.levels.odd is not None and found.levels.even is not None
    return _Analysed(found=found, trace=trace) if told and trace is not None and trace.record.period else None


def _force(found: Sequence[Analysis]) -> dict[str, float]:
    """Rms of the parts of the force, N."""
    return _mean(
        [
            {
                "rms": one.levels.force_rms**2,
                "linear": one.levels.linear_rms**2,
                "odd": _power(one.levels.odd),
                "even": _power(one.levels.even),
            }
            for one in found
        ]
    )


def _power(level: Level | None) -> float:
    return 0.0 if level is None else max(level.power, 0.0)


def _gap(trace: Traces) -> dict[str, float]:
    """Mean squares of the offset, odd lines, even lines and noise of what the refitted base leaves, N².

    Of a motion on odd lines alone, a symmetrical force is on odd lines too, whatever its law.
    """
    period = trace.record.period
    rest = (trace.record.measured - trace.refitted).reshape(-1, period)
    mean, count = rest.mean(axis=0), rest.shape[0]
    between = float(np.mean((rest - mean) ** 2)) * count / max(count - 1, 1)
    noise = between if count > 1 else trace.record.sigma**2
    power = np.abs(rms_lines(mean)) ** 2
    odd, even = float(np.sum(power[1::2])), float(np.sum(power[2::2]))
    share = 0.5 * noise / count
    return {
        "offset": float(power[0]),
        "odd": max(odd - share, 0.0),
        "even": max(even - share, 0.0),
        "noise": noise,
    }


def _mean(powers: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Rms over the runs of each part, N."""
    return {name: float(np.sqrt(np.mean([one[name] for one in powers]))) for name in powers[0]}


def _text(force: Mapping[str, float], gap: Mapping[str, float], told: int, runs: int) -> str:
    where = "" if told == runs else f" (in {told} of {runs} runs)"
    parts = ", ".join(f"{gap[name]:.3g} N {name}" for name in ("odd", "even", "offset", "noise"))
    return (
        f"before any model{where}: force {force['rms']:.4g} N rms, of it {force['linear']:.4g} N linear, "
        f"{force['odd']:.3g} N odd and {force['even']:.3g} N even distortion; the refitted "
        f"model leaves {parts}"
    )
