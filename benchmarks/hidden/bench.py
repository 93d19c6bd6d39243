"""A hidden specimen on a simulated rig that plays any excitation and returns the run."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.hidden.case import FINE, FINE_CONTACT, Case, case, drawn
from benchmarks.hidden.motion import LEAD_SAMPLES, RATE_HZ, Envelope, Experiment, drifting_temperature
from benchmarks.hidden.rig import Sensors, Specimen, prepared, recorded, true_force
from excitation.signal import Excitation
from rigctl.runfile import Run

REACH_HZ = 120.0  # bandwidth of the actuator: a triangle has no higher harmonics


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """The specimen of a case, and the limits of its rig."""

    case: Case
    specimen: Specimen
    envelope: Envelope

    def play(self, excitation: Excitation, number: int) -> Run:
        """The run of an excitation at 1 kHz; another `number` has other noise and another temperature."""
        if excitation.sample_rate_hz != RATE_HZ:
            raise ValueError(f"sample rate is {excitation.sample_rate_hz} Hz: this rig plays {RATE_HZ:g} Hz")
        rng = np.random.default_rng([self.case.seed, 7, number])
        experiment = _experiment(rng, excitation, passive=self.envelope.current_a is None)
        fine = FINE_CONTACT if "free_play" in self.specimen.elements else FINE
        run = prepared(experiment, fine, float(rng.uniform()))
        current = self.envelope.current_a[1] if self.envelope.current_a else 0.0
        sensors = Sensors(
            specimen=f"specimen-{self.case.seed}",
            force_n=self.case.noise_n,
            stroke_m=self.envelope.stroke_m,
            current_a=current,
        )
        return recorded(rng, sensors, experiment, run, true_force(self.specimen, run), f"asked-{number}")


def bench(seed: int, kind: str) -> Bench:
    """The specimen of the case that belongs to this seed and kind, in its rig."""
    one = case(seed, kind)
    _, scene, secret = deepcopy(drawn(seed, kind))
    specimen = Specimen(elements=secret.real, scales=scene.machine.scales)
    return Bench(case=one, specimen=specimen, envelope=scene.machine.envelope)


def _experiment(rng: np.random.Generator, excitation: Excitation, *, passive: bool) -> Experiment:
    """The excitation as the rig's motion: displacement limited to the actuator's bandwidth, current unchanged."""
    samples = excitation.samples
    period = excitation.period_samples or samples
    lines = 2.0 * np.fft.rfft(excitation.displacement_m[samples - period :]) / period
    lines[0] *= 0.5
    harmonics = min(int(REACH_HZ * period / RATE_HZ), lines.size - 1) + 1
    current = np.empty(0)
    if not passive:
        row = excitation.current_a if excitation.current_a is not None else np.zeros(samples)
        current = np.concatenate([np.full(LEAD_SAMPLES, row[0]), row])
    one = Experiment(
        kind=str(excitation.kind),
        lines=lines[:harmonics],
        period_samples=period,
        samples=samples,
        periodic=excitation.period_samples > 0,
        current=current,
        temperature=np.empty(0),
    )
    return replace(one, temperature=drifting_temperature(rng, samples, rng.uniform(15.0, 58.0)))
