"""Which hidden effects the runs of a case show, and which names can stand for them: decided before any identification.

An effect is the difference of the force with and without it, all others present. What a refit of the base and other
strengths of the other effects would absorb on the training runs is taken off; the rest on the held-out runs, in noise
deviations, is its excess.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.machines.bases import Base, Seen, force_of_base, joined, refitted, slope_of_base, tangents
from benchmarks.machines.textbook import ADDED, Setting

Row = NDArray[np.float64]
Names = tuple[str, ...]

# With its truth fitted a case leaves one noise deviation, with the refitted base √(1 + excess²). The truth is to win by
# three: an effect below is not identifiable.
LEAST_EXCESS = ((1.0 + 3.0) ** 2 - 1.0) ** 0.5
AS_GOOD = 1.25  # another name may leave this multiple of what the first one leaves …
AS_GOOD_EXCESS = 1.0  # … or this many noise deviations, and is then right as well
IMITATED = 0.35  # share of an effect outside the catalogue that a name may leave to be no error
FORM_EXCESS = 1.0  # noise deviations: a base that leaves less of the machine without effects has the right form
LEAST_CLOSED = 0.5  # share of the excess that a name has to close to be right, unless it is the first
# Names whose column to first order may describe the effect worse than the name does, and the share of the excess that
# is taken for what the name would leave.
CRUDE = frozenset({"series_compliance", "free_play", "aerated_oil", "temperature_fade", "position_dependent_damping",
                   "control_lag", "control_delay", "control_saturation", "control_hysteresis",
                   "reversal_force_lag"})  # fmt: skip
WELL_DESCRIBED = 0.15
MOST_SAMPLES = 1200  # of a run, in these fits


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """How visible an effect is, and the sets of names that describe it."""

    excess: float  # noise deviations, held-out runs
    accepted: tuple[Names, ...]
    left: tuple[tuple[Names, float], ...]  # of every set that was tried: noise deviations that stay


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """The true force of all runs without noise, training first; `without[k]` lacks effect k."""

    runs: tuple[Seen, ...]
    without: tuple[tuple[Row, ...], ...]
    trained: int
    noise_n: float


def fitted_base(base: Base, runs: Sequence[Seen]) -> Base:
    """The base refitted to runs."""
    return refitted(base, joined([r.at(r.picked(MOST_SAMPLES)) for r in runs]))


def rms(row: Row) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(row))))


def noise_by_motion(base: Base, runs: Sequence[Seen], place_m: float, rate_hz: float, fastest_hz: float) -> float:
    """Force that the base makes of the noise of the displacement, N rms: white, to three times the motion's frequency.

    Of a noise σ in a band up to f the speed has 2πf·σ/√3 and the acceleration (2πf)²·σ/√5.
    """
    top = min(3.0 * fastest_hz, 0.5 * rate_hz)
    inside, omega = place_m * np.sqrt(2.0 * top / rate_hz), 2.0 * np.pi * top
    sizes = {"x": inside, "v": inside * omega / np.sqrt(3.0), "a": inside * omega**2 / np.sqrt(5.0)}
    seen = joined([r.at(r.picked(MOST_SAMPLES)) for r in runs])
    return float(np.sqrt(np.sum([np.mean(slope_of_base(base, seen, n, s) ** 2) * s**2 for n, s in sizes.items()])))


def excess_of_base(base: Base, campaign: Campaign) -> float:
    """What the refitted base leaves on the held-out runs, in noise deviations."""
    held = campaign.runs[campaign.trained :]
    left = np.concatenate([(r.force - force_of_base(base, r))[r.moving] for r in held])
    return rms(left) / campaign.noise_n


def shown(base: Base, campaign: Campaign, number: int, candidates: Sequence[Names], sure: int = 1) -> Shown:
    """Excess of effect `number`, and which of the candidate sets of names can stand for it; the first `sure` always."""
    picked = [r.picked(MOST_SAMPLES) for r in campaign.runs]
    effect = [r.force - w for r, w in zip(campaign.runs, campaign.without[number], strict=True)]
    target = [e[at] for e, at in zip(effect, picked, strict=True)]
    span = [_beside(base, campaign, number, k)[at] for k, at in enumerate(picked)]
    excess = _left(target, span, campaign.trained) / campaign.noise_n
    tried = candidates or [(name,) for name in _possible(campaign)]  # outside the catalogue any name may come near
    added = _columns(base, campaign, campaign.without[number], {n for names in tried for n in names}, picked)
    left = [(names, _least(target, span, [added[n] for n in names], campaign)) for names in tried]
    if not candidates:
        right = [names for names, stays in left if stays <= max(IMITATED * excess, AS_GOOD_EXCESS)]
        return Shown(excess=excess, accepted=tuple(right), left=tuple(sorted(left, key=lambda n: n[1])[:3]))
    least = left[0][1]
    if CRUDE & set(left[0][0]):
        least = min(least, WELL_DESCRIBED * excess)
    most = min(max(AS_GOOD * least, AS_GOOD_EXCESS), max((1.0 - LEAST_CLOSED) * excess, 1.05 * least))
    right = [names for k, (names, stays) in enumerate(left) if k < sure or stays <= most]
    return Shown(excess=excess, accepted=tuple(right), left=tuple(left))


def names_for_the_form(base: Base, campaign: Campaign, plain: Sequence[Row]) -> tuple[float, tuple[str, ...]]:
    """What the refitted base leaves of the machine without effects, in noise deviations, and the names that close half.

    These are true too: the curve of the base is not that of the machine.
    """
    own = replace(campaign, runs=tuple(replace(r, force=f) for r, f in zip(campaign.runs, plain, strict=True)))
    fit = fitted_base(base, own.runs[: own.trained])
    picked = [r.picked(MOST_SAMPLES) for r in own.runs]
    simulated = [force_of_base(fit, r) for r in own.runs]
    target = [(r.force - f)[at] for r, f, at in zip(own.runs, simulated, picked, strict=True)]
    span = [tangents(fit, r)[at] for r, at in zip(own.runs, picked, strict=True)]
    excess = _left(target, span, own.trained) / own.noise_n
    if excess < FORM_EXCESS:
        return excess, ()
    names = _possible(own)
    added = _columns(fit, own, simulated, set(names), picked)
    near = [n for n in names if _least(target, span, [added[n]], own) <= (1.0 - LEAST_CLOSED) * excess]
    return excess, tuple(near)


def _possible(campaign: Campaign) -> list[str]:
    """All names, without those of the control path where there is no current."""
    passive = not any(np.any(r.i) for r in campaign.runs)
    return [name for name in ADDED if not (passive and name.startswith("control_"))]


def _beside(base: Base, campaign: Campaign, number: int, run: int) -> NDArray[np.float64]:
    """What else may change when the effect is missing: parameters of the base, strengths of the other effects."""
    seen = campaign.runs[run]
    others = [seen.force - w[run] for k, w in enumerate(campaign.without) if k != number]
    return np.column_stack([tangents(base, seen), *others]) if others else tangents(base, seen)


def _left(target: Sequence[Row], span: Sequence[NDArray[np.float64]], trained: int) -> float:
    """Rms on the held-out runs of what the columns, fitted to the training runs, do not explain."""
    columns, effect = np.concatenate(span[:trained]), np.concatenate(target[:trained])
    norms = np.sqrt(np.sum(columns**2, axis=0))
    keep = norms > 1e-12 * max(float(np.max(norms, initial=0.0)), 1e-300)
    weights, *_ = np.linalg.lstsq(columns[:, keep] / norms[keep], effect, rcond=1e-8)
    held = [t - c[:, keep] @ (weights / norms[keep]) for t, c in zip(target[trained:], span[trained:], strict=True)]
    return rms(np.concatenate(held))


def _columns(
    base: Base, campaign: Campaign, without: Sequence[Row], names: set[str], picked: Sequence[NDArray[np.intp]]
) -> dict[str, list[list[NDArray[np.float64]]]]:
    """For every name and every trial of its shape: the columns of each run."""
    top = joined(campaign.runs)
    stroke, speed = float(np.max(np.abs(top.x))), float(np.max(np.abs(top.v)))
    current = float(np.max(np.abs(top.i)))
    out: dict[str, list[list[NDArray[np.float64]]]] = {}
    for name in sorted(names):
        runs = [
            ADDED[name](
                Setting(
                    seen=r, force=without[k], base=base, stroke_m=stroke, speed_m_s=speed,
                    current_a=current,
                )
            )
            for k, r in enumerate(campaign.runs)
        ]  # fmt: skip
        out[name] = [[run[j][at] for run, at in zip(runs, picked, strict=True)] for j in range(len(runs[0]))]
    return out


def _least(
    target: Sequence[Row],
    span: Sequence[NDArray[np.float64]],
    names: Sequence[Sequence[Sequence[NDArray[np.float64]]]],
    campaign: Campaign,
) -> float:
    """Noise deviations that the best shapes of the names leave; the names' shapes are chosen one after the other."""
    best = list(span)
    stays = _left(target, best, campaign.trained)
    for shapes in names:
        trials = [[np.column_stack([b, s]) for b, s in zip(best, shape, strict=True)] for shape in shapes]
        lefts = [_left(target, trial, campaign.trained) for trial in trials]
        if lefts:
            best, stays = trials[int(np.argmin(lefts))], min(lefts)
    return stays / campaign.noise_n
