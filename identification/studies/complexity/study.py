"""The complexity study: the indicator, the simplification, the ladder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.compute import run
from identification.errors import DataError, ModelError, SimulationError
from identification.fitting import fit
from identification.models import compare
from identification.models.protocol import SimulationModel
from identification.physical.elements import CATALOGUE
from identification.physical.literature import literature
from identification.physical.model import Element, Model
from identification.studies.complexity.plan import MATTERS, Step, check_steps
from identification.studies.complexity.result import Complexity, Indicator, Rung, Verdict
from identification.studies.pace import Tell, silent
from rigctl.runfile import Run

_LEAST_SHARE = 1e-300


def complexity(
    model: Model,
    runs: Sequence[Run],
    steps: Sequence[Step],
    *,
    matters: float = MATTERS,
    feasible: Sequence[dict[str, float]] = (),
    beside: Sequence[SimulationModel] = (),
    tell: Tell = silent,
) -> Complexity:
    """What each element of the model is worth at each step of a plan; the simplified model; the ladder.

    The model is fitted to the runs first. Its uncertainty is the covariance of that fit or, where given, the standard
    deviation of each parameter over a feasible set (rows of `element.parameter` to value). A step asks to measure more
    where one standard deviation changes its output by more than `matters`, and to simplify where the element can be
    left out for less. What every step would leave out is left out, the least first, as long as no step changes by more
    than `matters`; the rest is fitted again.

    Raises
    ------
    DataError, ModelError
        Before the work: no step, a step that the model cannot take, a feasible set without a parameter of the model,
        runs that cannot be used.

    References
    ----------
    Complexity of a yaw damper's model in a bogie (ISMA 2024), section 3: the indicator.
    """
    check_steps(tuple(steps), matters)
    for step in steps:
        step.check(model)
    known = _spread(model, feasible)
    tell(0.0, "fitting")
    full = fit(model, runs).model
    sigmas = known or {n: e.parameters[k].std or 0.0 for n, (e, k) in zip(full.names(), full.slots(), strict=True)}
    tell(0.1, "fitting without each element")
    removable = [i for i in full.ids if _without(full, i) is not None]
    found = run(_Fitted(runs), [_present(_without(full, i)) for i in removable])
    reduced = {i: one for i, (_, one) in zip(removable, found, strict=True)}
    indicators: list[Indicator] = []
    for k, step in enumerate(steps):
        tell(0.2 + 0.4 * k / len(steps), f"{step.name}")
        indicators += _of_step(step, full, sigmas, reduced, matters)
    tell(0.6, "simplifying")
    simplified, dropped = _simplified(full, runs, steps, indicators, matters)
    tell(0.7, "the ladder")
    ladder = _ladder(full, runs)
    if all(set(one.ids) != set(simplified.ids) for one in ladder):
        ladder.insert(-1, simplified)
    return Complexity(
        model=full, simplified=simplified, dropped=dropped, steps=tuple(s.name for s in steps), matters=matters,
        spread="the feasible set" if feasible else "the covariance of the fit", indicators=tuple(indicators),
        ladder=_rungs(ladder, runs, steps), beside=_rungs(beside, runs, steps),
    )  # fmt: skip


class _Fitted:
    """A task: misfit and model of a fit to the runs."""

    def __init__(self, runs: Sequence[Run]) -> None:
        self._runs = tuple(runs)

    def __call__(self, model: Model) -> tuple[float, Model]:
        found = fit(model, self._runs)
        return found.chi2, found.model


def _present(model: Model | None) -> Model:
    assert model is not None  # the caller has seen to it
    return model


def _spread(model: Model, feasible: Sequence[dict[str, float]]) -> dict[str, float]:
    """Standard deviation of each parameter over a feasible set; empty where none is given."""
    if not feasible:
        return {}
    if len(feasible) < 2:
        raise DataError("the feasible set has one member: a spread needs two or more")
    unknown = [name for name in feasible[0] if name not in model.names()]
    if unknown:
        raise ModelError(f"the feasible set has {unknown[0]}, which '{model.name}' has not: give the set of this model")
    return {name: float(np.std([row[name] for row in feasible])) for name in feasible[0]}


def _without(model: Model, id_: str) -> Model | None:
    """The model without an element; None where nothing, or nothing that can be fitted, would be left."""
    try:
        left = model.without(id_)
    except ModelError:
        return None
    return left if left.free().any() else None


def _of_step(
    step: Step, full: Model, sigmas: dict[str, float], reduced: dict[str, Model], matters: float
) -> list[Indicator]:
    """The indicators of every element at one step."""
    output = step(full)
    size = max(abs(output), _LEAST_SHARE)
    names, values = full.names(), full.values()
    low, high = full.bounds()
    moved = [(k, s) for k, name in enumerate(names) if (s := sigmas.get(name, 0.0)) > 0.0]
    models: list[Model] = []
    for k, sigma in moved:
        for side in (-1.0, 1.0):
            own = values.copy()
            own[k] = min(max(values[k] + side * sigma, low[k]), high[k])
            models.append(full.with_values(own))
    answers = run(_Answer(step), [*models, *reduced.values()])
    effects = {names[k]: 0.5 * abs(answers[2 * n + 1] - answers[2 * n]) / size for n, (k, _) in enumerate(moved)}
    gone = {i: abs(a - output) / size for i, a in zip(reduced, answers[len(models) :], strict=True)}
    return [_indicator(step.name, e, effects, gone.get(e.id), matters) for e in full.elements]


class _Answer:
    """A task: the output of a step."""

    def __init__(self, step: Step) -> None:
        self._step = step

    def __call__(self, model: Model) -> float:
        try:
            return self._step(model)
        except SimulationError:
            return np.inf  # such a model does not do for this step


def _indicator(step: str, e: Element, effects: dict[str, float], without: float | None, matters: float) -> Indicator:
    own = {spec.name: effects.get(f"{e.id}.{spec.name}", 0.0) for spec in e.spec.parameters}
    worst = max(own, key=lambda name: own[name], default="")
    uncertain = own.get(worst, 0.0)
    verdict, test = Verdict.KEEP, ""
    if uncertain > matters:
        spec = CATALOGUE[e.name].parameters[e.spec.index(worst)]
        verdict, test = Verdict.MEASURE, f"a test with {spec.remedy.value}"
    elif without is not None and without < matters:
        verdict = Verdict.SIMPLIFY
    return Indicator(
        step=step, element=e.id, uncertain=uncertain, parameter=worst if uncertain > 0.0 else "", without=without,
        verdict=verdict, test=test,
    )  # fmt: skip


def _simplified(
    full: Model, runs: Sequence[Run], steps: Sequence[Step], indicators: Sequence[Indicator], matters: float
) -> tuple[Model, tuple[str, ...]]:
    """The model without what no step needs, and what was left out."""
    worth: dict[str, float] = {}
    for id_ in full.ids:
        own = [one for one in indicators if one.element == id_]
        if own and all(one.verdict is Verdict.SIMPLIFY for one in own):
            worth[id_] = max(one.without or 0.0 for one in own)
    wanted = [step(full) for step in steps]
    left, dropped = full, list[str]()
    for id_ in sorted(worth, key=lambda one: worth[one]):
        smaller = _without(left, id_)
        if smaller is None:
            continue
        fitted = fit(smaller, runs).model
        changes = [abs(_Answer(s)(fitted) - w) / max(abs(w), _LEAST_SHARE) for s, w in zip(steps, wanted, strict=True)]
        if max(changes) < matters:
            left, dropped = fitted, [*dropped, id_]
    return (replace(left, name=f"{full.name}, simplified") if dropped else full), tuple(dropped)


def _ladder(full: Model, runs: Sequence[Run]) -> list[Model]:
    """From a linear dashpot to the full model: each rung lacks the element of the next that matters least."""
    rungs = [replace(full, name=f"full: {full.name}")]
    now = full
    while True:
        smaller = [m for i in now.ids if (m := _without(now, i)) is not None]
        if not smaller:
            break
        found = run(_Fitted(runs), smaller)
        now = min(found, key=lambda one: one[0])[1]
        rungs.append(replace(now, name=" + ".join(now.ids)))
    linear = fit(literature("linear dashpot"), runs).model
    if set(rungs[-1].ids) != set(linear.ids):
        rungs.append(linear)
    return rungs[::-1]


def _rungs(models: Sequence[SimulationModel], runs: Sequence[Run], steps: Sequence[Step]) -> tuple[Rung, ...]:
    if not models:
        return ()
    rate = float(np.median([one.sample_rate_hz for one in runs]))
    rungs = []
    for model, row in zip(models, compare(models, runs).rows, strict=True):
        outputs: list[float | None] = []
        why = ""
        for step in steps:
            try:
                step.check(model)
                outputs.append(step(model))
            except (DataError, SimulationError, ModelError) as error:
                outputs.append(None)
                why = str(error)
        cost = None if row.cost_ns is None else 1e-9 * row.cost_ns * rate
        rungs.append(
            Rung(label=row.label, kind=row.kind, free=row.free, rrmsse=row.rrmsse, cost=cost, outputs=tuple(outputs),
                 why=why)
        )  # fmt: skip
    return tuple(rungs)
