"""One hidden case: a specimen with something the user's simulation lacks, its runs, and the truth about it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.hidden.effects import EFFECTS, Effect, compatible, fits
from benchmarks.hidden.families import FAMILIES, Machine, model_as_given
from benchmarks.hidden.layout import Elements
from benchmarks.hidden.motion import Experiment, Row, campaign
from benchmarks.hidden.rig import Prepared, Sensors, Specimen, prepared, recorded, true_force
from benchmarks.hidden.sizing import Pilot, basis_of, pilot_of, refitted, rms, unabsorbed
from rigctl.runfile import Run

KINDS = ("single", "pair", "triple", "null", "unknown", "wrong_base", "gain_drift")
HIDDEN = {"single": 1, "pair": 2, "triple": 3}
FINE, FINE_CONTACT = 16, 32
LEAST_EXCESS, MOST_EXCESS = 3.0, 13.0
LARGEST_SHARE = 0.8  # of the base force's rms that one effect may add
MACHINES_TRIED = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """What the workflow is given (model, runs), and what only the judge knows (effects, truth, noise, excess)."""

    seed: int
    kind: str
    base_model: dict[str, object]
    effects: tuple[str, ...]  # catalogue names; empty unless something of the catalogue is hidden
    runs: tuple[Run, ...]
    held_out: tuple[Run, ...]
    truth: tuple[Row, ...]  # noise-free force of each held-out run, N
    noise_n: float  # standard deviation of the noise on the force
    excess: float  # rms that a refit of the base leaves, in units of the noise; noise not counted
    excess_each: tuple[float, ...]  # the same for each effect when the others are known
    mismatch: float  # the same when the textbook form of every hidden effect is fitted too
    detail: dict[str, object]  # family, true parameters, kind of the unknown effect, gains


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A machine on its campaign, with the tools that size what is hidden in it."""

    machine: Machine
    training: list[Experiment]
    held_out: list[Experiment]
    hum_turns: Row
    pilot: Pilot
    base_force: Row
    basis: Row
    noise_share: float
    real_base: Elements  # the base with its small departure from the textbook

    def leaves(self, elements: Elements) -> tuple[float, float]:
        """(rms outside the base's tangents in units of the noise, rms added in units of the base force)."""
        force = self.pilot.force(elements)
        difference = force - self.base_force
        noise = self.noise_share * rms(force)
        return rms(unabsorbed(self.basis, difference)) / noise, rms(difference) / rms(self.base_force)


def case(seed: int, kind: str) -> Case:
    """Draw the case that belongs to this seed and kind, always the same."""
    if kind not in KINDS:
        raise ValueError(f"kind is {kind!r}: it must be one of {', '.join(KINDS)}")
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    for wanted in _wishes(rng, seed, kind):
        found = _attempt(rng, seed, kind, wanted)
        if found is not None:
            return found
    raise RuntimeError(f"seed {seed}, {kind}: no machine showed the effect in {MACHINES_TRIED} attempts")


def _wishes(rng: np.random.Generator, seed: int, kind: str) -> Iterator[tuple[str, ...]]:
    """Names to hide, one set for each attempt: every element comes first once in each round of seeds."""
    names = list(EFFECTS)
    first = names[int(np.random.default_rng(seed // len(names)).permutation(len(names))[seed % len(names)])]
    for attempt in range(MACHINES_TRIED):
        count = HIDDEN.get(kind, 0)
        if count and attempt == MACHINES_TRIED // 2:
            first = names[int(rng.integers(len(names)))]
        yield (first, *_others(rng, first, count - 1)) if count else ()


def _others(rng: np.random.Generator, first: str, count: int) -> tuple[str, ...]:
    chosen: tuple[str, ...] = (first,)
    while len(chosen) <= count:
        name = list(EFFECTS)[int(rng.integers(len(EFFECTS)))]
        if compatible((*chosen, name)):
            chosen = (*chosen, name)
    return chosen[1:]


def _attempt(rng: np.random.Generator, seed: int, kind: str, wanted: tuple[str, ...]) -> Case | None:
    machine = FAMILIES[int(rng.integers(len(FAMILIES)))](rng)
    if not all(fits(name, machine) for name in wanted):
        return None
    scene = _scene(rng, machine)
    effects = [_sized(rng, scene, EFFECTS[name](rng, machine)) for name in wanted]
    if any(effect is None for effect in effects):
        return None
    return _finished(rng, seed, kind, scene, [effect for effect in effects if effect is not None])


def _scene(rng: np.random.Generator, machine: Machine) -> Scene:
    training, held_out = campaign(rng, machine.envelope)
    turns = rng.uniform(size=len(training) + len(held_out))
    pilot = pilot_of(training, turns[: len(training)], machine.scales)
    base_force = pilot.force(machine.elements)
    basis = basis_of(pilot.tangents(machine.elements, machine.free))
    scene = Scene(
        machine=machine,
        training=training,
        held_out=held_out,
        hum_turns=turns,
        pilot=pilot,
        base_force=base_force,
        basis=basis,
        noise_share=rng.uniform(0.006, 0.012),
        real_base=machine.elements,
    )
    return replace(scene, real_base=_departed(scene, 0.02, rng.uniform(0.05, 0.18)))


def _departed(scene: Scene, departure: float, target: float) -> Elements:
    """The base with its curve departed from the textbook until the refit leaves `target` times the noise."""
    curve = scene.machine.curve
    for _ in range(4):
        elements = {**scene.machine.elements, curve: {**scene.machine.elements[curve], "departure": departure}}
        left, _ = scene.leaves(elements)
        departure = min(departure * float(np.clip(target / max(left, 1e-9), 0.1, 8.0)), 0.8)
    return elements


def _sized(rng: np.random.Generator, scene: Scene, effect: Effect) -> tuple[Effect, float] | None:
    """The effect with the multiple at which a refit of the base leaves between 3.5 and 10 times the noise."""
    target = float(np.exp(rng.uniform(np.log(3.6), np.log(10.0))))
    multiple = 1.0
    for _ in range(7):
        left, share = scene.leaves({**scene.real_base, **effect.sized(multiple)})
        if abs(left / target - 1.0) < 0.1 and share < LARGEST_SHARE:
            return effect, multiple
        multiple = min(multiple * float(np.clip(target / max(left, 1e-6), 0.15, 6.0)), effect.largest)
    return (effect, multiple) if left > 1.05 * LEAST_EXCESS and left < MOST_EXCESS and share < LARGEST_SHARE else None


def _finished(
    rng: np.random.Generator, seed: int, kind: str, scene: Scene, effects: list[tuple[Effect, float]]
) -> Case | None:
    real: Elements = dict(scene.real_base)
    for effect, multiple in effects:
        real = {**real, **effect.sized(multiple)}
    target = scene.pilot.force(real)
    noise = scene.noise_share * rms(target)
    base, free = scene.machine.elements, scene.machine.free
    excess = rms(refitted(scene.pilot, target, base, free, 2)[0]) / noise
    each, mismatch = _evidence(scene, effects, target, noise)
    if effects and not (min(each) >= LEAST_EXCESS and mismatch <= 0.3 * min(each)):
        return None
    if not effects and kind == "null" and excess > 0.24:
        return None
    return _measured(rng, seed, kind, scene, real, [e.element for e, _ in effects], (excess, each, mismatch))


def _evidence(
    scene: Scene, effects: list[tuple[Effect, float]], target: Row, noise: float
) -> tuple[tuple[float, ...], float]:
    """What each effect leaves when only it is missing, and what is left when none is, in units of the noise."""
    textbook, free = dict(scene.machine.elements), scene.machine.free
    for effect, multiple in effects:
        textbook.update(effect.sized(multiple, textbook=True))
        free += effect.free
    residual, fitted = refitted(scene.pilot, target, textbook, free, 1)
    each = []
    for effect, _ in effects:
        without = {name: values for name, values in fitted.items() if name != effect.element}
        kept = tuple(place for place in free if place[0] != effect.element)
        each.append(rms(refitted(scene.pilot, target, without, kept, 1)[0]) / noise)
    return tuple(each), rms(residual) / noise


def _measured(
    rng: np.random.Generator,
    seed: int,
    kind: str,
    scene: Scene,
    real: Elements,
    names: list[str],
    figures: tuple[float, tuple[float, ...], float],
) -> Case:
    fine = FINE_CONTACT if "free_play" in real else FINE
    specimen = Specimen(elements=real, scales=scene.machine.scales)
    experiments = [*scene.training, *scene.held_out]
    runs = [prepared(e, fine, turns) for e, turns in zip(experiments, scene.hum_turns, strict=True)]
    truth = [true_force(specimen, run) for run in runs]
    trained = len(scene.training)
    noise = scene.noise_share * rms(np.concatenate(truth[:trained]))
    given = model_as_given(rng, scene.machine)
    records = _records(rng, seed, kind, scene, experiments, runs, truth, noise)
    return Case(
        seed=seed,
        kind=kind,
        base_model=given,
        effects=tuple(sorted(names)),
        runs=records[:trained],
        held_out=records[trained:],
        truth=tuple(truth[trained:]),
        noise_n=noise,
        excess=figures[0],
        excess_each=figures[1],
        mismatch=figures[2],
        detail={"family": scene.machine.family, "elements": {e: dict(v) for e, v in real.items()}},
    )


def _records(
    rng: np.random.Generator,
    seed: int,
    kind: str,
    scene: Scene,
    experiments: list[Experiment],
    runs: list[Prepared],
    truth: list[Row],
    noise: float,
) -> tuple[Run, ...]:
    envelope = scene.machine.envelope
    sensors = Sensors(
        specimen=f"{kind}-{seed}",
        force_n=noise,
        stroke_m=envelope.stroke_m,
        current_a=envelope.current_a[1] if envelope.current_a else 0.0,
    )
    trained = len(scene.training)
    names = [f"{kind}-{seed}-train-{n}" for n in range(trained)] + [
        f"{kind}-{seed}-held-{n}" for n in range(len(runs) - trained)
    ]
    return tuple(
        recorded(rng, sensors, experiment, run, force, name)
        for experiment, run, force, name in zip(experiments, runs, truth, names, strict=True)
    )
