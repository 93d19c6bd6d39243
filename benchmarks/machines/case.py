"""One case: a machine of some kind with effects that the given model lacks, its runs, and what may be said of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.machines.bases import Base, Seen, model_file
from benchmarks.machines.kinds import KINDS, Effect, Machine, Scale
from benchmarks.machines.motions import STYLES, Plan, moved_by, plans_of, rate_for, steps_for
from benchmarks.machines.recording import CHAIN_NAMES, FILTERS, Chain, Luck, as_measured, drawn_luck, recorded, sensed
from benchmarks.machines.simulation import Motion, force_of, motion_under
from benchmarks.machines.sizing import (
    LEAST_EXCESS,
    Campaign,
    excess_of_base,
    fitted_base,
    names_for_the_form,
    noise_by_motion,
    rms,
    shown,
)
from rigctl.runfile import Run

Row = NDArray[np.float64]
Names = tuple[str, ...]
Rng = np.random.Generator

# How many effects are hidden, over twenty cases of each kind and mixed over the kinds; −1: one outside the catalogue
# and up to one inside.
COUNTS = (1, 2, 0, 1, 3, 2, -1, 1, 2, 0, 2, 4, 1, 3, 2, -1, 1, 2, 3, 1)
LEAST_NOISE = 0.004  # of the rms of the force
ATTEMPTS = 4  # draws of the effects until all can be identified; then the case is what it is, and says so
MOST_RUNS = 9
TURNED_SHARE = 0.04  # of the cases: force upside down in some or all runs
OWN_CHOICE = 0.2  # of the cases with three runs or more: nothing is held out by the user


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """One hidden effect: what it is, the sets of names that are right, and its excess over a refit of the base."""

    title: str
    accepted: tuple[Names, ...]  # the first is what it is; none: outside the catalogue
    excess: float  # noise deviations on held-out runs
    in_catalogue: bool
    left: tuple[tuple[Names, float], ...]
    values: Mapping[str, float]

    @property
    def identifiable(self) -> bool:
        """Whether it beats a refit of the base by three noise deviations."""
        return self.excess >= LEAST_EXCESS


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Input of the workflow (model, runs), and the truth for the evaluation."""

    seed: int
    kind: str
    base_model: Mapping[str, object]
    hidden: tuple[Hidden, ...]
    form: tuple[str, ...]  # names that only say that the curve of the base is not that of the machine
    form_excess: float
    runs: tuple[Run, ...]
    held_out: tuple[Run, ...]
    truth: tuple[Row, ...]  # noise-free force of every run, training first, N
    own_choice: bool  # the workflow is not told what to hold out
    noise_n: float
    force_n: float  # rms of the machine without effects
    excess: float  # of the refitted base, noise deviations
    detail: Mapping[str, object]

    @property
    def identifiable(self) -> bool:
        """Whether every hidden effect is."""
        return all(h.identifiable for h in self.hidden)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """How a case is measured, before its effects are drawn."""

    machine: Machine
    plans: tuple[Plan, ...]
    trained: int
    style: str
    rate_hz: float
    fine: int
    chain: Chain
    luck: tuple[Luck, ...]


def case(seed: int, kinds: Sequence[str] = tuple(KINDS), beside: bool = False) -> Case:
    """The case of a seed among some kinds of machine; the same arguments give the same case.

    With `beside`, every case has an effect outside of the catalogue and one or two others: what else is missing.
    """
    rng = np.random.default_rng([22, seed])
    kind = kinds[seed % len(kinds)]
    count = -2 if beside else COUNTS[(7 * (seed // len(kinds)) + 3 * (seed % len(kinds))) % len(COUNTS)]
    made: Case | None = None
    for _ in range(ATTEMPTS):
        machine = _drawn_machine(rng, kind, null=count == 0)
        effects = _chosen(rng, machine, count)
        made = _measured(rng, seed, machine, effects)
        if made.identifiable:
            break
    if made is None:
        raise RuntimeError(f"seed {seed}, {kind}: no case")
    return made


def _drawn_machine(rng: Rng, kind: str, *, null: bool) -> Machine:
    """A machine of the kind; where nothing is to be hidden, one whose base has no lack of its own."""
    machine = KINDS[kind](rng)
    while null and machine.always:
        machine = KINDS[kind](rng)
    return machine


def _chosen(rng: Rng, machine: Machine, count: int) -> list[Effect]:
    """The effects of a case, none that excludes another; first what the base always lacks.

    A count of −1 − n is one outside of the catalogue, and n or n + 1 more.
    """
    chosen: list[Effect] = list(machine.always)
    if count < 0:
        often = np.array([e.weight for e in machine.outside])
        chosen.append(machine.outside[int(rng.choice(often.size, p=often / np.sum(often)))])
        count = len(chosen) - 1 - count + int(rng.integers(2))
    weights = np.array([e.weight for e in machine.effects])
    for k in rng.choice(weights.size, weights.size, replace=False, p=weights / np.sum(weights)):
        effect = machine.effects[int(k)]
        if len(chosen) >= count:
            break
        if not any(_excludes(effect, other) for other in chosen):
            chosen.append(effect)
    return chosen


def _excludes(one: Effect, other: Effect) -> bool:
    """Whether two effects are the same or one says that it excludes the other."""
    return one.title == other.title or one.title in other.excludes or other.title in one.excludes


def _bench(rng: Rng, machine: Machine, effects: Sequence[Effect]) -> Bench:
    style = STYLES[int(rng.integers(len(STYLES)))]
    count = 1 + int(rng.integers(MOST_RUNS))
    if count == 1 and style in ("sines", "ramps"):
        style = "road"
    held = 1 if count < 4 else 2
    plans = plans_of(rng, machine.envelope, style, count + held)
    order = [*rng.permutation(np.arange(1, count + held - 1)), 0, count + held - 1] if count > 1 else [1, 0]
    plans = [plans[int(k)] for k in [*order[held:], *order[:held]]]
    plans = [*plans[:count], *(_inside(p, plans[:count]) for p in plans[count:])]
    if any(e.needs_steps for e in effects) and machine.envelope.current_a is not None:
        plans = [_with_steps(rng, machine, p) for p in plans]
    if any(e.needs_warmth for e in effects):
        plans = [replace(p, warm_c=rng.uniform(15.0, 60.0), warming_c=rng.uniform(0.0, 8.0)) for p in plans]
    rate = rate_for(rng, machine.envelope, max([0.0, *(e.least_rate_hz for e in effects)]))
    chain = Chain(filter_kind=FILTERS[1 + int(rng.integers(len(FILTERS) - 1))])
    return Bench(
        machine=machine, plans=tuple(plans), trained=count, style=style, rate_hz=rate, fine=steps_for(rate),
        chain=chain, luck=tuple(drawn_luck(rng) for _ in plans),
    )  # fmt: skip


def _inside(plan: Plan, others: Sequence[Plan]) -> Plan:
    """The plan, no larger and no faster than the largest and the fastest of the others."""
    stroke, speed = plan.peak_m / max(p.peak_m for p in others), plan.peak_m_s / max(p.peak_m_s for p in others)
    return replace(plan, amplitude_m=plan.amplitude_m / max(stroke, speed, 1.0))


def _with_steps(rng: Rng, machine: Machine, plan: Plan) -> Plan:
    low, high = machine.envelope.current_a or (0.0, 0.0)
    return replace(plan, current_a=rng.uniform(low, high, max(int(plan.seconds / rng.uniform(0.25, 0.8)), 4)))


def _motions(bench: Bench, values: Mapping[str, float]) -> list[Motion]:
    """The motion of every run; where a force drives the machine it follows from what the machine is."""
    motions = [moved_by(p, bench.rate_hz, bench.fine) for p in bench.plans]
    if bench.machine.envelope.driven:
        motions = [motion_under(values, m.x, m) for m in motions]
    return motions


def _scale(bench: Bench, values: Mapping[str, float]) -> Scale:
    """The machine without effects, or with those that its base always lacks, in these motions."""
    motions = _motions(bench, values)
    force = np.concatenate([force_of(values, m)[:: m.fine] for m in motions])
    return Scale(
        force_n=rms(force),
        peak_n=float(np.max(np.abs(force))),
        stroke_m=max(float(np.max(np.abs(m.x))) for m in motions),
        speed_m_s=max(float(np.max(np.abs(m.v))) for m in motions),
        current_a=max(float(np.max(np.abs(m.current))) for m in motions),
        seconds=float(np.mean([p.seconds for p in bench.plans])),
        rate_hz=bench.rate_hz,
        fastest_hz=_fastest(bench),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """Numbers of a machine and of its recording chain."""

    machine: Mapping[str, float]
    chain: Mapping[str, float]

    def changed(self, values: Mapping[str, float]) -> Build:
        """With an effect."""
        return Build(
            machine={**self.machine, **{n: v for n, v in values.items() if n not in CHAIN_NAMES}},
            chain={**self.chain, **{n: v for n, v in values.items() if n in CHAIN_NAMES}},
        )


def _built(plain: Build, drawn: Sequence[Mapping[str, float]], leave_out: int | None = None) -> Build:
    build = plain
    for k, values in enumerate(drawn):
        if k != leave_out:
            build = build.changed(values)
    return build


@dataclass(frozen=True, slots=True, kw_only=True)
class Played:
    """The motions of all runs, as they are and as the displacement channel tells them, and the forces so far."""

    bench: Bench
    motions: Sequence[Motion]
    measured: Sequence[Motion]
    done: dict[tuple[bool, tuple[tuple[str, float], ...]], list[Row]] = field(default_factory=dict)

    def forces(self, build: Build) -> list[Row]:
        """The force of every run in its channel, without noise, N.

        Without the filter of the displacement channel the machine would be where that channel tells.
        """
        filtered = "early_hz" in build.chain
        key = (filtered, tuple(sorted(build.machine.items())))
        motions = self.motions if filtered else self.measured
        if key not in self.done:
            self.done[key] = [force_of(build.machine, m) for m in motions]
        chain, each = replace(self.bench.chain, values=build.chain), self.done[key]
        return [sensed(chain, luck, m, f) for luck, m, f in zip(self.bench.luck, motions, each, strict=True)]


def _measured(rng: Rng, seed: int, machine: Machine, effects: Sequence[Effect]) -> Case:
    """Draw the sizes of the effects, simulate the runs with and without each, and record them."""
    bench = _bench(rng, machine, effects)
    scale = _scale(bench, machine.values)
    plain = Build(machine=machine.values, chain={})
    drawn: list[Mapping[str, float]] = []
    for k, effect in enumerate(effects):
        if machine.always and k == len(machine.always):
            scale = _scale(bench, _built(plain, drawn).machine)
        drawn.append(effect.draw(rng, scale, _built(plain, drawn).machine))
    build = _built(plain, drawn)
    motions = _motions(bench, build.machine)
    measured = [as_measured(replace(bench.chain, values=build.chain), m) for m in motions]
    chain = _noisy(rng, bench, scale, replace(bench.chain, values=build.chain))
    played = Played(bench=bench, motions=motions, measured=measured)
    forces = played.forces(build)
    seen = tuple(_seen(m, f) for m, f in zip(measured, forces, strict=True))
    base = fitted_base(machine.base, seen[: bench.trained])
    noise = _noise(chain, base, seen[: bench.trained], bench.rate_hz, scale.fastest_hz)
    without = tuple(tuple(played.forces(_built(plain, drawn, k))) for k in range(len(effects)))
    campaign = Campaign(runs=seen, without=without, trained=bench.trained, noise_n=noise)
    hidden = tuple(_hidden(base, campaign, k, e, drawn[k]) for k, e in enumerate(effects))
    form_excess, form = names_for_the_form(machine.base, campaign, played.forces(plain))
    name = f"{machine.kind}-{seed}"
    runs = tuple(
        recorded(rng, chain, luck, m, f, k, name, p.kind)
        for k, (luck, m, f, p) in enumerate(zip(bench.luck, measured, forces, bench.plans, strict=True))
    )
    detail: dict[str, object] = {
        "style": bench.style, "rate_hz": bench.rate_hz, "turned": list(chain.turned), "clock_error": chain.clock_error,
        "place_step_m": chain.place_step_m, "rest": bench.plans[0].rest_s > 0.0, "centre_m": bench.plans[0].centre_m,
        "filter": bench.chain.filter_kind if build.chain.get("filter_hz") else "none",
    }  # fmt: skip
    return Case(
        seed=seed, kind=machine.kind, base_model=model_file(base, rng, f"{machine.kind}, as simulated today"),
        hidden=hidden, form=form, form_excess=form_excess, runs=runs[: bench.trained], held_out=runs[bench.trained :],
        truth=tuple(forces), own_choice=bool(bench.trained >= 3 and rng.random() < OWN_CHOICE), noise_n=noise,
        force_n=scale.force_n, excess=excess_of_base(base, campaign), detail=detail,
    )  # fmt: skip


def _hidden(base: Base, campaign: Campaign, number: int, effect: Effect, values: Mapping[str, float]) -> Hidden:
    found = shown(base, campaign, number, effect.names, effect.sure)
    return Hidden(
        title=effect.title, accepted=found.accepted, excess=found.excess, in_catalogue=bool(effect.names),
        left=found.left, values=dict(values),
    )  # fmt: skip


def _seen(motion: Motion, force: Row) -> Seen:
    at = slice(motion.lead * motion.fine, None, motion.fine)
    return Seen(
        x=motion.x[at], v=motion.v[at], a=motion.a[at], i=motion.current[motion.lead :],
        warm=motion.temperature[motion.lead :], t=np.arange(force.size) / motion.rate_hz, moving=_in_motion(motion)[at],
        force=force,
    )  # fmt: skip


def _in_motion(motion: Motion) -> Row:
    """False at rest: where the speed stays below a hundredth of its largest for 0.2 s."""
    width = max(1, round(0.1 * motion.rate_hz * motion.fine))
    fast = np.abs(motion.v) > 0.01 * np.max(np.abs(motion.v))
    near = np.cumsum(np.concatenate([np.zeros(width), fast, np.zeros(width)]))
    return np.asarray(near[2 * width :] - near[: -2 * width] > 0.0)


def _noise(chain: Chain, base: Base, runs: Sequence[Seen], rate_hz: float, fastest_hz: float) -> float:
    """What no model can explain, N rms: noise and steps of the force, and of the displacement as the base sees them."""
    place = float(np.hypot(chain.place_noise_m, chain.place_step_m / np.sqrt(12.0)))
    by_motion = noise_by_motion(base, runs, place, rate_hz, fastest_hz)
    return float(np.sqrt(chain.force_noise_n**2 + chain.force_step_n**2 / 12.0 + by_motion**2))


def _noisy(rng: Rng, bench: Bench, scale: Scale, chain: Chain) -> Chain:
    """The chain with its noise, converter steps, clock error and thermometer, and wrong polarity in a few cases."""
    force_noise = scale.force_n * float(np.exp(rng.uniform(np.log(LEAST_NOISE), np.log(0.015))))
    force_step = 2.5 * scale.peak_n / 2.0 ** rng.integers(12, 17)
    place_step = 2.5 * scale.stroke_m / 2.0 ** rng.integers(12, 17)
    place_noise = place_step * rng.uniform(0.2, 1.0)
    turned: tuple[int, ...] = ()
    if rng.random() < TURNED_SHARE:
        every = range(len(bench.plans))
        turned = tuple(every) if rng.random() < 0.5 or bench.trained < 3 else (int(rng.integers(bench.trained)),)
    return replace(
        chain, force_noise_n=force_noise, force_step_n=force_step, place_noise_m=place_noise, place_step_m=place_step,
        current_noise_a=1e-3 * scale.current_a, clock_error=1e-3 if rng.random() < 0.25 else 0.0,
        thermometer=bool(rng.random() < 0.6) or machine_warms(bench), turned=turned,
    )  # fmt: skip


def machine_warms(bench: Bench) -> bool:
    """Whether the temperature differs enough between the runs that somebody measured it."""
    warm = [p.warm_c for p in bench.plans]
    return max(warm) - min(warm) > 10.0


def _fastest(bench: Bench) -> float:
    """The highest frequency of a motion, Hz; of an oscillator, that of its envelope."""
    if bench.machine.envelope.driven:
        return bench.machine.envelope.high_hz
    return max(
        float(p.frequency_hz[np.abs(p.amplitude_m) > 0.02 * np.max(np.abs(p.amplitude_m))][-1]) for p in bench.plans
    )
