"""One hidden case: a specimen with an effect that the given model lacks, its runs, and the truth."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from benchmarks.hidden.conditions import STANDARD, Conditions, without_period
from benchmarks.hidden.effects import EFFECTS, compatible, fits
from benchmarks.hidden.evidence import (
    MOST_MISMATCH,
    Evidence,
    evidence_of,
    has_equal_rival,
    is_nameable,
    mismatch_of,
    nearest_name,
)
from benchmarks.hidden.families import FAMILIES, Machine, model_as_given
from benchmarks.hidden.layout import Elements
from benchmarks.hidden.motion import Row
from benchmarks.hidden.rig import Prepared, Sensors, Specimen, prepared, recorded, true_force
from benchmarks.hidden.scene import LEAST_EXCESS, MOST_EXCESS, Scene, Sized, departed, scene_of, sized_on, with_effects
from benchmarks.hidden.sizing import rms
from benchmarks.hidden.unknowns import UNKNOWN_EFFECTS, can_show
from rigctl.runfile import Run

KINDS = ("single", "pair", "triple", "null", "unknown", "wrong_base", "gain_drift")
HIDDEN = {"single": 1, "pair": 2, "triple": 3}
FINE, FINE_CONTACT = 16, 32  # integration steps a sample
NULL_EXCESS = 0.24  # then the refit of the right base leaves at most 1.03 times the noise
LEAST_UNEXPLAINED = 0.35  # share of an unknown effect's gap that no single name of the catalogue may close
ATTEMPTS = 80
UNSTABLE_FORCE = 20.0  # times the force that a machine is built for: beyond, it is unstable


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Input of the workflow (model, runs), and the truth for the evaluation (effects, truth, noise, excess)."""

    seed: int
    kind: str
    base_model: dict[str, object]
    effects: tuple[str, ...]  # catalogue names; empty unless something of the catalogue is hidden
    runs: tuple[Run, ...]
    held_out: tuple[Run, ...]
    truth: tuple[Row, ...]  # noise-free force of each held-out run, N
    noise_n: float  # standard deviation of the noise on the force
    excess: float  # residual rms of the refitted base without noise, in units of the noise
    excess_each: tuple[float, ...]  # the same for each effect when the others are known, in the order of `effects`
    mismatch: float  # the same when the textbook form of every hidden effect is fitted as well
    detail: dict[str, object]  # family, true parameters, kind of the unknown effect, gains


@dataclass(frozen=True, slots=True, kw_only=True)
class Secret:
    """What the given model lacks."""

    real: Elements
    effects: list[Sized]
    gains: Row  # of each run, training first
    evidence: Evidence
    detail: dict[str, object] = field(default_factory=dict)


def case(seed: int, kind: str, conditions: Conditions = STANDARD) -> Case:
    """The case of a seed and kind; the same arguments give the same case.

    Consecutive seeds cover all effects of the catalogue, or all kinds of unknown effects, once in each cycle. Other
    `conditions` are other measurements of the same specimen. Raises ValueError for a kind that is not one of
    KINDS.
    """
    if kind not in KINDS:
        raise ValueError(f"kind is {kind!r}: it must be one of {', '.join(KINDS)}")
    rng, scene, secret = deepcopy(drawn(seed, kind))
    measuring = replace(conditions, without_periods=False)
    made = _measured(rng, seed, kind, *_apply_conditions(measuring, seed, scene, secret))
    if not conditions.without_periods:
        return made
    runs, held_out = (tuple(without_period(run) for run in runs) for runs in (made.runs, made.held_out))
    return replace(made, runs=runs, held_out=held_out)


@lru_cache(maxsize=1)  # one specimen is measured under several conditions
def drawn(seed: int, kind: str) -> tuple[np.random.Generator, Scene, Secret]:
    """The specimen with its hidden effects, and the random generator for the rest."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    for wanted in _names_to_hide(rng, seed, kind):
        machine = _machine_for(rng, wanted)
        if machine is None:
            continue
        scene = scene_of(rng, machine)
        secret = _secret(rng, kind, scene, wanted)
        if secret is not None and not _is_unstable(scene, secret.real):
            return rng, scene, secret
    raise RuntimeError(f"seed {seed}, {kind}: no effect was visible on a machine in {ATTEMPTS} attempts")


def _is_unstable(scene: Scene, real: Elements) -> bool:
    """Whether the motion is unstable: a damping asymmetry exceeds a base curve that saturates.

    No other effect makes the force fall with speed at high speeds, so only this one is simulated to check.
    """
    if "damping_asymmetry" not in real:
        return False
    specimen = Specimen(elements=real, scales=scene.machine.scales)
    experiments = [*scene.training, *scene.held_out]
    runs = [prepared(e, _fine(real), t) for e, t in zip(experiments, scene.hum_turns, strict=True)]
    return any(np.max(np.abs(true_force(specimen, run))) > UNSTABLE_FORCE * scene.machine.force_n for run in runs)


def _fine(real: Elements) -> int:
    """Integration steps a sample."""
    return FINE_CONTACT if "free_play" in real else FINE


def _names_to_hide(rng: np.random.Generator, seed: int, kind: str) -> Iterator[tuple[str, ...]]:
    """Names to hide, one set for each attempt; after half of the attempts the first name changes too."""
    names = list(UNKNOWN_EFFECTS if kind == "unknown" else EFFECTS)
    count = 1 if kind == "unknown" else HIDDEN.get(kind, 0)
    first = names[int(np.random.default_rng(seed // len(names)).permutation(len(names))[seed % len(names)])]
    for attempt in range(ATTEMPTS):
        if attempt >= ATTEMPTS // 2 and attempt % 10 == 0:
            first = names[int(rng.integers(len(names)))]
        yield (first, *_others(rng, first, count - 1)) if count else ()


def _others(rng: np.random.Generator, first: str, count: int) -> tuple[str, ...]:
    chosen: tuple[str, ...] = (first,)
    while len(chosen) <= count:
        name = list(EFFECTS)[int(rng.integers(len(EFFECTS)))]
        if compatible((*chosen, name)):
            chosen = (*chosen, name)
    return chosen[1:]


def _machine_for(rng: np.random.Generator, wanted: tuple[str, ...]) -> Machine | None:
    for _ in range(20):
        machine = FAMILIES[int(rng.integers(len(FAMILIES)))](rng)
        if all(can_show(name, machine) if name in UNKNOWN_EFFECTS else fits(name, machine) for name in wanted):
            return machine
    return None


def _secret(rng: np.random.Generator, kind: str, scene: Scene, wanted: tuple[str, ...]) -> Secret | None:
    """What this kind hides on this machine; None where that is not visible, or looks like another effect."""
    if kind == "unknown":
        return _unknown(rng, scene, wanted[0])
    if kind == "wrong_base":
        return _wrong_base(rng, scene)
    if kind == "gain_drift":
        return _gain_drift(rng, scene)
    if not wanted:
        return _nothing(scene)
    try:
        return _catalogued(rng, scene, wanted)
    except np.linalg.LinAlgError:  # infinite tangents: an unstable machine during the fit
        return None


def _level(scene: Scene) -> Row:
    return np.ones(len(scene.training) + len(scene.held_out))


def _nothing(scene: Scene) -> Secret | None:
    gains = _level(scene)
    evidence = evidence_of(scene, scene.real_base, [], gains[: len(scene.training)])
    if evidence.excess > NULL_EXCESS:
        return None
    return Secret(real=scene.real_base, effects=[], gains=gains, evidence=evidence)


def _gain_drift(rng: np.random.Generator, scene: Scene) -> Secret | None:
    """An amplifier adjusted before each run: gains within one or two per cent of 1, all different."""
    size = len(scene.training) + len(scene.held_out)
    gains = 1.0 + rng.uniform(0.01, 0.02) * rng.permutation(np.linspace(-1.0, 1.0, size))
    evidence = evidence_of(scene, scene.real_base, [], gains[: len(scene.training)])
    return Secret(real=scene.real_base, effects=[], gains=gains, evidence=evidence, detail={"gains": gains.tolist()})


def _wrong_base(rng: np.random.Generator, scene: Scene) -> Secret | None:
    """The machine's damping curve is of another family: a refit leaves two to five times the noise."""
    if scene.machine.family == "hysteretic":
        return None
    gains = _level(scene)
    real = departed(scene, 0.1, rng.uniform(2.2, 4.8))
    evidence = evidence_of(scene, real, [], gains[: len(scene.training)])
    if not 2.0 <= evidence.excess <= 5.0:
        return None
    return Secret(real=real, effects=[], gains=gains, evidence=evidence, detail={"curve": scene.machine.curve})


def _unknown(rng: np.random.Generator, scene: Scene, name: str) -> Secret | None:
    gains = _level(scene)
    sized = sized_on(rng, scene, UNKNOWN_EFFECTS[name](rng, scene.machine))
    if sized is None:
        return None
    real = with_effects(scene.real_base, [sized], textbook=False)
    evidence = evidence_of(scene, real, [], gains[: len(scene.training)])
    if not LEAST_EXCESS <= evidence.excess <= MOST_EXCESS:
        return None
    nearest, left = nearest_name(scene, evidence)
    if left < LEAST_UNEXPLAINED:
        return None
    detail: dict[str, object] = {"unknown": name, "nearest": nearest, "nearest_leaves": left}
    return Secret(real=real, effects=[], gains=gains, evidence=evidence, detail=detail)


def _catalogued(rng: np.random.Generator, scene: Scene, wanted: tuple[str, ...]) -> Secret | None:
    """The wanted effects, each with its own size, together on one machine."""
    effects: list[Sized] = []
    for name in sorted(wanted):
        sized = sized_on(rng, scene, EFFECTS[name](rng, scene.machine))
        if sized is None:
            return None
        effects.append(sized)
    effects = _with_smaller_departures(scene, effects)
    gains = _level(scene)
    real = with_effects(scene.real_base, effects, textbook=False)
    evidence = evidence_of(scene, real, effects, gains[: len(scene.training)])
    if not is_nameable(evidence) or has_equal_rival(scene, effects, evidence):
        return None
    return Secret(real=real, effects=effects, gains=gains, evidence=evidence)


def _with_smaller_departures(scene: Scene, effects: list[Sized]) -> list[Sized]:
    """The effects, with departures halved where these are too large for the right names to close the gap."""
    for _ in range(2):
        if mismatch_of(scene, effects) <= MOST_MISMATCH * np.sqrt(len(effects)) * 1.2 * LEAST_EXCESS:
            break
        effects = [(replace(effect, departure=0.5 * effect.departure), multiple) for effect, multiple in effects]
    return effects


def _apply_conditions(conditions: Conditions, seed: int, scene: Scene, secret: Secret) -> tuple[Scene, Secret]:
    """The scene and its secret under the conditions; random draws here do not affect other cases."""
    if conditions == STANDARD:
        return scene, secret
    scene = conditions.measured(scene, np.random.default_rng([seed, 99]))
    gains = np.ones(len(scene.training) + len(scene.held_out))
    return scene, replace(secret, gains=gains, real=conditions.departed(scene, secret.real))


def _measured(rng: np.random.Generator, seed: int, kind: str, scene: Scene, secret: Secret) -> Case:
    """Simulate and record the whole campaign on the real specimen."""
    specimen = Specimen(elements=secret.real, scales=scene.machine.scales)
    experiments = [*scene.training, *scene.held_out]
    runs = [prepared(e, _fine(secret.real), turns) for e, turns in zip(experiments, scene.hum_turns, strict=True)]
    truth = [gain * true_force(specimen, run) for gain, run in zip(secret.gains, runs, strict=True)]
    trained = len(scene.training)
    noise = scene.noise_share * rms(np.concatenate(truth[:trained]))
    given = model_as_given(rng, scene.machine)
    records = _records(rng, f"specimen-{seed}", scene, runs, truth, noise)
    family: dict[str, object] = {
        "family": scene.machine.family,
        "elements": {e: dict(v) for e, v in secret.real.items()},
    }
    return Case(
        seed=seed,
        kind=kind,
        base_model=given,
        effects=tuple(effect.element for effect, _ in secret.effects),
        runs=records[:trained],
        held_out=records[trained:],
        truth=tuple(truth[trained:]),
        noise_n=noise,
        excess=secret.evidence.excess,
        excess_each=secret.evidence.each,
        mismatch=secret.evidence.mismatch if secret.effects else 0.0,
        detail={**family, **secret.detail},
    )


def _records(
    rng: np.random.Generator, name: str, scene: Scene, runs: list[Prepared], truth: list[Row], noise: float
) -> tuple[Run, ...]:
    envelope = scene.machine.envelope
    sensors = Sensors(
        specimen=name,
        force_n=noise,
        stroke_m=envelope.stroke_m,
        current_a=envelope.current_a[1] if envelope.current_a else 0.0,
    )
    trained, held = len(scene.training), len(scene.held_out)
    names = [f"{name}-train-{n}" for n in range(trained)] + [f"{name}-held-{n}" for n in range(held)]
    return tuple(
        recorded(rng, sensors, experiment, run, force, run_id)
        for experiment, run, force, run_id in zip([*scene.training, *scene.held_out], runs, truth, names, strict=True)
    )
