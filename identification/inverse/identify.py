"""Identifies an inverse: a network that gives the measured current from motion and force, checked by tracking."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.choose import Judged
from identification.blackbox.duplicates import check_copies
from identification.blackbox.given import Base, candidates_for, check_long_enough
from identification.blackbox.model import BlackBox, check_rate
from identification.blackbox.networks import networks
from identification.blackbox.preparation import at_one_rate, course_of, is_constant, learnable
from identification.blackbox.samples import Course
from identification.blackbox.structure import FORCE, MODEL, Structure
from identification.compute.blas import one_blas_thread
from identification.errors import DataError
from identification.inverse.model import Inverse, changed_course
from identification.inverse.reach import Limits, check_controlled, reach_of
from identification.inverse.recipe import RECIPE, swapped
from identification.inverse.tracking import Tracking, track
from identification.inverse.wanted import Wanted, wanted_of
from identification.models.inputs import MEASURED
from identification.models.protocol import SimulationModel
from identification.models.simulation import name_of
from identification.record import check_measured
from rigctl.runfile import Run

Floats = NDArray[np.float64]
Told = Callable[[float, str], None]

# Share of its rms that the whole range of the current must change the force by for a sample to be learned from: near
# the reversals the force says nothing about the current. Half and double: some more and some fewer of these samples.
_TELLS = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedInverse:
    """A learned inverse and what was seen on the way.

    `predicted` is the fit of the current, %, that cross-validation expects on unseen runs where the force depends on
    it. `learned` and `inverted` hold, for each run (held-out ones where there are any), the tracking of its measured
    force by the network and by inversion of the forward model.
    """

    model: Inverse
    judged: tuple[Judged, ...]
    predicted: float
    learned: Mapping[str, Tracking]
    inverted: Mapping[str, Tracking]

    @property
    def best(self) -> str:
        """What cross-validation chose, in the names of an inverse."""
        structure = self.judged[0].candidate.structure
        return f"{' '.join(swapped(str(one)) for one in structure.regressors)}, {structure.nodes} nodes"


@one_blas_thread()
def identify_inverse(
    runs: Sequence[Run],
    forward: Base,
    *,
    held_out: Sequence[Run] = (),
    name: str = "",
    structures: Sequence[Structure] = (),
    rate_hz: float | None = None,
    tell: Told | None = None,
) -> IdentifiedInverse:
    """Learn the current of runs from their motion and force, and check it with a forward model.

    The training is that of an output-error network whose output is the current. `structures` take the place of those
    that are tried by default. The limits are the lowest and the highest current of the training.

    Raises
    ------
    DataError
        one line, where there is no run or two are of different rates, a run has no current, the current is the same in
        all, the forward model has no current among its inputs, or the samples are too few.
    """
    runs, held_out = inverse_runs(runs, held_out, forward.model, structures=structures, rate_hz=rate_hz)
    measured = [name for name in MEASURED if name in forward.model.inputs]
    courses = [course_of(one, measured) for one in runs]
    check_long_enough(courses)
    limits = _limits(courses)
    told = [_told(one, forward, limits) for one in courses]
    if not any(one.counted.any() for one in told):
        raise DataError(
            f"within [{limits.low:g}, {limits.high:g}] A the current changes the force of '{forward.model.name}' by "
            f"less than {100.0 * _TELLS:g} % of its rms at every sample: nothing tells the current; give runs "
            "of a wider range of it, or another forward model"
        )
    changed = [changed_course(one) for one in told]
    say = tell or (lambda done, text: None)
    network, judged, _ = networks(RECIPE, candidates_for(RECIPE, changed, structures, ()), changed, say)
    kept = tuple(one for one in measured if one in network.signals)
    model = Inverse(
        name=name or "inverse",
        network=replace(network, name=name or "inverse", kind="nnoe", measured=kept),
        limits=limits,
        forward=forward.model,
        forward_file=forward.file,
    )
    return _checked(model, judged, changed, held_out or runs, tracked_held_out=bool(held_out))


def inverse_runs(
    runs: Sequence[Run],
    held_out: Sequence[Run] = (),
    forward: SimulationModel | None = None,
    *,
    structures: Sequence[Structure] = (),
    rate_hz: float | None = None,
) -> tuple[Sequence[Run], Sequence[Run]]:
    """Training and held-out runs at one rate, from which an inverse can be learned.

    Raises DataError as `identify_inverse` does, SimulationError where `forward` has another sample rate.
    """
    if forward is not None:
        check_controlled(forward)
    if not runs:
        raise DataError("no run was given: at least one measured run is needed")
    runs, _ = learnable(runs)
    every = at_one_rate([*runs, *held_out], rate_hz)
    for structure in structures:
        if "current" not in structure.signals:  # its force and its current have changed places
            raise DataError("regressors hold no wanted force F: an inverse needs one, such as F0")
        if MODEL in structure.signals:
            raise DataError("regressors hold M, the force of a base: only a hybrid has one")
    for one in every:
        if "current" not in one.channels:
            raise DataError(f"{name_of(one)} has no control current: an inverse is learned from it; leave the run out")
    for one in every:
        check_measured(one)
    _limits([course_of(one, ()) for one in every[: len(runs)]])
    check_copies(runs, ("current",))
    if isinstance(forward, BlackBox):
        check_rate(forward.name, forward.dt, 1.0 / every[0].sample_rate_hz)
    return every[: len(runs)], every[len(runs) :]


def _limits(courses: Sequence[Course]) -> Limits:
    low, high = (float(f([f(one.motion.i) for one in courses])) for f in (np.min, np.max))
    if is_constant(low, high):
        raise DataError(f"current is {low:g} A in all runs: an inverse is learned from runs at two currents or more")
    return Limits(low, high)


def _told(course: Course, forward: Base, limits: Limits) -> Course:
    """The course in which those samples count whose force tells the current."""
    wanted = Wanted(name="training", motion=replace(course.motion, period=0, settle=0), force=course.force)
    reach = reach_of(forward.model, wanted, limits, levels=2)
    return replace(course, counted=course.counted & (reach.span > _TELLS * reach.size))


def _checked(
    model: Inverse, judged: Sequence[Judged], changed: Sequence[Course], shown: Sequence[Run], *, tracked_held_out: bool
) -> IdentifiedInverse:
    """The model with its figures: of the current by cross-validation, and of the tracking on runs."""
    wanted = [wanted_of(one, model.forward, "force") for one in shown]
    learned = {one.name: track(model, one) for one in wanted}
    inverted = {one.name: track(model, one, learned=False) for one in wanted}
    told = np.concatenate([one.force[one.counted] for one in changed])
    spread = float(np.std(told))
    predicted = 100.0 * (1.0 - math.sqrt(judged[0].error) * model.network.scales[FORCE].size / spread)
    which = "held_out" if tracked_held_out else "trained"
    facts = {
        "fit_current_predicted": predicted,
        f"fit_tracked_{which}": float(np.mean([one.fit for one in learned.values()])),
        f"fit_inverted_{which}": float(np.mean([one.fit for one in inverted.values()])),
    }
    return IdentifiedInverse(
        model=replace(model, facts=facts),
        judged=tuple(judged),
        predicted=predicted,
        learned=learned,
        inverted=inverted,
    )
