"""Identifies a model of several axes from runs: superposed where each moves one axis, else as they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.blackbox.given import Base
from identification.blackbox.preparation import at_one_rate
from identification.compute.blas import one_blas_thread
from identification.errors import DataError
from identification.models.simulation import name_of
from identification.multiaxis.axes import axes_moved, check_axes, check_moved, held_in, largest_of, moves
from identification.multiaxis.independence import check_independent, learned_from
from identification.multiaxis.model import MultiAxis, identify_axes
from identification.multiaxis.superposition import Superposed, check_superposition, same_motions, superposed
from rigctl.runfile import Run

_LEARNED = 2 / 3  # of each run: the rest is shown to the model that says what to expect
Told = Callable[[float, str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedAxes:
    """A model of several axes and what was seen on the way; fits in free run, %, by load.

    `predicted` is the fit on the last third of the training of a model that learned from the rest; `shown` that on each
    held-out run. `summed` is None where the runs move several axes each; `checks` is what the sum of the single tests
    misses of each held-out run that plays their motions together. `held` are the axes that no run of the training
    moves, with their noise, m or rad; `untried` those of them that a held-out run moves. `outside` is the share of the
    samples of each held-out run beyond the training, by axis, and `beyond` are sentences on where and how far.
    """

    model: MultiAxis
    summed: int | None
    predicted: Mapping[str, float]
    trained: Mapping[str, float]
    shown: Mapping[str, Mapping[str, float]]
    outside: Mapping[str, Mapping[str, float]]
    beyond: Mapping[str, Sequence[str]]
    checks: Mapping[str, Superposed]
    held: Mapping[str, float]
    untried: Mapping[str, tuple[str, ...]]


@one_blas_thread()
def identify_multiaxis(
    runs: Sequence[Run],
    *,
    held_out: Sequence[Run] = (),
    base: Base | None = None,
    name: str = "multi-axis",
    rate_hz: float | None = None,
    tell: Told | None = None,
) -> IdentifiedAxes:
    """Identify the loads of several axes from `runs`; `held_out` are only simulated and compared.

    Raises
    ------
    DataError
        one line, where the runs' channels or rates differ, some move one axis and some several, an axis is tested more
        often than another, a load or an axis of it is constant, or the samples are too few.
    """
    say = tell or (lambda done, text: None)
    runs, held_out, groups = check_multiaxis(runs, held_out, rate_hz=rate_hz)
    learned = [one for group in groups for one in learned_from(group)] or list(runs)
    say(0.0, "what to expect")
    early = identify_axes([_part(one, 0.0, _LEARNED) for one in learned], base=base)
    say(0.4, "training")
    model = identify_axes(learned, name=name, base=base)
    say(0.9, "held-out runs")
    predicted = fits(early, [_part(one, _LEARNED, 1.0) for one in learned])
    shown = {name_of(one): fits(model, [one]) for one in held_out}
    still = held_in(runs)
    facts = {f"fit_predicted_{load}": fit for load, fit in predicted.items()}
    return IdentifiedAxes(
        model=replace(model, facts=facts),
        summed=sum(map(len, groups)) if groups else None,
        predicted=predicted,
        trained=fits(model, learned),
        shown=shown,
        outside={name_of(one): model.outside(one) for one in held_out},
        beyond={name_of(one): model.described(one) for one in held_out},
        checks={
            name_of(one): check_superposition(one, group)
            for one in held_out
            for group in groups
            if same_motions(one, superposed(group)) is None
        },
        held=still,
        untried={name_of(one): tuple(axis for axis in still if moves(one.channels[axis])) for one in held_out},
    )


def check_multiaxis(
    runs: Sequence[Run], held_out: Sequence[Run], *, rate_hz: float | None = None
) -> tuple[Sequence[Run], Sequence[Run], list[list[Run]]]:
    """The runs and the held-out runs at one rate, and the single tests among the runs; raises DataError, one line."""
    if not runs:
        raise DataError("no run was given: at least one measured run is needed")
    every = at_one_rate([*runs, *held_out], rate_hz)
    check_axes(every)
    measured = every[: len(runs)]
    groups = single_tests(measured)
    check_moved(measured)
    if not groups:
        check_independent(measured)
    return measured, every[len(runs) :], groups


def main_axis_runs(runs: Sequence[Run]) -> list[Run]:
    """Those of some runs that tell most of the main axis: tests of it alone, else all that move it."""
    largest = largest_of(runs)
    moved = [axes_moved(one, largest) for one in runs]
    alone = [one for one, axes in zip(runs, moved, strict=True) if axes == ["displacement"]]
    return alone or [one for one, axes in zip(runs, moved, strict=True) if "displacement" in axes]


def single_tests(runs: Sequence[Run]) -> list[list[Run]]:
    """Runs that move one axis each, as groups with one test of every axis; none where each moves several.

    The first tests of all axes make the first group, in the order given. Raises DataError, one line.
    """
    largest = largest_of(runs)
    moved = [axes_moved(one, largest) for one in runs]
    for one, axes in zip(runs, moved, strict=True):
        if not axes:
            raise DataError(f"{name_of(one)} moves no axis: leave it out")
    alone = [len(axes) == 1 for axes in moved]
    if not any(alone):
        return []
    if not all(alone):
        first, other = alone.index(True), alone.index(False)
        raise DataError(
            f"{name_of(runs[first])} moves {moved[first][0]} alone, {name_of(runs[other])} "
            f"{' and '.join(moved[other])}: "
            "give tests of single axes or tests of several, hold the others out"
        )
    by_axis: dict[str, list[Run]] = {}
    for one, axes in zip(runs, moved, strict=True):
        by_axis.setdefault(axes[0], []).append(one)
    counts = {axis: len(tests) for axis, tests in by_axis.items()}
    most, least = max(counts, key=counts.__getitem__), min(counts, key=counts.__getitem__)
    if counts[most] > counts[least]:
        raise DataError(
            f"{most} is moved by {counts[most]} runs, {least} by {counts[least]}: give as many tests of each axis"
        )
    return [list(group) for group in zip(*by_axis.values(), strict=True)]


def fits(model: MultiAxis, runs: Sequence[Run]) -> dict[str, float]:
    """The fit of every load over some runs together, %."""
    given = [model.simulate(one) for one in runs]
    out = {}
    for load in model.loads:
        measured = np.concatenate([one.channels[load] for one in runs])
        left = measured - np.concatenate([one[load] for one in given])
        size = float(np.linalg.norm(measured - measured.mean()))
        out[load] = 100.0 * (1.0 - float(np.linalg.norm(left)) / size) if size > 0.0 else float("-inf")
    return out


def _part(run: Run, first: float, last: float) -> Run:
    begin, end = round(first * run.samples), round(last * run.samples)
    channels = {name: values[begin:end] for name, values in run.channels.items()}
    return replace(run, channels=channels, period_samples=0)
