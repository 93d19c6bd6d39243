"""The next test: the one within the rig's limits on which the best explanation and its rival differ most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind
from excitation.plan import test_from_config
from identification.compute import run, run_here
from identification.criteria import CHANCE, TEXT
from identification.discrepancy.choice import Trial
from identification.discrepancy.explanation import NextTest
from identification.discrepancy.naming import Search
from identification.discrepancy.signatures import orthonormal
from identification.errors import SimulationError
from identification.fitting.leastsquares import evaluate, free_parameters
from identification.noise import high_frequency
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record, compact, record_to_come

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_LONGEST_CORNER = 0.499  # of a period: two corners fill one, and a design of four digits must not exceed that
_SHAPES = {Kind.SINE: "a sine", Kind.TRIANGLE: "a triangle", Kind.STEPS: "current steps under a sine"}
Imagined = tuple[Mapping[str, Any], Record]  # a design and the record that its run would give


def propose(found: Search, uncertain: str | None, records: Sequence[Record]) -> NextTest:
    """The design, within the motion that the rig has shown, that separates an uncertain name from its best rival.

    Its worth is ‖(I − QQᵀ)(F_a − F_b)‖ over the data there are and the new run, whitened: the difference that no refit
    of the rival could absorb (T-optimality, Atkinson & Fedorov, 1975), rms over the run, by the second of motion: what
    is left is mostly far above the noise, and rig time is what it costs. F_a and F_b are the two effects beside the
    same rest: what else differs between two fits is no reason for a test in which neither effect acts. None is among
    the records that were fitted; one that was kept back may be asked for again. A name without a rival is set against
    the model without it; where nothing was named, the design is the one that differs most from the runs so far.
    """
    pair = _models_to_tell_apart(found, uncertain)
    if pair is None:
        return _explore(_new_tests(records), records)
    best, rival, words = pair
    unseen, worth = _new_tests(records), list[tuple[float, Mapping[str, Any]]]()
    with suppress(SimulationError):
        known = _known(best, rival, records)
        values = run(partial(_worth, best, rival, known), [record for _, record in unseen])
        worth = [(value, config) for value, (config, _) in zip(values, unseen, strict=True) if value is not None]
    if not worth:
        return _explore(unseen, records)
    telling = [(value, config) for value, config in worth if value >= CHANCE.near_floor]
    if not telling:
        return NextTest(
            text=f"no test within the motion seen so far {words} beyond the noise: a larger stroke, a higher speed or "
            "another current may"
        )
    rms, config = max(telling, key=lambda w: w[0] / max(seconds_of(w[1]), TEXT.least_test_s))
    return NextTest(
        text=f"{in_words(config)} {words}: there the two models differ by {rms:.2g} × the noise after any refit",
        design=config,
    )


def _models_to_tell_apart(found: Search, uncertain: str | None) -> tuple[Model, Model, str] | None:
    """The two models that a test should tell apart, the same but for one effect, and what it would show."""
    rivals = _rivals(found, uncertain)
    if len(rivals) > 1:
        one, other = (r.own.spec.title for r in rivals)
        best, rival = (r.fit.model for r in rivals[:2])
        return best, _with_rest_of(best, rival), f"tells {one} from {other}"
    if uncertain is None:
        return None
    if uncertain in found.names:
        best, without = found.fit.model, found.fit.model.without(uncertain)
    else:  # it was not stated
        best, without = rivals[0].fit.model, found.compared[uncertain].start.model
    return best, _with_rest_of(best, without), f"confirms {best.element(uncertain).spec.title}"


def _with_rest_of(best: Model, rival: Model) -> Model:
    """The rival with the values of the best in all elements that both have: the two then differ by their effects."""
    return replace(rival, elements=tuple(best.element(e.id) if e.id in best.ids else e for e in rival.elements))


def _explore(unseen: Sequence[Imagined], records: Sequence[Record]) -> NextTest:
    """Of the short tests the one that differs most from all runs so far in speed, stroke and level of current."""
    designs = [d for d in unseen if seconds_of(d[0]) <= TEXT.short_test_s] or list(unseen)
    if not designs:
        return NextTest()
    config, _ = max(designs, key=lambda d: min(_difference_of_motion(d[1], r) for r in records))
    return NextTest(text=f"{in_words(config)} differs most from the runs so far and may show further effects",
                    design=config)  # fmt: skip


def _new_tests(records: Sequence[Record]) -> list[Imagined]:
    """The tests of the library that are not among the records, each with the record that it would give."""
    designs = [d for d in library(records) if seconds_of(d) <= TEXT.longest_test_s]
    imagined = [(d, expected_record(d, records)) for d in designs]
    return [(d, new) for d, new in imagined if all(_difference_of_motion(new, r) > TEXT.same_motion for r in records)]


def _difference_of_motion(one: Record, other: Record) -> float:
    """How far two motions lie apart in speed, stroke (logarithms of the rms), peak speed over rms, and mean current."""
    first, second = (_features_of_motion(r) for r in (one, other))
    return float(np.max(np.abs(first - second)))


def _features_of_motion(record: Record) -> Floats:
    motion, window = record.motion, record.window
    x, v, i = motion.x[window], motion.v[window], motion.i[window]
    peak = np.max(np.abs(v)) / np.std(v)
    return np.array([np.log(np.std(v)), np.log(np.std(x)), np.log(peak), np.mean(i) / max(np.max(np.abs(i)), 1e-300)])


def seconds_of(config: Mapping[str, Any]) -> float:
    excitation = test_from_config(dict(config)).excitation
    return excitation.samples / excitation.sample_rate_hz


def _rivals(found: Search, uncertain: str | None) -> list[Trial]:
    """The trial of the uncertain name and the best of the others; where no name held, the best two of the last."""
    if uncertain is not None:
        tried = [t for t in found.compared[uncertain].rivals if t.id == uncertain or t.id not in found.names]
        return _two_names(sorted(tried, key=lambda t: (t.id != uncertain, t.excess)))
    adds = [m for m in found.moves if m.rivals]
    return _two_names(sorted(adds[-1].rivals, key=lambda t: t.excess)) if adds else []


def _two_names(tried: Sequence[Trial]) -> list[Trial]:
    """The first trial and the first of another name: one element from two starts is no rival of itself."""
    return [*tried[:1], *[t for t in tried if t.name != tried[0].name][:1]]


def library(records: Sequence[Record]) -> list[Mapping[str, Any]]:
    """Tests that keep within the stroke, speed and current that the records have reached."""
    rate = 1.0 / min(r.dt for r in records)
    stroke = 0.5 * max(float(np.ptp(r.motion.x[r.window])) for r in records)
    speed = max(float(np.max(np.abs(r.motion.v[r.window]))) for r in records)
    levels = _levels(records)
    designs: list[Mapping[str, Any]] = []
    for part in (0.15, 0.5, 1.0):
        top = speed / (2.0 * np.pi * part * stroke)
        for fraction in (0.03, 0.2, 0.95):
            frequency = min(fraction * top, rate / 20.0)
            for level in levels or (None,):
                designs.append(_design(Kind.SINE, rate, part * stroke, frequency, level))
                designs.append(_design(Kind.TRIANGLE, rate, part * stroke, 0.6 * frequency, level))
    if len(levels) == 2:
        steps = [float(q) for q in np.linspace(levels[0], levels[-1], 4)]
        designs += [
            {
                "name": "next", "kind": str(Kind.STEPS), "sample_rate": rate, "amplitude": 0.7 * stroke,
                "frequency": 0.3 * speed / (2 * np.pi * 0.7 * stroke), "cycles": 12,
                "levels": [steps[0], steps[2], steps[1], steps[3]], "step_time": 0.5, "seed": 1,
            }
        ]  # fmt: skip
    return designs


def _levels(records: Sequence[Record]) -> list[float]:
    """The least and the largest current commanded in the records; one where it is constant, none without one."""
    currents = [r.motion.i[r.window] for r in records if r.has_current]
    if not currents:
        return []
    lowest, highest = zip(*(_ends(c) for c in currents), strict=True)
    low, high = min(lowest), max(highest)
    if high - low <= TEXT.steady * max(abs(low), abs(high)):
        return [0.5 * (low + high)]
    return [low, high]


def _ends(current: Floats) -> tuple[float, float]:
    """The least and the largest current that was commanded: the mean of what the noise of the reading can't tell from
    the extreme one, to the last digit above that noise, within what was read."""
    low, high = float(np.min(current)), float(np.max(current))
    # The median change from sample to sample is a standard deviation of white noise, to 5 %, but the slope of a smooth
    # current; the highest frequencies are those of the noise, but also the size of the steps where there is none.
    noise = min(float(np.median(np.abs(np.diff(current)))), high_frequency(current)[0]) if high > low else 0.0
    if noise == 0.0:
        return low, high
    alike, digits = 2.0 * CHANCE.sigmas * noise, -int(np.floor(np.log10(noise)))
    means = float(np.mean(current[current <= low + alike])), float(np.mean(current[current >= high - alike]))
    least, largest = (float(np.clip(round(m, digits) + 0.0, low, high)) for m in means)  # no −0
    return least, largest


def _design(kind: Kind, rate: float, amplitude: float, frequency: float, level: float | None) -> dict[str, Any]:
    config: dict[str, Any] = {
        "name": "next",
        "kind": str(kind),
        "sample_rate": rate,
        "amplitude": float(f"{amplitude:.4g}"),
        "frequency": float(f"{frequency:.4g}"),
        "cycles": int(np.clip(np.ceil(5.0 * frequency), 4, 60)),
        "settling_cycles": 2,
    }
    if kind == "triangle":  # round corners, so that a rig can follow
        slope = 4.0 * amplitude * frequency
        config["corner_time"] = float(f"{min(2.0 * slope / TEXT.corner_m_s2, _LONGEST_CORNER / frequency):.4g}")
    if level is not None:
        config["current"] = float(f"{level:.4g}")
    return config


@dataclass(frozen=True, slots=True)
class _Known:
    """What the records there are say of two models: all that a refit to them and to a new one needs."""

    free: Mask  # of the rival's parameters, (P,)
    triangle: Floats  # R of the rival's whitened gradient on all records, (K, K)
    apart: Floats  # Qᵀ of the whitened difference of the two, (K,)


def _known(best: Model, rival: Model, records: Sequence[Record]) -> _Known:
    free = free_parameters(rival, records)
    pairs = run_here(partial(_difference, best, rival, free), records)
    orthogonal, triangle = np.linalg.qr(np.concatenate([gradient for gradient, _ in pairs]))
    return _Known(free, triangle, orthogonal.T @ np.concatenate([apart for _, apart in pairs]))


def _difference(best: Model, rival: Model, free: Mask, record: Record) -> tuple[Floats, Floats]:
    """Whitened gradient of the rival, (M, K), and difference of the two models, (M,), on one record."""
    here = evaluate(rival, [record], free)
    force = record.measured - here.residuals[0]
    return here.gradients[0] / record.sigma, (predict(best, record)[0] - force) / record.sigma


def _worth(best: Model, rival: Model, known: _Known, new: Record) -> float | None:
    """Whitened difference on the new run that a refit of the rival to everything could not absorb, rms; None where one
    of the two can't run it.

    It is no more than the two differ by there: what a refit to the other runs does to the rest tells neither.
    """
    try:
        gradient, apart = _difference(best, rival, known.free, new)
    except SimulationError:
        return None
    basis = orthonormal(np.concatenate([known.triangle, gradient]))
    both = np.concatenate([known.apart, apart])
    left = both - basis @ (basis.T @ both)
    return min(float(np.sqrt(np.mean(d**2))) for d in (left[-apart.size :], apart))


def expected_record(config: Mapping[str, Any], records: Sequence[Record]) -> Record:
    """The record that a run of the design would give, without its force."""
    excitation = test_from_config(dict(config)).excitation
    period = excitation.period_samples if excitation.samples >= 2 * excitation.period_samples else 0
    noise = float(np.median([r.sigma for r in records]))
    # A period may hold several cycles, and the settling ones be a part of it: whole periods, counted from the end.
    whole = slice(excitation.samples % period if period else 0, None)
    settle = int(config.get("settling_cycles", 1))
    record = record_to_come(
        excitation.displacement_m[whole],
        excitation.sample_rate_hz,
        current=None if excitation.current_a is None else excitation.current_a[whole],
        period=period,
        settle=min(settle, excitation.samples // period - 1) if period else 0,
        sigma=noise,
        kind=str(excitation.kind),
    )
    return replace(compact(record), sigma=noise)


def in_words(config: Mapping[str, Any]) -> str:
    current = f" at {config['current']:.3g} A" if "current" in config else ""
    shape = _SHAPES[Kind(config["kind"])]
    return f"{shape} of {1e3 * config['amplitude']:.3g} mm at {config['frequency']:.3g} Hz{current}"
