"""A curve beside another curve, or a loop beside another loop, may be what is wrong with the form of that."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Compared, Search
from identification.discrepancy.rivals import beside_a_curve, beside_a_loop
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Element, Model, element
from tests.identification.specimens import records_with

CURVES = {
    "tanh_hysteresis": element("tanh_hysteresis", {"alpha": 30.0, "alpha_control": 5.0, "beta": 20.0, "delta": 0.1}),
    "valve_damping": element(
        "valve_damping", {"c_soft": 100.0, "c_firm": 300.0, "u_soft": 0.0, "u_firm": 1.0, "w_knee": 0.1}
    ),
    "relief_valve": element("relief_valve", {"c_drop": 100.0, "w_knee": 0.1}),
    "coulomb_friction": element("coulomb_friction", {"f_c": 20.0}),
    "reversal_force_lag": element("reversal_force_lag", {"length": 1e-3}),
    "series_compliance": element("series_compliance", {"k": 1e6, "c": 1e3}),
    "linear_stiffness": element("linear_stiffness", {"k": 100.0}),
}
DASHPOT = element("viscous_damping", {"c": 800.0})


def found(base: Element, *closing: str) -> Search:
    """A search that found these names beside a base, each of which closes more than the one before."""
    records = records_with("none")[:1]
    given = Model(name="given", elements=(base,))
    model = given
    for name in closing:
        model = model.with_element(CURVES[name])
    fit, rest = (fit_records(m, records, max_iterations=0) for m in (model, given))
    worse = {n: replace(rest, chi2=rest.chi2 * (2.0 + k)) for k, n in enumerate(closing)}
    compared = {n: Compared(without=f, start=f, beside=(), rivals=()) for n, f in worse.items()}
    return Search(fit=fit, names=closing, excess=excess_of(fit), given=given, compared=compared)


@pytest.mark.parametrize(
    ("base", "closing", "doubted"),
    [
        (DASHPOT, ("valve_damping", "tanh_hysteresis"), {"valve_damping"}),
        (DASHPOT, ("tanh_hysteresis", "valve_damping"), {"tanh_hysteresis"}),
        (DASHPOT, ("coulomb_friction", "relief_valve"), set()),
        (CURVES["tanh_hysteresis"], ("valve_damping",), {"valve_damping"}),
        (CURVES["tanh_hysteresis"], ("coulomb_friction",), set()),
        (CURVES["valve_damping"], ("relief_valve",), set()),
    ],
)
def test_of_two_curves_the_one_that_closes_less_may_be_the_form_of_the_other(
    base: Element, closing: tuple[str, ...], doubted: set[str]
) -> None:
    search = found(base, *closing)
    assert {name for name in closing if beside_a_curve(search, name)} == doubted


@pytest.mark.parametrize(
    ("base", "closing", "doubted"),
    [
        (DASHPOT, ("reversal_force_lag", "coulomb_friction"), {"reversal_force_lag"}),
        (DASHPOT, ("coulomb_friction", "reversal_force_lag"), {"coulomb_friction"}),
        (DASHPOT, ("series_compliance", "linear_stiffness"), set()),
        (DASHPOT, ("linear_stiffness", "series_compliance"), set()),
        (CURVES["coulomb_friction"], ("series_compliance",), {"series_compliance"}),
        (CURVES["tanh_hysteresis"], ("reversal_force_lag",), set()),
    ],
)
def test_of_two_that_act_where_the_motion_turns_the_one_that_closes_less_may_be_the_form_of_the_other(
    base: Element, closing: tuple[str, ...], doubted: set[str]
) -> None:
    search = found(base, *closing)
    assert {name for name in closing if beside_a_loop(search, name)} == doubted
