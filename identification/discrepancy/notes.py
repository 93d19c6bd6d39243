"""Notes of a report: how each run was processed, and which effects the runs could not show."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from excitation.kinds import Kind
from identification.criteria import BUDGET, FORM, TEXT
from identification.discrepancy.confidence import most_from
from identification.discrepancy.confidence_table import fitted_table
from identification.discrepancy.evidence import Evidence
from identification.discrepancy.explanation import Traces
from identification.errors import SimulationError
from identification.physical.accuracy import numerical_error
from identification.physical.beside import is_beside
from identification.physical.elements import CATALOGUE
from identification.physical.model import Model, name_of
from identification.record import Record


def finer(base: Model, fitted: Model) -> list[str]:
    """The finer shapes that the base's own curves were found to have."""
    return [
        f"{e.spec.title} of the base: {spec.name} = {p.value:.3g} {spec.unit}, where its canonical form "
        f"{'does not follow the current' if spec.gain else 'jumps' if spec.unit in ('m', 'm/s') else 'has none'}"
        for e in fitted.elements
        if e.id in base.ids
        for spec, p in zip(e.spec.parameters, e.parameters, strict=True)
        if spec.refinement and not p.fixed and p.value != 0.0
    ]


def beside_mount(given: Model, final: Model) -> list[str]:
    """The elements that act between the ends and not behind what is in series with the core, and those no longer."""
    mounted = bool(final.on("mount"))
    beside = [e for e in final.elements if mounted and is_beside(e)]
    within = [e for e in final.elements if mounted and not is_beside(e)]
    moved = [e for e in within if e.id in given.ids and is_beside(given.element(e.id))]
    return [
        *(
            f"{e.spec.title} acts between the ends, beside what gives way there, as a rod seal, a buffer or the gas "
            "behind a rod does"
            for e in beside
        ),
        *(f"{e.spec.title} acts behind what gives way, and not beside it as it was given" for e in moved),
    ]


def switched_on(final: Model) -> list[str]:
    """What a switch of an element means, where it is on and does not say what acts beside the mount."""
    return [
        f"{e.spec.title}: {spec.switch}"
        for e in final.elements
        for spec, p in zip(e.spec.parameters, e.parameters, strict=True)
        if spec.switch and not spec.beside and p.value == 1.0
    ]


def unnamed(base: Model, final: Model, names: Collection[str]) -> list[str]:
    """Elements of the model that only describe how another departs from its ideal, and are not named (by id)."""
    own = [e for e in final.elements if e.id not in names and e.id not in base.ids]
    said = [e.spec.departure.words(e.values()) for e in own if e.spec.departure is not None]
    return [f"{words}: in the model, no effect of its own" for words in said]


def coarse(model: Model, records: Sequence[Record]) -> list[str]:
    """A warning for each record on which the numerical error is not small beside the noise, or can't be estimated."""
    notes = []
    for r in records:
        try:
            error = numerical_error(model, r.motion).force[r.window]
        except SimulationError as failed:
            notes.append(f"{r.name}: the numerical error can't be estimated, half a step fails: {failed}")
            continue
        rms = float(np.sqrt(np.mean(error**2)))
        if rms > TEXT.coarse * r.sigma:
            notes.append(
                f"{r.name}: one step a sample leaves a numerical error of {rms:.3g} N beside a noise of "
                f"{r.sigma:.3g} N; a higher sample rate would lower it"
            )
    return notes


def capped(evidence: Sequence[Evidence]) -> list[str]:
    """The names that would be surer if more runs had shown them."""
    most = {runs: most_from(runs, fitted_table()) for runs in (1, 2)}
    return [
        f"{CATALOGUE[name_of(e.name)].title}: no confidence above {most[runs]:.2f} is stated for what "
        f"{'one run shows' if runs == 1 else 'two runs show'}"
        for e in evidence
        if (runs := max(e.features.runs, 1)) in most and e.confidence >= most[runs]
    ]


def tared_apart(traces: Sequence[Traces]) -> list[str]:
    """A warning where most of the gap is a mean force that some runs have and others have not."""
    rest = [t.record.measured - t.final for t in traces]
    means = np.array([float(np.mean(e)) for e in rest])
    gap = float(np.sqrt(np.mean(np.concatenate(rest) ** 2)))
    if len(traces) < 3 or float(np.var(means)) < BUDGET.odd_share * gap**2:
        return []
    low, high = int(np.argmin(means)), int(np.argmax(means))
    return [
        f"the mean force differs from run to run: {means[low]:.3g} N left in {traces[low].record.name}, "
        f"{means[high]:.3g} N in {traces[high].record.name}; was the load cell tared between them?"
    ]


def far_as_given(traces: Sequence[Traces]) -> list[str]:
    """A warning where the model as given is off by several times the measured force: units or signs, not an effect."""
    force = float(np.sqrt(np.mean(np.concatenate([t.record.measured for t in traces]) ** 2)))
    gap = float(np.sqrt(np.mean(np.concatenate([t.record.measured - t.as_given for t in traces]) ** 2)))
    if gap < FORM.disproportionate * force:
        return []
    return [
        f"the model as given is off by {gap:.3g} N rms where {force:.3g} N are measured: are its units, signs and "
        "machine those of the runs?"
    ]


def of_search(as_searched: bool) -> list[str]:
    """Where the values of the named effects are not those that fit the whole runs."""
    return [
        "fitted further, to the whole runs, the named effects run away, or miss the held-out runs by more than the "
        "refitted base: their values are as the search found them"
    ] * as_searched


def refit_harms(traces: Sequence[Traces]) -> list[str]:
    """A warning where the base is clearly worse on held-out runs once it has been fitted to the others."""
    held = [t for t in traces if t.held_out]
    if not held:
        return []
    given, refitted = (
        float(np.sqrt(np.mean(np.concatenate(rests) ** 2)))
        for rests in ([t.record.measured - t.as_given for t in held], [t.record.measured - t.refitted for t in held])
    )
    if refitted < (1.0 + FORM.minor) * given:
        return []
    return [
        f"on the held-out runs the base is off by {given:.3g} N as given and by {refitted:.3g} N once it is fitted to "
        "the others: what it lacks there went into its parameters; hold out runs that move alike"
    ]


def beyond(traces: Sequence[Traces]) -> list[str]:
    """A warning for each held-out run that reaches beyond all fitted ones, in displacement or in current, and shows a
    gap that they do not."""
    fitted = [t for t in traces if not t.held_out]
    gap = _left(fitted)
    notes = []
    for t in traces:
        reach = _beyond_in_place(t, fitted) or _beyond_in_current(t, fitted)
        if t.held_out and reach and (own := _left([t])) > FORM.disproportionate * gap:
            notes.append(
                f"{t.record.name} (held out) {reach}, and shows a gap of {own:.3g} N where they show {gap:.3g} N: "
                "what acts there could not be learned; fit to that run too"
            )
    return notes


def _beyond_in_place(one: Traces, fitted: Sequence[Traces]) -> str:
    (least, most), (low, high) = _reach([one], "x"), _reach(fitted, "x")
    if most - least <= (1.0 + FORM.minor) * (high - low):
        return ""
    return (
        f"moves from {1e3 * least:.3g} to {1e3 * most:.3g} mm, the fitted runs from {1e3 * low:.3g} to "
        f"{1e3 * high:.3g} mm"
    )


def _beyond_in_current(one: Traces, fitted: Sequence[Traces]) -> str:
    """Beyond the span of the fitted runs by a part of it; of runs of one current, by a part of that."""
    (least, most), (low, high) = _reach([one], "i"), _reach(fitted, "i")
    span, size = high - low, max(abs(low), abs(high))
    part = FORM.minor * (span if span > TEXT.steady * size else size)
    if low - part <= least and most <= high + part:
        return ""
    return f"has a current of {least:.3g} to {most:.3g} A, the fitted runs {low:.3g} to {high:.3g} A"


def _reach(traces: Sequence[Traces], signal: str) -> tuple[float, float]:
    """Least and largest value of a signal of the motion."""
    values = np.concatenate([getattr(t.record.motion, signal)[t.record.window] for t in traces])
    return float(np.min(values)), float(np.max(values))


def _left(traces: Sequence[Traces]) -> float:
    """What the last model leaves, N rms."""
    return float(np.sqrt(np.mean(np.concatenate([t.record.measured - t.final for t in traces]) ** 2)))


def elsewhere(train: Sequence[Record], held: Sequence[Record]) -> list[str]:
    """A warning for each held-out run that moves in another band of frequency than all fitted ones."""
    fitted = [_frequency(r) for r in train]
    low, high = min(fitted) / FORM.disproportionate, max(fitted) * FORM.disproportionate
    return [
        f"{r.name} (held out) moves at about {_frequency(r):.3g} Hz, the fitted runs at {min(fitted):.3g} to "
        f"{max(fitted):.3g} Hz: it says little of the names"
        for r in held
        if not low < _frequency(r) < high
    ]


def _frequency(record: Record) -> float:
    """Frequency of a sine with the rms velocity and the rms displacement of a record, Hz."""
    v, x = (float(np.std(s[record.window])) for s in (record.motion.v, record.motion.x))
    return v / (2.0 * np.pi * max(x, 1e-300))


def _one_frequency(records: Sequence[Record]) -> bool:
    rates = [_frequency(r) for r in records]
    return max(rates) < TEXT.same_frequency * min(rates)


def of_runs(train: Sequence[Record], held: Sequence[Record]) -> list[str]:
    """How each run was processed, and which effects these runs could not show."""
    notes = [f"{r.name}: {r.route}" for r in train] + [f"{r.name} (held out): {r.route}" for r in held]
    notes += [f"{r.name}: {note}" for r in (*train, *held) for note in r.notes]
    every = [*train, *held]
    if any(r.simulated is not None for r in every):
        notes.append(
            "on top of a foreign simulation: effects inside it (mount, control path, modifiers) are out of reach"
        )
    if not any(r.has_current for r in every):
        notes.append("no run has a control current: effects on the control path could not have shown")
    elif not any(np.ptp(r.motion.i[r.window]) > TEXT.steady * np.max(np.abs(r.motion.i)) for r in every):
        notes.append("the current is constant in every run: lags and hysteresis of the control could not have shown")
    if not any(r.has_temperature for r in every):
        notes.append("no run has a temperature: a fade with temperature could not have shown")
    if all(r.kind in (Kind.SINE, Kind.TRIANGLE) for r in every) and _one_frequency(every):
        notes.append("one frequency only: a stiffness and a moving mass look alike here")
    return notes
