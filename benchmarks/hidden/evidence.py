"""Residuals of the base, of the right names and of their nearest rivals on the pilot runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.hidden.effects import EFFECTS, NEAREST, fits
from benchmarks.hidden.layout import Elements
from benchmarks.hidden.motion import Row
from benchmarks.hidden.scene import LEAST_EXCESS, MOST_EXCESS, Scene, Sized, with_effects
from benchmarks.hidden.sizing import PILOT_SAMPLES, Fit, Free, basis_of, refitted, rms, unabsorbed

MOST_MISMATCH = 0.18  # of the least excess, for one effect


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """Residuals of fits on the pilot runs, in units of the noise."""

    excess: float
    each: tuple[float, ...]
    mismatch: float
    noise_n: float
    fits: tuple[Fit, ...]  # the fit without each effect


def evidence_of(scene: Scene, real: Elements, effects: list[Sized], gains: Row) -> Evidence:
    """Fit the base, and the base with every effect in textbook form; and the latter without each effect."""
    target = scene.pilot.force(real) * np.repeat(gains, PILOT_SAMPLES)
    noise = scene.noise_share * rms(target)
    base = refitted(scene.pilot, target, scene.machine.elements, scene.machine.free)
    full, free = textbook_fit(scene, target, effects) if effects else (base, scene.machine.free)
    lacking = [base] if len(effects) < 2 else [_without(scene, target, full, free, e.element) for e, _ in effects]
    return Evidence(
        excess=rms(base.residual) / noise,
        each=tuple(rms(fit.residual) / noise for fit in lacking) if effects else (),
        mismatch=rms(full.residual) / noise,
        noise_n=noise,
        fits=tuple(lacking),
    )


def textbook_fit(scene: Scene, target: Row, effects: list[Sized]) -> tuple[Fit, Free]:
    """The fit with every right name, and its free parameters."""
    free = scene.machine.free + tuple(place for effect, _ in effects for place in effect.free)
    return refitted(scene.pilot, target, with_effects(scene.machine.elements, effects, textbook=True), free), free


def mismatch_of(scene: Scene, effects: list[Sized]) -> float:
    """Residual rms with the right names, in units of the noise."""
    target = scene.pilot.force(with_effects(scene.real_base, effects, textbook=False))
    return rms(textbook_fit(scene, target, effects)[0].residual) / (scene.noise_share * rms(target))


def _without(scene: Scene, target: Row, full: Fit, free: Free, element: str) -> Fit:
    """The full fit without one effect, the other parameters corrected along their tangents."""
    rest = {name: values for name, values in full.elements.items() if name != element}
    tangents = full.tangents[:, [place[0] != element for place in free]]
    residual = unabsorbed(basis_of(tangents), target - scene.pilot.force(rest))
    return Fit(residual=residual, elements=rest, tangents=tangents)


def is_nameable(evidence: Evidence) -> bool:
    """Whether every hidden effect is visible, and its textbook form explains most of it."""
    count, least = len(evidence.each), min(evidence.each)
    shown = least >= LEAST_EXCESS * (1.0 if count == 1 else 1.1) and evidence.excess <= MOST_EXCESS * count
    return shown and evidence.mismatch <= MOST_MISMATCH * np.sqrt(count) * least


def has_equal_rival(scene: Scene, effects: list[Sized], evidence: Evidence) -> bool:
    """Whether another name of the catalogue would fit nearly as well as a right one."""
    hidden = {effect.element for effect, _ in effects}
    for (effect, _), fit, each in zip(effects, evidence.fits, evidence.each, strict=True):
        tolerance = evidence.mismatch + max(0.5, 0.08 * each)
        rivals = [name for name in NEAREST[effect.element] if name not in hidden and fits(name, scene.machine)]
        if any(_left_by(scene, fit, name) / evidence.noise_n < tolerance for name in rivals):
            return True
    return False


def nearest_name(scene: Scene, evidence: Evidence) -> tuple[str, float]:
    """The element that explains most of an unknown effect, and the share of the gap that it leaves."""
    fit = evidence.fits[0]
    left = {name: _left_by(scene, fit, name) / rms(fit.residual) for name in EFFECTS if fits(name, scene.machine)}
    best = min(left, key=lambda name: left[name])
    return best, left[best]


def _left_by(scene: Scene, fit: Fit, name: str) -> float:
    """Residual rms, N, with the rival added at its best size and shape, to first order."""
    rival = EFFECTS[name](np.random.default_rng(0), scene.machine)
    elements: Elements = {**fit.elements, **rival.sized(1.0, textbook=True)}
    start = scene.pilot.force(fit.elements)
    own = [scene.pilot.force(elements) - start, *scene.pilot.tangents(elements, rival.free).T]
    span = basis_of(np.column_stack([fit.tangents, *own]))
    return rms(unabsorbed(span, fit.residual))
