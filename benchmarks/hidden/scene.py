"""A machine with its campaign, and effects sized to be visible in it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.hidden.effects import Effect
from benchmarks.hidden.families import Machine
from benchmarks.hidden.layout import Elements
from benchmarks.hidden.motion import Experiment, Row, campaign
from benchmarks.hidden.sizing import Pilot, basis_of, pilot_of, rms, unabsorbed

LEAST_EXCESS, MOST_EXCESS = 3.0, 13.0
LARGEST_SHARE = 0.8  # of the base force's rms that one effect may add
LARGEST_DEPARTURE = 0.8
LEAST_ON_HELD_OUT = 2.0  # times the noise

Sized = tuple[Effect, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A machine with its campaign, and what is needed to size hidden effects."""

    machine: Machine
    training: list[Experiment]
    held_out: list[Experiment]
    hum_turns: Row
    pilot: Pilot
    held_pilot: Pilot
    base_force: Row
    basis: NDArray[np.float64]  # orthonormal columns that span the base's tangents
    noise_share: float
    real_base: Elements  # the base with its small departure from the textbook form

    def unabsorbed_and_added(self, elements: Elements) -> tuple[float, float]:
        """(rms outside the base's tangents in units of the noise, rms added in units of the base force)."""
        force = self.pilot.force(elements)
        difference = force - self.base_force
        noise = self.noise_share * rms(force)
        return rms(unabsorbed(self.basis, difference)) / noise, rms(difference) / rms(self.base_force)


def scene_of(rng: np.random.Generator, machine: Machine) -> Scene:
    """Draw a campaign for the machine, and the tangents of its base model in it."""
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
        held_pilot=pilot_of(held_out, turns[len(training) :], machine.scales),
        base_force=base_force,
        basis=basis,
        noise_share=rng.uniform(0.006, 0.012),
        real_base=machine.elements,
    )
    return replace(scene, real_base=departed(scene, 0.02, rng.uniform(0.05, 0.18)))


def departed(scene: Scene, departure: float, target: float) -> Elements:
    """The base with a departure of its curve at which a refit leaves `target` times the noise."""
    curve = scene.machine.curve
    for _ in range(4):
        elements = {**scene.machine.elements, curve: {**scene.machine.elements[curve], "departure": departure}}
        left, _ = scene.unabsorbed_and_added(elements)
        departure = min(departure * float(np.clip(target / max(left, 1e-9), 0.1, 8.0)), LARGEST_DEPARTURE)
    return elements


def sized_on(rng: np.random.Generator, scene: Scene, effect: Effect) -> Sized | None:
    """The effect, and its multiple at which a refit of the base leaves 3.5 to 10 times the noise."""
    target = float(np.exp(rng.uniform(np.log(3.6), np.log(10.0))))
    multiple, tried = 1.0, 1.0
    left = share = 0.0
    for _ in range(7):
        tried = multiple
        left, share = scene.unabsorbed_and_added({**scene.real_base, **effect.sized(tried)})
        if abs(left / target - 1.0) < 0.1 and share < LARGEST_SHARE:
            break
        multiple = min(tried * float(np.clip(target / max(left, 1e-6), 0.15, 6.0)), effect.largest)
    shows = 1.05 * LEAST_EXCESS < left < MOST_EXCESS and share < LARGEST_SHARE
    return (effect, tried) if shows and _shows_on_held_out(scene, effect, tried) else None


def _shows_on_held_out(scene: Scene, effect: Effect, multiple: float) -> bool:
    """Whether the effect changes the force of the held-out runs by at least twice the noise."""
    before = scene.held_pilot.force(scene.real_base)
    after = scene.held_pilot.force({**scene.real_base, **effect.sized(multiple)})
    return rms(after - before) > LEAST_ON_HELD_OUT * scene.noise_share * rms(scene.base_force)


def with_effects(base: Elements, effects: list[Sized], *, textbook: bool) -> Elements:
    """The base with the effects at their sizes, real or in the textbook form."""
    elements = dict(base)
    for effect, multiple in effects:
        elements.update(effect.sized(multiple, textbook=textbook))
    return elements
