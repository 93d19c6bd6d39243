"""What the page of a report draws, computed from an explanation: curves, maps, traces, intervals and tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.discrepancy.aliases import aliases
from identification.discrepancy.choice import Trial, allowance
from identification.discrepancy.excess import excess_of
from identification.discrepancy.explanation import Effect, Explanation, Traces, Verdict, report_data
from identification.discrepancy.naming import Compared
from identification.discrepancy.shapes import shapes
from identification.discrepancy.sheet_figures import sheet_figures
from identification.physical.elements import CATALOGUE
from identification.report import PageData, fingerprint
from identification.report.page_data import (
    AsGood,
    BaseTable,
    GapMap,
    Interval,
    Loop,
    Rivals,
    RuledOut,
    Spectrum,
    Strengths,
    Words,
)
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_MOST_LOOPS = 3
_POINTS = 1500  # of a loop: about as many as a screen can show
_STRETCH = (200, 3000)  # samples of a loop: of a run with periods at least, of another at most
_MAP_BINS = 40
_FEW = 3  # samples: a mean over no more is left out of the map
_BANDS = 160
_ABS_OF = ("speed", "stroke")  # variables whose profile shows nothing that velocity and displacement do not


def page_data(e: Explanation, *, reproduce: str = "", runs: Sequence[Run] = ()) -> PageData:
    """Everything that the page draws beside report.json. `reproduce` is the command that explains again.

    `runs` are those whose characteristic sheet stands on the page, where they allow one.
    """
    traces = {held: [t for t in e.traces if t.held_out is held] for held in (False, True)}
    shown = traces[True] or traces[False]
    differs = e.verdict != Verdict.NO_DISCREPANCY
    return PageData(
        report=fingerprint(report_data(e)),
        name=e.given.name,
        reproduce=reproduce,
        words=_words(),
        aliases=tuple(aliases([f.element for f in e.effects])),
        train=gap_interval(traces[False]),
        held_out=gap_interval(traces[True]),
        gap_map=_map(traces[False]) if differs else None,
        profiles=tuple(p for p in e.profiles if p.variable not in _ABS_OF) if differs else (),
        loops=tuple(_loop(t) for t in shown[:_MOST_LOOPS]),
        spectrum=_spectrum(shown),
        shapes=tuple(shapes(e)),
        rivals=tuple(_rivals(e)),
        strengths=_strengths(e),
        as_good=tuple(AsGood(element=f.element, others=_as_good(e, f)) for f in e.effects),
        ruled_out=_ruled_out(e),
        base=_base(e),
        sheet=sheet_figures(runs),
    )


def _words() -> Words:
    specs = CATALOGUE.values()
    return Words(
        elements=tuple(CATALOGUE), titles=tuple(s.title for s in specs), equations=tuple(s.equation for s in specs)
    )


def gap_interval(traces: Sequence[Traces]) -> Interval:
    low, high = np.array([interval_of_rms(rests) for rests in zip(*(_rests(t) for t in traces), strict=True)]).T
    return Interval(low=low, high=high)


def _rests(t: Traces) -> list[list[Floats]]:
    """What each step leaves of a record, N, in stretches of a period, or a tenth of a record that has none."""
    size = t.record.measured.size
    cuts = np.arange(0, size, t.record.period or -(-size // 10))[1:]
    return [np.split(t.record.measured - force, cuts) for force in (t.as_given, t.refitted, t.final)]


def interval_of_rms(rests: Sequence[Sequence[Floats]]) -> tuple[float, float]:
    """95 % interval of the rms over all stretches of all records, from the scatter of its square between them."""
    stretches = [e for record in rests for e in record]
    energy, size = (np.array([f(e) for e in stretches]) for f in (lambda e: float(np.sum(e**2)), len))
    mean = float(np.sum(energy) / np.sum(size))
    few = energy.size / max(energy.size - 1, 1)
    half = 1.96 * float(np.sqrt(few * np.sum((energy - mean * size) ** 2)) / np.sum(size))
    return float(np.sqrt(max(mean - half, 0.0))), float(np.sqrt(mean + half))


def _map(traces: Sequence[Traces]) -> GapMap:
    """Mean of what the refitted base leaves, over displacement and velocity."""
    x = np.concatenate([t.record.motion.x[t.record.window] for t in traces])
    v = np.concatenate([t.record.motion.v[t.record.window] for t in traces])
    rest = np.concatenate([t.record.measured - t.refitted for t in traces])
    edges = [np.linspace(float(np.quantile(a, 0.001)), float(np.quantile(a, 0.999)), _MAP_BINS + 1) for a in (x, v)]
    total, _, _ = np.histogram2d(x, v, edges, weights=rest)
    count, _, _ = np.histogram2d(x, v, edges)
    mean = np.where(count > _FEW, total / np.maximum(count, 1.0), np.nan)
    centres = [0.5 * (q[1:] + q[:-1]) for q in edges]
    return GapMap(displacement=centres[0], velocity=centres[1], mean=mean.astype(np.float32))


def _loop(t: Traces) -> Loop:
    """The last period of a run, or its last samples, thinned to what a screen can show."""
    record, size = t.record, t.record.measured.size
    least, most = _STRETCH
    span = min(size, max(record.period, least) if record.period else most)
    step = max(1, span // _POINTS)
    keep = np.arange(size - span, size, step)
    x, v = record.motion.x[record.window], record.motion.v[record.window]
    drawn = [a[keep].astype(np.float32) for a in (x, v, record.measured, t.refitted, t.final)]
    return Loop(
        run=record.name, held_out=t.held_out, samples=size, shown=span, step=step, displacement=drawn[0],
        velocity=drawn[1], measured=drawn[2], refitted=drawn[3], final=drawn[4],
    )  # fmt: skip


def _spectrum(traces: Sequence[Traces]) -> Spectrum:
    """What is left by frequency in the run with the largest gap, before and after."""
    trace = max(traces, key=lambda t: float(np.mean((t.record.measured - t.refitted) ** 2)))
    r = trace.record
    frequency, refitted = _density(r.measured - trace.refitted, r.dt)
    _, final = _density(r.measured - trace.final, r.dt)
    floor = r.sigma * float(np.sqrt(2.0 * r.dt))
    return Spectrum(run=r.name, frequency=frequency, refitted=refitted, final=final, noise_floor=floor)


def _density(residual: Floats, dt: float) -> tuple[Floats, Floats]:
    """Amplitude density of a residual, averaged over logarithmic bands above its mean, which no run resolves."""
    power = np.abs(np.fft.rfft(residual * np.hanning(residual.size))) ** 2 * 2.0 * dt / (0.375 * residual.size)
    frequency = np.fft.rfftfreq(residual.size, dt)
    edges = np.unique(np.geomspace(2, power.size, _BANDS).astype(np.int64))
    starts, counts = edges[:-1], np.diff(edges)
    mean = np.add.reduceat(power[: edges[-1]], starts) / counts
    centre = np.add.reduceat(frequency[: edges[-1]], starts) / counts
    return centre, np.sqrt(mean)


def _rivals(e: Explanation) -> Iterator[Rivals]:
    """What stood against each name; without names, what was tried first."""
    for name, compared in e.compared.items():
        yield _panel(name, _beside(compared), compared.rivals, excess_of(compared.start))
    if not e.compared and e.moves:
        yield _panel("", "", e.moves[0].rivals, e.moves[0].excess_before)


def _panel(place: str, beside: str, tried: Sequence[Trial], before: float) -> Rivals:
    ranked = sorted((t for t in tried if t.excess < before), key=lambda t: t.excess, reverse=True)
    left = np.array([100.0 * max(t.excess, 0.0) / before for t in ranked])
    return Rivals(place=place, beside=beside, elements=tuple(t.name for t in ranked), left=left)


def _beside(compared: Compared) -> str:
    """What stood beside a name when it was compared with its rivals."""
    return f"beside {', '.join(CATALOGUE[n].title for n in compared.beside) or 'the base alone'}"


def _strengths(e: Explanation) -> Strengths | None:
    known = [(f.element, f.evidence.strengths) for f in e.effects if f.evidence is not None]
    if not known:
        return None
    return Strengths(elements=tuple(n for n, _ in known), values=np.array([values for _, values in known]))


def _as_good(e: Explanation, f: Effect) -> tuple[str, ...]:
    """Elements that fit as well as the effect in its place, but are less simple."""
    tried = e.compared[f.element].rivals if f.element in e.compared else ()
    own = [t for t in tried if t.name == f.element]
    known = {f.element, *(n for n, _ in f.alternatives), *e.compared}
    return tuple(t.name for t in tried if t.name not in known and t.excess <= own[0].excess + allowance(own[0], t))


def _ruled_out(e: Explanation) -> RuledOut:
    """Every candidate that no name is left of, where it came closest."""
    named = {f.element for f in e.effects}
    closest: dict[str, tuple[float, Trial, str]] = {}
    for left, trial, beside in _tried(e):
        if trial.name not in named and left < closest.get(trial.name, (np.inf,))[0]:
            closest[trial.name] = (left, trial, beside)
    rows = sorted(closest.values(), key=lambda row: row[0])
    return RuledOut(
        elements=tuple(t.name for _, t, _ in rows),
        beside=tuple(beside for _, _, beside in rows),
        left=np.array([left for left, _, _ in rows]),
        promised=np.array([t.screened for _, t, _ in rows]),
        parameters=np.array([t.parameters for _, t, _ in rows], dtype=np.int64),
    )


def _tried(e: Explanation) -> Iterator[tuple[float, Trial, str]]:
    """Share of the gap that each candidate left, and what stood beside it."""
    for compared in e.compared.values():
        for t in compared.rivals:
            yield max(t.excess, 0.0) / max(excess_of(compared.start), 1e-300), t, _beside(compared)
    for move in e.moves[:1]:
        for t in move.rivals:
            yield max(t.excess, 0.0) / max(move.excess_before, 1e-300), t, "beside the base alone"


def _base(e: Explanation) -> BaseTable:
    """Every parameter of the model as given, and what became of it."""
    fitted = {
        f"{x.name}.{s.name}": p for x in e.model.elements for s, p in zip(x.spec.parameters, x.parameters, strict=True)
    }
    given = [(x, s, p) for x in e.given.elements for s, p in zip(x.spec.parameters, x.parameters, strict=True)]
    now = [fitted.get(f"{x.name}.{s.name}", p) for x, s, p in given]
    return BaseTable(
        titles=tuple(x.spec.title for x, _, _ in given),
        parameters=tuple(s.name for _, s, _ in given),
        units=tuple(s.unit for _, s, _ in given),
        given=np.array([p.value for _, _, p in given]),
        now=np.array([p.value for p in now]),
        std=np.array([np.nan if p.std is None else p.std for p in now], dtype=np.float64),
        held=np.array([p.fixed for p in now], dtype=np.bool_),
    )
