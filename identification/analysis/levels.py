"""Runs of several designs and levels: which go together, and the analysis of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from excitation.analysis import Analysis
from excitation.analysis.criteria import LEVEL_ALIKE
from excitation.errors import AnalysisError
from identification.analysis.of_runs import analyse_runs, repeating
from identification.analysis.setting import Setting, setting_of
from identification.errors import DataError
from identification.measured import label_of
from rigctl.runfile import Run

__all__ = ["AtLevel", "LevelsFound", "Refused", "analyse_levels"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AtLevel:
    """One design at one level: what was played, and what its runs say."""

    setting: Setting
    found: Analysis


@dataclass(frozen=True, slots=True, kw_only=True)
class Refused:
    """One design at one level of which its runs say nothing, and why, in one line."""

    setting: Setting
    runs: tuple[str, ...]
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelsFound:
    """What is known of each level, from the smallest motion to the largest, and the levels that are not."""

    levels: tuple[AtLevel, ...]  # one or more
    refused: tuple[Refused, ...] = ()

    @property
    def alone(self) -> bool:
        """Whether the runs are of one level."""
        return len(self.levels) + len(self.refused) == 1


def analyse_levels(runs: Sequence[Run]) -> LevelsFound:
    """One analysis for each design and level among the runs.

    An approximation holds for one design, level and held current. Runs go together where rate, period and driven lines
    are the same, rms inputs lie within a factor of 1.3 and held currents within 5 % and 30 mA.

    Raises
    ------
    DataError, AnalysisError
        as ``analyse_runs``, where a run does not repeat or no level can be analysed.
    """
    seen = [setting_of(repeating(run)) for run in runs]
    groups = _groups(seen)
    if len(groups) < 2:  # none, or one
        found = analyse_runs(runs)
        return LevelsFound(levels=(AtLevel(setting=seen[0], found=found),))
    levels, refused, errors = [], [], []
    for group in groups:
        own, setting = [runs[k] for k in sorted(group)], seen[group[0]]
        try:
            levels.append(AtLevel(setting=setting, found=analyse_runs(own)))
        except (DataError, AnalysisError) as error:
            refused.append(Refused(setting=setting, runs=tuple(label_of(run) for run in own), reason=str(error)))
            errors.append(error)
    if not levels:
        raise type(errors[0])(f"none of {len(groups)} levels can be analysed; the first: {errors[0]}") from errors[0]
    return LevelsFound(levels=tuple(levels), refused=tuple(refused))


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
