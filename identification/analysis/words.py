"""An analysis in words and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation.analysis import Analysis, Level, Response, Trend
from identification.analysis.levels import LevelsFound, Refused
from identification.analysis.setting import Setting

__all__ = ["analysis_data", "analysis_text", "level_text", "levels_data", "levels_text", "linear_share", "refused_text"]

# Any: JSON


def levels_text(found: LevelsFound) -> str:
    """The text of one level; of several one after the other, each under its motion and current."""
    if found.alone:
        return analysis_text(found.levels[0].found)
    count = len(found.levels)
    told = [
        f"level {number} of {count}: {one.setting.text}\n{analysis_text(one.found)}"
        for number, one in enumerate(found.levels, start=1)
    ]
    return "\n".join([*told, *(refused_text(one) for one in found.refused)])


def refused_text(one: Refused) -> str:
    """Which level is not known, and why."""
    return f"not analysed: {one.setting.text} ({', '.join(one.runs)}): {one.reason}"


def levels_data(found: LevelsFound) -> dict[str, Any]:
    """The figures of one level; of several under ``levels``, those that cannot be analysed under ``refused``."""
    each = [{**analysis_data(one.found), "level": _setting(one.setting)} for one in found.levels]
    if found.alone:
        return each[0]
    refused = [{"runs": list(one.runs), "level": _setting(one.setting), "reason": one.reason} for one in found.refused]
    return {"levels": each, "refused": refused}


def _setting(one: Setting) -> dict[str, float | None]:
    return {
        "displacement_rms": one.displacement_rms_m,
        "velocity_rms": one.velocity_rms_m_s,
        "current_rms": one.current_rms_a,
        "current_mean": one.current_mean_a,
    }


def analysis_text(found: Analysis) -> str:
    """The parts of the force, the change over the run and the notes, a line each."""
    return "\n".join(_lines(found))


def _lines(found: Analysis) -> Iterator[str]:
    low, high = found.band_hz
    levels = found.levels
    count = len(found.played)
    periods = sum(one.periods for one in found.played)
    yield (
        f"{count} realisation{'s' * (count != 1)}, {periods} settled periods, {found.lines.driven.size} lines from "
        f"{low:.3g} to {high:.3g} Hz; distortion by {found.method}"
    )
    yield f"force {levels.force_rms:.4g} N rms, linear {levels.linear_rms:.4g} N ({linear_share(found):.2f} %)"
    for name, level in _named(found):
        if level is not None:
            yield f"{name}: {level_text(level, levels.force_rms)}"
    for trend in found.variation.trends:
        yield f"{trend.name}: {change_text(trend)}"
    yield from (f"note: {note}" for note in found.notes)


def _named(found: Analysis) -> Iterator[tuple[str, Level | None]]:
    levels = found.levels
    if levels.odd is None and levels.even is None:
        yield "odd and even distortion together", levels.nonlinear
    yield "odd distortion", levels.odd
    yield "even distortion", levels.even
    yield f"noise up to {found.reach_hz:.3g} Hz in one period", levels.noise
    yield "change from period to period", found.variation.level


def linear_share(found: Analysis) -> float:
    """Share of the mean square of the force that the linear approximation makes, %."""
    return 100.0 * (found.levels.linear_rms / found.levels.force_rms) ** 2 if found.levels.force_rms else 0.0


def level_text(level: Level, force_rms: float) -> str:
    """A level with its bounds and as a share of the rms force; where it is not seen, what it is at most."""
    low, high = level.bounds
    share = 100.0 / force_rms if force_rms else 0.0
    if not level.is_seen:
        return f"not seen, at most {high:.3g} N rms ({share * high:.2g} %)"
    return f"{level.rms:.3g} N rms ({low:.3g} … {high:.3g}), {share * level.rms:.2g} % of the force"


def change_text(trend: Trend) -> str:
    """How the force changed over a run."""
    change = f"{100 * trend.change:+.2g} ± {196 * trend.change_std:.1g} %"
    if abs(trend.change) <= 1.96 * trend.change_std:
        return f"the force does not change over its {trend.gain.size} periods ({change})"
    return f"the force changes by {change} over its {trend.gain.size} periods"


def analysis_data(found: Analysis) -> dict[str, Any]:
    """The figures, SI: plain numbers and text, null where something is not known."""
    levels = found.levels
    return {
        "runs": [
            {"name": one.name, "periods": one.periods, "left_out": one.left_out, "also": list(one.also)}
            for one in found.played
        ],
        "sample_rate": found.sample_rate_hz,
        "period_samples": found.samples,
        "band": list(found.band_hz),
        "reach": found.reach_hz,
        "lines": {
            "driven": int(found.lines.driven.size),
            "odd_detection": int(found.lines.inside(found.lines.odd).size),
            "even_detection": int(found.lines.inside(found.lines.even).size),
        },
        "method": found.method,
        "force": {
            "unit": "N",
            "rms": levels.force_rms,
            "linear": levels.linear_rms,
            "odd": _level(levels.odd),
            "even": _level(levels.even),
            "nonlinear": _level(levels.nonlinear),
            "noise": _level(levels.noise),
            "time_variation": _level(found.variation.level),
        },
        "trends": [
            {
                "run": one.name,
                "gain": _numbers(one.gain),
                "gain_std": one.gain_std,
                "mean_force": _numbers(one.mean),
                "change": one.change,
                "change_std": one.change_std,
            }
            for one in found.variation.trends
        ],
        "responses": [_response(one) for one in found.responses],
        "coherence": {
            "frequency": _numbers(found.frequency_hz),
            "value": _numbers(found.coherence),
            "noise_only": _numbers(found.noise_coherence),
        },
        "notes": list(found.notes),
    }


def _level(level: Level | None) -> dict[str, Any] | None:
    if level is None:
        return None
    low, high = level.bounds
    return {"rms": level.rms, "low": low, "high": high, "seen": level.is_seen}


def _response(one: Response) -> dict[str, Any]:
    return {
        "over": one.over,
        "unit": one.unit,
        "frequency": _numbers(one.frequency_hz),
        "real": _numbers(one.value.real),
        "imaginary": _numbers(one.value.imag),
        "std": _numbers(one.std),
        "bound": _numbers(one.bound),
        "noise_std": _numbers(one.noise_std),
    }


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
