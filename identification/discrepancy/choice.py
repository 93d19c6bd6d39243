"""One trial of a name, and the choice: the best name among those that were tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.criteria import CHANCE, FORM
from identification.discrepancy.excess import may_wander
from identification.fitting.leastsquares import Fit
from identification.physical.elements import Curve, ParameterSpec, Surroundings
from identification.physical.model import Element, Parameter, denies_its_name


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """A model with one more element, everything fitted again."""

    id: str  # of the element in the fitted model
    fit: Fit
    excess: float  # whitened residual energy beyond the noise
    contribution: float  # whitened energy of what the element adds
    formed: float  # of that, what has a form; see `form_energy`
    parameters: int
    means_left: float  # of the excess, what the mean forces of the runs leave
    screened: float  # the share of the residual that its signature explains
    closed: float  # whitened energy by which it lowers the excess
    measured: float  # whitened energy of the measured force
    force: float  # the measured force, N rms
    stroke: float  # the longest, m
    swing: float  # the largest of the current within one record, A
    speed: float  # rms, m/s
    slow: float  # the lowest typical one, m/s
    current: float  # mean, A

    @property
    def own(self) -> Element:
        """The element as fitted."""
        return self.fit.model.element(self.id)

    @property
    def name(self) -> str:
        """Name of the element."""
        return self.own.name


def choose(found: Sequence[Trial]) -> Trial | None:
    """The simplest of those that explain the data as well as a canonical form can be expected to, if any."""
    refusals = (on_bound, contradicts_itself, overpowers, is_mistaken)
    physical = [t for t in found if not any(no(t) for no in refusals)]
    if not physical:
        return None
    best = min(physical, key=lambda t: t.excess)
    equal = [t for t in physical if t.excess <= best.excess + allowance(best, t)]
    return min(equal, key=lambda t: (complexity(t), t.excess))


def allowance(best: Trial, other: Trial) -> float:
    """Whitened energy by which another may fit worse than the best and still be as likely the cause.

    Friction that falls with speed is the likelier cause where it leaves half of what friction without a fall leaves:
    how friction builds up, in which the forms of friction differ, is free in both. Not so a hysteresis beside a
    presliding friction, which is its limit: real frictions leave up to the whole tolerance there.

    A constant force that differs from run to run, as the zero of a load cell does, is the likelier cause where another
    element is the better one only in the runs' mean forces; see `may_wander`.
    """
    form = tolerance(best) + CHANCE.slack
    richer, limit = best.own.spec, other.own.spec
    if limit.constant_force:
        form += may_wander(max(other.means_left - best.means_left, 0.0), other.contribution)
    falls = richer.dry_friction and richer.falls_with_speed and limit.dry_friction and not limit.falls_with_speed
    if falls:
        built_up = FORM.build_up**2 * min(best.formed, best.closed)
        return min(form, max(built_up, max(best.excess, 0.0) + CHANCE.at_noise * best.fit.samples))
    return form


def tolerance(trial: Trial) -> float:
    """Whitened energy by which a simpler form may fit worse and still be the better name."""
    return max(own_form(trial), FORM.minor * max(trial.excess, 0.0))


def own_form(trial: Trial) -> float:
    """Whitened energy by which a real effect may depart from the form of its element.

    A share of what the element closes, not of its whole force: most of that may only trade places with the base.
    """
    return FORM.tolerance**2 * min(trial.formed, trial.closed)


def complexity(trial: Trial) -> float:
    """Free parameters, one more for a whole damping curve beside that of the base, and one for unlikely values."""
    whole = trial.own.spec.curve == Curve.WHOLE
    return trial.parameters + (1.0 if whole else 0.0) + (1.0 if is_unlikely(trial) else 0.0)


def is_unlikely(trial: Trial) -> bool:
    """Whether another element that fits alike is the likelier one with the values of this fit."""
    own = trial.own
    return own.spec.unlikely is not None and own.spec.unlikely(own.values(), _around(trial))


def contradicts_itself(trial: Trial) -> bool:
    """Whether the fit made of the element what its name denies, such as a Stribeck curve that rises."""
    return denies_its_name(trial.own, trial.fit.model)


def overpowers(trial: Trial) -> bool:
    """Whether a force of its own is several times the measured one: most of it then cancels what the base took on."""
    spec = trial.own.spec
    parallel = spec.path == "core" and not spec.modifier
    return parallel and trial.contribution > FORM.disproportionate**2 * trial.measured


def is_mistaken(trial: Trial) -> bool:
    """Whether the fit made of the element what another one is, such as a play that only gives way."""
    own = trial.own
    return own.spec.mistaken is not None and own.spec.mistaken(own.values(), _around(trial))


def _around(trial: Trial) -> Surroundings:
    own = trial.own
    return Surroundings(
        others=[e.spec for e in trial.fit.model.elements if e is not own], force=trial.force, stroke=trial.stroke,
        swing=trial.swing, speed=trial.speed, slow=trial.slow, current=trial.current,
    )  # fmt: skip


def _top(p: Parameter, spec: ParameterSpec) -> float:
    """The bound or limit above a parameter that no case of the element means."""
    high = spec.high if p.high is None else p.high
    return np.inf if spec.high_is_meant else high


def on_bound(trial: Trial) -> bool:
    """Whether the fit left the new element without effect: its strength or its only parameter on a bound."""
    own = trial.own
    vital = [
        (p.value, spec.low if p.low is None else p.low, _top(p, spec))
        for p, spec in zip(own.parameters, own.spec.parameters, strict=True)
        if not p.fixed and not spec.refinement and not spec.bound_is_meant
    ]
    return any(value <= low or value >= high for value, low, high in vital) or trial.contribution <= 0.0
