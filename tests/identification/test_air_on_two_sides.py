"""Free air in a damper whose rod takes half of the area from one side: it gives way far, and not alike both ways."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.discrepancy import explain
from identification.discrepancy.naming import Search
from identification.discrepancy.needless import drop_departures
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model, element
from identification.record import compact, record_from_run
from rigctl.runfile import Run
from tests.identification.ordinary import motion, recorded

Floats = NDArray[np.float64]

DAMPING, AIR, HALF, SIDE = 3000.0, 8e-3, 700.0, 0.5
BASE = Model(name="viscous", elements=(element("viscous_damping", {"c": 2500.0}),))


def force_of(t: Floats, v: Floats) -> Floats:
    """Force of a viscous valve behind its air, from df/dt = (v − f/c)·(f_s + |f|)²/(h_s·f_s), (N,), N.

    On either side the area is w times the mean: the air yields h_s = air/2/w in all, half of it under f_s = half·w.
    """

    def rate(now: float, f: Floats) -> Floats:
        w = np.where(f > 0.0, 1.0 + SIDE, 1.0 - SIDE)
        return np.asarray(
            (np.interp(now, t, v) - f / DAMPING) * (HALF * w + np.abs(f)) ** 2 / (0.5 * AIR / w * HALF * w)
        )

    found = solve_ivp(rate, (t[0], t[-1]), [0.0], method="LSODA", t_eval=t, rtol=1e-6, atol=1e-3, max_step=2e-3)
    return np.asarray(found.y[0])


def aerated(seed: int, amplitude: float) -> Run:
    t, x, v = motion(seed, amplitude, seconds=8.0)
    return recorded("twin-tube", seed, x, force_of(t, v))


@pytest.mark.slow
def test_air_that_yields_by_two_areas_is_named_with_both_and_nothing_beside_it() -> None:
    found = explain(BASE, [aerated(1, 0.02), aerated(2, 0.03), aerated(3, 0.012)], [aerated(4, 0.025)])
    assert [e.element for e in found.effects] == ["aerated_oil"]
    assert found.held_out.closed is not None
    assert found.held_out.closed > 0.9
    values = found.model.element("aerated_oil").values()
    assert values["side"] == pytest.approx(SIDE, abs=0.05)
    assert values["air"] * values["f_half"] == pytest.approx(AIR * HALF, rel=0.15)
    again = explain(found.model, [aerated(1, 0.02), aerated(2, 0.03), aerated(3, 0.012)], [aerated(4, 0.025)])
    assert not again.effects


def test_the_oil_that_yields_beside_its_air_is_no_effect_of_its_own_be_the_air_named_or_given() -> None:
    records = [compact(record_from_run(aerated(1, 0.02)))]
    model = BASE
    for e in (element("aerated_oil", {"air": AIR, "f_half": HALF}), element("series_compliance", {"k": 8e5, "c": 0.0})):
        model = model.with_element(e)
    fit = fit_records(model, records)
    for names in (("aerated_oil", "series_compliance"), ("series_compliance",)):
        state = Search(fit=fit, names=names, excess=fit.chi2 - fit.samples, given=BASE)
        assert drop_departures(state, records).names == names[:-1]
