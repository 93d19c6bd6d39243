"""The complexity study: the indicator, the simplification, the ladder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.errors import DataError, ModelError, SimulationError
from identification.models import compare
from identification.models.protocol import SimulationModel
from identification.physical.elements import CATALOGUE
from identification.physical.literature import literature
from identification.physical.model import Element, Model
from identification.studies.complexity.designed import Designed, designed_tests
from identification.studies.complexity.plan import MATTERS, Step, check_steps
from identification.studies.complexity.result import Complexity, Indicator, Rung, Verdict
from identification.studies.complexity.tasks import Fits, answers
from identification.studies.pace import Tell, part, silent
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
    fits = Fits(runs)
    full = fits.of([model], part(tell, 0.0, 0.1), "fitting")[0][1]
    sigmas = known or {n: e.parameters[k].std or 0.0 for n, (e, k) in zip(full.names(), full.slots(), strict=True)}
    removable = [i for i in full.ids if _without(full, i) is not None]
    left = [_present(_without(full, i)) for i in removable]
    found = fits.of(left, part(tell, 0.1, 0.2), "fitting without each element")
    reduced = {i: one for i, (_, one) in zip(removable, found, strict=True)}
    indicators: list[Indicator] = []
    for k, step in enumerate(steps):
        share = 0.4 / len(steps)
        told = part(tell, 0.2 + k * share, 0.2 + (k + 1) * share)
        indicators += _of_step(step, full, sigmas, reduced, matters, told)
    vague = [f"{one.element}.{one.parameter}" for one in indicators if one.verdict is Verdict.MEASURE]
    designs = designed_tests(full, runs, list(dict.fromkeys(vague)), sigmas)
    indicators = [_with_test(one, designs) for one in indicators]
    simplified, dropped = _simplified(full, fits, steps, indicators, matters, part(tell, 0.6, 0.7))
    ladder = _ladder(full, fits, part(tell, 0.7, 0.85))
    if all(set(one.ids) != set(simplified.ids) for one in ladder):
        ladder.insert(-1, simplified)
    return Complexity(
        model=full, simplified=simplified, dropped=dropped, steps=tuple(s.name for s in steps), matters=matters,
        spread="the feasible set" if feasible else "the covariance of the fit", indicators=tuple(indicators),
        designed=tuple(designs.values()),
        ladder=_rungs(ladder, runs, steps, part(tell, 0.85, 1.0)), beside=_rungs(beside, runs, steps, silent),
    )  # fmt: skip


def _with_test(one: Indicator, designs: Mapping[str, Designed]) -> Indicator:
    """With the designed test in place of the kind of test, where there is one."""
    found = designs.get(f"{one.element}.{one.parameter}") if one.verdict is Verdict.MEASURE else None
    if found is None:
        return one
    return replace(one, test=f"{found.words}, which leaves {100.0 * found.left:.2g} % of the uncertainty")


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
    step: Step, full: Model, sigmas: dict[str, float], reduced: dict[str, Model], matters: float, tell: Tell
) -> list[Indicator]:
    """The indicators of every element at one step."""
    names, values = full.names(), full.values()
    low, high = full.bounds()
    moved = [(k, s) for k, name in enumerate(names) if (s := sigmas.get(name, 0.0)) > 0.0]
    models: list[Model] = []
    for k, sigma in moved:
        for side in (-1.0, 1.0):
            own = values.copy()
            own[k] = min(max(values[k] + side * sigma, low[k]), high[k])
            models.append(full.with_values(own))
    output, *given = answers(step, [full, *models, *reduced.values()], tell)
    if not np.isfinite(output):
        raise DataError(f"step '{step.name}': the fitted model cannot take it: its simulation fails")
    size = max(abs(output), _LEAST_SHARE)
    effects = {names[k]: 0.5 * abs(given[2 * n + 1] - given[2 * n]) / size for n, (k, _) in enumerate(moved)}
    gone = {i: abs(a - output) / size for i, a in zip(reduced, given[len(models) :], strict=True)}
    return [_indicator(step.name, e, effects, gone.get(e.id), matters) for e in full.elements]


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
    full: Model, fits: Fits, steps: Sequence[Step], indicators: Sequence[Indicator], matters: float, tell: Tell
) -> tuple[Model, tuple[str, ...]]:
    """The model without what no step needs, and what was left out."""
    worth: dict[str, float] = {}
    for id_ in full.ids:
        own = [one for one in indicators if one.element == id_]
        if own and all(one.verdict is Verdict.SIMPLIFY for one in own):
            worth[id_] = max(one.without or 0.0 for one in own)
    wanted = [answers(step, [full], silent)[0] for step in steps]
    left, dropped = full, list[str]()
    for k, id_ in enumerate(sorted(worth, key=lambda one: worth[one])):
        tell(k / len(worth), f"simplifying: without {id_}")
        smaller = _without(left, id_)
        if smaller is None:
            continue
        fitted = fits.of([smaller], silent, "")[0][1]
        came = [answers(step, [fitted], silent)[0] for step in steps]
        changes = [abs(c - w) / max(abs(w), _LEAST_SHARE) for c, w in zip(came, wanted, strict=True)]
        if max(changes) < matters:
            left, dropped = fitted, [*dropped, id_]
    return (replace(left, name=f"{full.name}, simplified") if dropped else full), tuple(dropped)


def _ladder(full: Model, fits: Fits, tell: Tell) -> list[Model]:
    """From a linear dashpot to the full model: each rung lacks the element of the next that matters least."""
    rungs = [replace(full, name=f"full: {full.name}")]
    now = full
    while True:
        smaller = [m for i in now.ids if (m := _without(now, i)) is not None]
        if not smaller:
            break
        done = 1.0 - len(now.ids) / len(full.ids)
        found = fits.of(smaller, part(tell, done, done), f"the ladder: {len(now.ids) - 1} elements")
        now = min(found, key=lambda one: one[0])[1]
        rungs.append(replace(now, name=" + ".join(now.ids)))
    linear = fits.of([literature("linear dashpot")], silent, "")[0][1]
    if set(rungs[-1].ids) != set(linear.ids):
        rungs.append(linear)
    return rungs[::-1]


def _rungs(
    models: Sequence[SimulationModel], runs: Sequence[Run], steps: Sequence[Step], tell: Tell
) -> tuple[Rung, ...]:
    if not models:
        return ()
    rate = float(np.median([one.sample_rate_hz for one in runs]))
    came = [_outputs(step, models, tell) for step in steps]
    rungs = []
    for k, row in enumerate(compare(models, runs).rows):
        outputs = tuple(one[k][0] for one in came)
        why = next((one[k][1] for one in came if one[k][1]), "")
        cost = None if row.cost_ns is None else 1e-9 * row.cost_ns * rate
        rungs.append(
            Rung(label=row.label, kind=row.kind, free=row.free, rrmsse=row.rrmsse, cost=cost, outputs=outputs, why=why)
        )
    return tuple(rungs)


def _outputs(step: Step, models: Sequence[SimulationModel], tell: Tell) -> list[tuple[float | None, str]]:
    """The output of a step with each model, or why there is none."""
    found = dict[int, tuple[float | None, str]]()
    for k, model in enumerate(models):
        try:
            step.check(model)
        except (DataError, SimulationError, ModelError) as error:
            found[k] = None, str(error)
    physical = [k for k, one in enumerate(models) if k not in found and isinstance(one, Model)]
    given = answers(step, [one for k in physical if isinstance(one := models[k], Model)], tell)
    found |= {k: (a, "") if np.isfinite(a) else (None, f"{step.name}: its simulation fails")
              for k, a in zip(physical, given, strict=True)}  # fmt: skip
    for k, model in enumerate(models):
        if k not in found:
            try:
                found[k] = step(model), ""
            except (DataError, SimulationError, ModelError) as error:
                found[k] = None, str(error)
    return [found[k] for k in range(len(models))]
