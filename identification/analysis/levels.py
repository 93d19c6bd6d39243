"""Runs of several designs and levels: which go together, and the analysis of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from excitation.analysis import Analysis
from excitation.analysis.criteria import LEVEL_ALIKE
from identification.analysis.of_runs import analyse_runs, repeating
from identification.analysis.setting import Setting, setting_of
from rigctl.runfile import Run

__all__ = ["AtLevel", "analyse_levels"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AtLevel:
    """One design at one level: what was played, and what its runs say."""

    setting: Setting
    found: Analysis


def analyse_levels(runs: Sequence[Run]) -> tuple[AtLevel, ...]:
    """One analysis for each design and level among the runs, from the smallest motion to the largest.

    An approximation holds for one design, level and held current. Runs go together where rate, period and driven lines
    are the same, rms inputs lie within a factor of 1.3 and held currents within 5 % and 30 mA.

    Raises
    ------
    DataError, AnalysisError
        as ``analyse_runs``.
    """
    seen = [setting_of(repeating(run)) for run in runs]
    groups = _groups(seen)
    if len(groups) < 2:  # none, or one
        found = analyse_runs(runs)
        return (AtLevel(setting=seen[0], found=found),)
    return tuple(
        AtLevel(setting=seen[group[0]], found=analyse_runs([runs[k] for k in sorted(group)])) for group in groups
    )


def _groups(seen: Sequence[Setting]) -> list[list[int]]:
    """Places of the runs of each level, ascending by the motion: in a group every run is like every other."""
    order = sorted(range(len(seen)), key=lambda k: (seen[k].displacement_rms_m, seen[k].current_mean_a or 0.0))
    groups: list[list[int]] = []
    for k in order:
        home = next((group for group in groups if all(seen[n].is_like(seen[k], LEVEL_ALIKE) for n in group)), None)
        if home is None:
            groups.append([k])
        else:
            home.append(k)
    return groups
