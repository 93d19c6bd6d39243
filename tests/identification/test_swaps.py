"""When one name may take the place of another."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identification.criteria import BUDGET, CHANCE
from identification.discrepancy import choice, naming, trials
from identification.discrepancy.candidates import guesses
from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Search
from identification.fitting.leastsquares import fit_records
from identification.physical.model import element
from identification.scales import scales_of
from tests.identification.specimens import AS_SIMULATED as BASE
from tests.identification.specimens import records_with


@pytest.mark.parametrize(("at", "refused"), [("high", False), ("low", True)])
def test_a_yield_force_that_follows_the_current_may_be_as_steep_as_the_search_goes(at: str, refused: bool) -> None:
    records = records_with("none")
    [tanh, *_] = guesses("tanh_hysteresis", scales_of(records, gap=50.0))
    k = [p.name for p in tanh.spec.parameters].index("beta")
    limit = getattr(tanh.parameters[k], at)
    steep = tuple(replace(p, value=limit) if j == k else p for j, p in enumerate(tanh.parameters))
    model = replace(BASE, elements=(BASE.elements[0],))
    fit = fit_records(model.with_element(replace(tanh, parameters=steep)), records, max_iterations=0)
    trial = trials.trial_of(fit, "tanh_hysteresis", fit_records(model, records, max_iterations=0), records, 0.0)
    assert choice.on_bound(trial) == refused


@pytest.mark.parametrize(("times", "name"), [(0.5, "linear_stiffness"), (1e3, "stribeck_friction")])
def test_a_refused_name_keeps_its_place_where_the_best_simpler_one_leaves_several_times_as_much(
    times: float, name: str
) -> None:
    records = records_with("coulomb_friction")
    friction = element("stribeck_friction", {"f_c": 10.0, "f_s": 20.0, "w_s": 0.01})
    rest, named = (fit_records(m, records) for m in (BASE, BASE.with_element(friction)))
    own = trials.trial_of(named, "stribeck_friction", rest, records, 0.0)
    own = replace(own, contribution=0.0)  # refused: it has no force of its own
    spring = fit_records(BASE.with_element(element("linear_stiffness", {"k": 8e3})), records, max_iterations=0)
    other = trials.trial_of(spring, "linear_stiffness", rest, records, 0.0)
    limit = BUDGET.far_behind * max(own.excess, CHANCE.slack)
    other = replace(other, excess=times * limit, closed=0.0)
    state = Search(
        fit=named, names=("stribeck_friction",), excess=excess_of(named), given=BASE, base_excess=excess_of(rest),
        compared={"stribeck_friction": naming._comparison(rest, (), [own, other])},
    )  # fmt: skip
    found = naming.repeat_trials(state, "stribeck_friction", records, trials=lambda *_, **__: [own, other])
    assert found.names == (name,)


def test_a_name_closes_no_more_than_what_an_earlier_step_left_without_it() -> None:
    records = records_with("linear_stiffness")
    pushed = BASE.with_element(element("force_offset", {"F0": 1.0}))
    models = (
        BASE,
        BASE.with_element(element("cubic_stiffness", {"k3": 1e7})),
        pushed.with_element(element("linear_stiffness", {"k": 8e3})),
    )
    rest, curved, both = (fit_records(m, records) for m in models)
    start = Search(fit=rest, names=(), excess=excess_of(rest), given=BASE, base_excess=excess_of(rest))
    first = replace(start, fit=curved, names=("cubic_stiffness",), excess=excess_of(curved), before=start)
    own = trials.trial_of(both, "linear_stiffness", rest, records, 0.0)
    state = replace(
        start, fit=both, names=("force_offset", "linear_stiffness"), excess=excess_of(both), before=first,
        compared={"linear_stiffness": naming._comparison(rest, (), [own])},
    )  # fmt: skip
    assert excess_of(curved) < excess_of(fit_records(both.model.without("linear_stiffness"), records))
    found = naming.repeat_trials(state, "linear_stiffness", records, trials=lambda *_, **__: [own])
    assert "linear_stiffness" in found.names
    assert excess_of(found.compared["linear_stiffness"].without) == excess_of(curved)
