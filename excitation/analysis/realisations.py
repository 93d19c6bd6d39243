"""Realisations made ready: settled periods, runs of one realisation together, the lines that they drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.criteria import ALIKE, LEVEL_ALIKE, LOCAL
from excitation.analysis.measurement import Measurement, Realisation
from excitation.analysis.result import Played
from excitation.analysis.seen_lines import SeenLines, excited_in, seen_lines
from excitation.analysis.settling import unsettled_periods
from excitation.analysis.spectra import LineSpectra, rms_lines
from excitation.errors import AnalysisError

__all__ = ["merged", "played_lines", "settled"]

Floats = NDArray[np.float64]
Lines = NDArray[np.int64]

_SAME_LINES = 0.9  # share of the lines of two runs that are common: those at the end of a steep spectrum may differ


def settled(measurement: Measurement) -> tuple[Measurement, tuple[Played, ...]]:
    """The measurement without the leading periods that have not settled, and how many they were."""
    ready, played = [], []
    for one in measurement.realisations:
        drop = unsettled_periods(one.force)
        ready.append(replace(one, inputs=one.inputs[:, drop:], force=one.force[drop:]))
        played.append(Played(name=one.name, periods=one.periods - drop, left_out=drop))
    return replace(measurement, realisations=tuple(ready)), tuple(played)


def merged(given: tuple[Measurement, tuple[Played, ...]]) -> tuple[Measurement, tuple[Played, ...]]:
    """Runs of the same phases as one realisation with the periods of all: they show no distortion as scatter."""
    measurement, played = given
    groups: list[list[int]] = []
    means = [rms_lines(one.inputs.mean(axis=1))[:, 1:] for one in measurement.realisations]
    for k, mean in enumerate(means):
        home = next((group for group in groups if _alike(means[group[0]], mean)), None)
        if home is None:
            groups.append([k])
        else:
            home.append(k)
    together, used = [], []
    for group in groups:
        parts = [measurement.realisations[k] for k in group]
        together.append(
            Realisation(
                name=parts[0].name,
                inputs=np.concatenate([one.inputs for one in parts], axis=1),
                force=np.concatenate([one.force for one in parts]),
            )
        )
        used.append(
            Played(
                name=parts[0].name,
                periods=together[-1].periods,
                left_out=sum(played[k].left_out for k in group),
                also=tuple(one.name for one in parts[1:]),
            )
        )
    return replace(measurement, realisations=tuple(together)), tuple(used)


def _alike(a: NDArray[np.complex128], b: NDArray[np.complex128]) -> bool:
    """Whether every input has the same spectrum, phases and level included; channels that rest have none."""
    for one, other in zip(a, b, strict=True):
        size = max(float(np.sum(np.abs(one) ** 2)), float(np.sum(np.abs(other) ** 2)))
        if size > 0.0 and abs(np.vdot(one, other)) < ALIKE * size:
            return False
    return True


def played_lines(measurement: Measurement, spectra: Sequence[LineSpectra]) -> tuple[SeenLines, tuple[str, ...]]:
    """The lines that the realisations drive, as seen, and where that is not what the design states.

    Raises AnalysisError where an input drives nothing, where runs differ in lines or level.
    """
    _check_levels(measurement, spectra)
    excited, notes = [], []
    for i, name in enumerate(measurement.inputs):
        each = [_seen(one, i) for one in spectra]
        common = _common(spectra, each, i, name)
        stated = None if measurement.excited is None else measurement.excited[i]
        if stated is not None and stated.size:
            common, note = _beside_stated(common, stated, np.abs(spectra[0].inputs[i]), name)
            notes += [note] if note else []
        excited.append(common)
    return seen_lines(excited, measurement.samples), tuple(notes)


def _seen(one: LineSpectra, i: int) -> Lines:
    return excited_in(np.abs(one.inputs[i]) ** 2, one.input_noise[i] / one.periods)


def _common(spectra: Sequence[LineSpectra], each: Sequence[Lines], i: int, name: str) -> Lines:
    common = each[0]
    for one, lines in zip(spectra, each, strict=True):
        if not lines.size:
            raise AnalysisError(f"{one.name}: {name} does not move: no line stands above its noise")
        shared = np.intersect1d(each[0], lines)
        if shared.size < _SAME_LINES * max(lines.size, each[0].size):
            raise AnalysisError(
                f"{one.name} drives other lines of {name} than {spectra[0].name} ({lines.size} and {each[0].size}, "
                f"{shared.size} in common): analyse each design by itself"
            )
        common = np.intersect1d(common, lines)
    return common


def _beside_stated(seen: Lines, stated: Lines, amplitude: Floats, name: str) -> tuple[Lines, str]:
    """The driven lines, and a note where the design states others.

    A line that the design leaves out is driven all the same where it is as high as its neighbours.
    """
    missing, extra = np.setdiff1d(stated, seen), np.setdiff1d(seen, stated)
    as_high = extra[amplitude[extra] > LOCAL * np.interp(extra, stated, amplitude[stated])]
    used = np.union1d(np.intersect1d(seen, stated), as_high)
    told = []
    if as_high.size:
        told.append(f"{as_high.size} lines are driven that it leaves out")
    if missing.size:
        told.append(f"{missing.size} of its {stated.size} lines are not above the noise")
    note = f"{name} is not what its design states: {', '.join(told)}; the measured lines count" if told else ""
    return (used if used.size else seen), note


def _check_levels(measurement: Measurement, spectra: Sequence[LineSpectra]) -> None:
    for i, name in enumerate(measurement.inputs):
        rms = [float(np.sqrt(np.sum(np.abs(one.inputs[i, 1:]) ** 2))) for one in spectra]
        low, high = int(np.argmin(rms)), int(np.argmax(rms))
        if rms[high] > LEVEL_ALIKE * rms[low]:
            raise AnalysisError(
                f"{spectra[high].name} has {name} of {rms[high]:.4g} rms and {spectra[low].name} of {rms[low]:.4g}: "
                "the approximation holds for one level; analyse each level by itself"
            )
