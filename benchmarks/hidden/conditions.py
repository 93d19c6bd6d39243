"""Conditions of measurement: noise, number and kind of runs, error of the base curve."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.hidden.layout import Elements
from benchmarks.hidden.motion import extra_run, sines
from benchmarks.hidden.scene import Scene, departed
from rigctl.runfile import Run

_REACHED = 0.75  # of the residual that was asked for
_CREEP = 2e-3  # of the rms travel in a run: a period of it repeats no more, and no force changes visibly


class OutOfReach(ValueError):
    """These conditions are not possible on this machine."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """How a case is measured; None: as by default. The specimen and the size of its effect stay the same."""

    noise_share: float | None = None  # of the force's rms
    runs: int | None = None  # training runs
    sines_only: bool = False  # in training; the held-out runs stay
    base_error: float | None = None  # residual of a refit of the departed base curve, in units of the usual noise
    without_periods: bool = False  # the same samples, of which the file states no period and a search finds none

    def measured(self, scene: Scene, rng: np.random.Generator) -> Scene:
        """The scene with the noise and the training runs of these conditions."""
        envelope, count = scene.machine.envelope, self.runs or len(scene.training)
        training = list(scene.training)
        if self.sines_only:
            training = sines(rng, envelope, count)
        elif self.runs is not None:
            while len(training) < count:
                training.append(extra_run(rng, envelope))
            training = [training[k] for k in rng.permutation(len(training))[:count]]
        turns = np.concatenate([rng.uniform(size=len(training)), scene.hum_turns[len(scene.training) :]])
        return replace(
            scene,
            training=training,
            hum_turns=turns,
            noise_share=scene.noise_share if self.noise_share is None else self.noise_share,
        )

    def departed(self, scene: Scene, real: Elements) -> Elements:
        """The specimen with its base curve as far from the textbook's as these conditions say; raises OutOfReach."""
        if self.base_error is None:
            return real
        usual = replace(scene, noise_share=0.009)  # the mean over cases, not the noise of these conditions
        curve = scene.machine.curve
        elements = departed(usual, 0.1, self.base_error)
        if usual.unabsorbed_and_added(elements)[0] < _REACHED * self.base_error:
            raise OutOfReach(f"{curve} of this machine can't depart so far that {self.base_error:g} × noise is left")
        departure = elements[curve]["departure"]
        return {**real, curve: {**real[curve], "departure": departure}}


STANDARD = Conditions()


def without_period(run: Run) -> Run:
    """The run without its stated period, and with a displacement sensor that creeps, so that none is found."""
    x = run.channels["displacement"]
    crept = x + _CREEP * float(np.std(x)) * np.linspace(-0.5, 0.5, x.size)
    return replace(run, period_samples=0, channels={**run.channels, "displacement": crept})
