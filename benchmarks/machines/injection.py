"""A known effect added to measured runs: the machine is real, what was added is known.

An effect on the force is added to it; a bush or a joint in series adds its stretch under the measured force to the
displacement. An effect is identifiable where a refit of the base leaves more on held-out runs than without the effect,
by three deviations of the noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.machines import channels, outside
from benchmarks.machines import effects as lack
from benchmarks.machines.bases import Base, BaseElement, Seen, force_of_base, joined, model_file, refitted
from benchmarks.machines.case import Hidden
from benchmarks.machines.effect import Effect, Rng, Scale
from benchmarks.machines.measured import MeasuredSet, motion_of, noise_of, seen_of
from benchmarks.machines.recording import CHAIN_NAMES, Chain, drawn_luck, sensed
from benchmarks.machines.simulation import Motion, force_of
from benchmarks.machines.sizing import MOST_SAMPLES, Campaign, rms, shown
from rigctl.runfile import Run

LEAST_GAIN = 3.0  # noise deviations between what the base leaves with and without the effect
MOST_RUNS = 5  # for training
OFFERED: tuple[Effect, ...] = (
    lack.gas(), lack.friction(0.05, 0.2), lack.breakaway(0.08, 0.25), lack.rubber_friction(0.1, 0.3), lack.spring(),
    lack.stiffening(), lack.buffer(), lack.fixture(), lack.film_asymmetry(), lack.bush(0.02, 0.1),
    lack.joint(0.01, 0.05), channels.zero(0.1, 0.3), channels.late(), channels.low_pass(), channels.drift(),
    outside.COG,
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Injected:
    """A base, the runs as measured, and the same with one effect."""

    seed: int
    source: str
    base_model: Mapping[str, Any]
    hidden: Hidden
    gain: float  # what the base leaves more on held-out runs, noise deviations
    left_n: float  # what it leaves without the effect, N
    noise_n: float
    own_runs: tuple[Run, ...]
    own_held: tuple[Run, ...]
    runs: tuple[Run, ...]
    held_out: tuple[Run, ...]

    @property
    def identifiable(self) -> bool:
        """Whether the base misses it by three noise deviations."""
        return self.gain >= LEAST_GAIN


def injected(seed: int, sets: Sequence[MeasuredSet]) -> Injected:
    """The injection of a seed; the same seed and sets give the same.

    Seeds in a row go through the sets, and every set meets every effect.
    """
    rng = np.random.default_rng([23, seed])
    measured = sets[seed % len(sets)]
    order = [int(k) for k in rng.permutation(len(measured.runs))]
    count = min(len(order) - 1, 2 + int(rng.integers(MOST_RUNS - 1)))
    own = [measured.runs[k] for k in order[: count + 1]]
    motions = [motion_of(r) for r in own]
    scale = _scale(own, motions)
    effect = OFFERED[(seed % len(sets) + seed // len(sets)) % len(OFFERED)]
    base = _base(rng, scale)
    values = effect.draw(rng, scale, {"film": scale.force_n / scale.speed_m_s, "area_r": 1e-3, "area_c": 1e-3})
    changed = [_changed(rng, values, r, m) for r, m in zip(own, motions, strict=True)]
    before = [seen_of(r, m) for r, m in zip(own, motions, strict=True)]
    after = [seen_of(r, motion_of(r)) for r in changed]
    noise = float(np.median([noise_of(r) for r in own]))
    fitted, left, gain = _gain(base, before, after, noise)
    return Injected(
        seed=seed, source=measured.name, base_model=model_file(fitted, rng, f"{measured.name}, as simulated today"),
        hidden=_hidden(effect, values, fitted, before, after, noise), gain=gain, left_n=left, noise_n=noise,
        own_runs=tuple(own[:-1]), own_held=(own[-1],), runs=tuple(changed[:-1]), held_out=(changed[-1],),
    )  # fmt: skip


def _scale(runs: Sequence[Run], motions: Sequence[Motion]) -> Scale:
    force = np.concatenate([r.channels["force"] - np.mean(r.channels["force"]) for r in runs])
    fastest = max(float(np.max(np.abs(m.v)) / (2.0 * np.pi * 0.5 * np.ptp(m.x))) for m in motions)
    return Scale(
        force_n=rms(force),
        peak_n=float(np.max(np.abs(force))),
        stroke_m=max(float(np.max(np.abs(m.x))) for m in motions),
        speed_m_s=max(float(np.max(np.abs(m.v))) for m in motions),
        current_a=max(float(np.max(np.abs(m.current))) for m in motions),
        seconds=float(np.mean([r.samples / r.sample_rate_hz for r in runs])),
        rate_hz=min(r.sample_rate_hz for r in runs),
        fastest_hz=fastest,
    )


def _base(rng: Rng, scale: Scale) -> Base:
    """A viscous model, or one that yields; with a gain on the current where the runs have one."""
    c, top = scale.force_n / scale.speed_m_s, scale.current_a
    controlled = top > 0.0
    viscous = BaseElement(
        path="core", element="viscous_damping",
        values={"c": c, "c_control": c / top if controlled else 0.0},
        held=frozenset() if controlled else frozenset({"c_control"}),
    )  # fmt: skip
    if rng.random() < 0.5:
        return (viscous,)
    yields = BaseElement(
        path="core", element="tanh_hysteresis",
        values={"alpha": scale.force_n, "alpha_control": scale.force_n / top if controlled else 0.0,
                "beta": 15.0 / scale.speed_m_s, "delta": 0.0},
        held=frozenset({"delta"} if controlled else {"delta", "alpha_control"}),
    )  # fmt: skip
    plain = replace(viscous, values={"c": 0.3 * c, "c_control": 0.0}, held=frozenset({"c_control"}))
    return (yields, plain)


def _changed(rng: Rng, values: Mapping[str, float], run: Run, motion: Motion) -> Run:
    """The run with the effect."""
    x, force = run.channels["displacement"], run.channels["force"]
    machine = {n: v for n, v in values.items() if n not in CHAIN_NAMES}
    chain = {n: v for n, v in values.items() if n in CHAIN_NAMES}
    if "play" in machine:
        half = 0.5 * machine["play"]
        x = x + half * np.tanh(force / (0.02 * np.max(np.abs(force))))
    elif "bush" in machine:
        x = x + force / machine["bush"]
    elif "film_bias" in machine:
        film = {"film": rms(force) / rms(motion.v)}
        force = force + force_of({**film, **machine}, motion) - force_of(film, motion)
    elif machine:
        force = force + force_of(machine, motion)
    if chain:
        force = sensed(Chain(values=chain, filter_kind="butterworth 2"), drawn_luck(rng), motion, force)
    return replace(run, channels={**run.channels, "displacement": x, "force": force}, path=None)


def _gain(base: Base, before: Sequence[Seen], after: Sequence[Seen], noise_n: float) -> tuple[Base, float, float]:
    """The base fitted to the changed runs, what it leaves of the measured ones, N; how much more with the effect."""
    left, fitted = [], base
    for runs in (before, after):
        fitted = refitted(base, joined([r.at(r.picked(MOST_SAMPLES)) for r in runs[:-1]]))
        held = runs[-1]
        left.append(rms((held.force - force_of_base(fitted, held))[held.moving]))
    return fitted, left[0], (left[1] - left[0]) / noise_n


def _hidden(
    effect: Effect, values: Mapping[str, float], base: Base, before: Sequence[Seen], after: Sequence[Seen], noise: float
) -> Hidden:
    """What was added, and the names that are right; where the displacement was changed, those that are declared."""
    if any(np.any(a.x != b.x) for a, b in zip(after, before, strict=True)):
        return Hidden(title=effect.title, accepted=effect.names, excess=np.inf, in_catalogue=True, left=(),
                      values=dict(values))  # fmt: skip
    campaign = Campaign(
        runs=tuple(after), without=(tuple(b.force for b in before),), trained=len(after) - 1, noise_n=noise
    )
    found = shown(base, campaign, 0, effect.names, effect.sure)
    return Hidden(
        title=effect.title, accepted=found.accepted, excess=found.excess, in_catalogue=bool(effect.names),
        left=found.left, values=dict(values),
    )  # fmt: skip
