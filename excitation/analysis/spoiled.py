"""Detection lines of one channel that another channel excites."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.criteria import SPOILED
from excitation.analysis.seen_lines import excited_in
from excitation.analysis.spectra import rms_lines
from excitation.kinds import Kind
from excitation.plan import TestPlan
from excitation.signal import Excitation

__all__ = ["spoiled_in", "spoiled_lines"]

Lines = NDArray[np.int64]


def spoiled_lines(excited: Mapping[str, Lines]) -> tuple[str, ...]:
    """A line of text for each channel whose detection lines carry another channel's excitation.

    The force of that other channel there looks like distortion: an odd displacement beside a current on all lines
    showed 6.5 % of odd distortion that was not there.
    """
    out = []
    for name, lines in excited.items():
        if lines.size < 2:
            continue
        left_out = np.setdiff1d(np.arange(lines[0], lines[-1] + 1), lines)
        for other, driven in excited.items():
            hit = np.intersect1d(left_out, driven) if other != name else driven[:0]
            if hit.size > SPOILED * left_out.size:
                out.append(
                    f"{other} excites {hit.size} of the {left_out.size} lines that {name} leaves out to detect "
                    f"distortion: its force looks like distortion there; give both the same lines and the same f_min"
                )
    return tuple(out)


def spoiled_in(made: Excitation | TestPlan) -> tuple[str, ...]:
    """What ``spoiled_lines`` says of a multisine or of a plan: of each text the first test and how many more."""
    if isinstance(made, Excitation):
        return _of_excitation(made)
    told: dict[str, list[str]] = {}
    for test in made.tests:
        for text in _of_excitation(test.excitation):
            told.setdefault(text, []).append(test.name)
    return tuple(f"{names[0]}{_and_more(len(names) - 1)}: {text}" for text, names in told.items())


def _and_more(count: int) -> str:
    return f" and {count} more" if count else ""


def _of_excitation(excitation: Excitation) -> tuple[str, ...]:
    period = excitation.period_samples
    if excitation.kind != Kind.MULTISINE or not period:
        return ()  # before its samples are made
    if excitation.current_a is None or np.ptp(excitation.current_a) == 0.0:
        return ()
    channels = {"displacement": excitation.displacement_m, "current": excitation.current_a}
    found = {}
    for name, samples in channels.items():
        one = samples[-period:]
        power = np.abs(rms_lines(one / max(float(np.abs(one).max()), np.finfo(np.float64).tiny))) ** 2
        found[name] = excited_in(power, np.zeros_like(power))
    return spoiled_lines({name: lines for name, lines in found.items() if lines.size})
