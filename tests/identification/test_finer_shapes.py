"""Finer shapes that the data show: how large an effect is may follow the current, as its valve does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.refine import refine_curves
from identification.physical.elements import CATALOGUE
from identification.physical.model import element
from identification.record import compact, record_from_run
from tests.identification.specimens import AS_SIMULATED, FS, run

NOISE = 3.0


def refined(slope: float) -> Fit:
    """The fit of an asymmetry to runs of a valve that resists so much more in one direction at 1 A more."""
    records = []
    for k in (0, 1, 2, 3):
        made = run("none", k, seed=5, noise=NOISE)
        speed = np.abs(np.gradient(made.channels["displacement"], 1.0 / FS))
        by_current = 150.0 + slope * (made.channels["current"] - 0.9)
        channels = {**made.channels, "force": made.channels["force"] + by_current * speed}
        records.append(compact(record_from_run(replace(made, channels=channels))))
    start = AS_SIMULATED.with_element(element("damping_asymmetry", {"c_a": 100.0}))
    return refine_curves(fit_records(start, records), records)


def test_an_asymmetry_that_follows_the_current_gets_its_slope() -> None:
    own = refined(120.0).model.element("damping_asymmetry")
    assert own.values()["c_a_control"] == pytest.approx(120.0, rel=0.1)
    assert own.values()["c_a"] + 0.9 * own.values()["c_a_control"] == pytest.approx(150.0, rel=0.05)


def test_one_that_does_not_keeps_its_canonical_form() -> None:
    own = refined(0.0).model.element("damping_asymmetry")
    assert own.values() == {"c_a": pytest.approx(150.0, rel=0.05), "c_a_control": 0.0, "share": 0.0}


def test_a_skew_that_is_early_and_lags_as_much_is_a_mere_shape_and_denies_its_name() -> None:
    denied = CATALOGUE["force_delay"].denied
    assert denied is not None
    assert denied({"tau": -5e-4, "lag": 5e-4, "turn": 0.0}, [])
    assert not denied({"tau": -1e-3, "lag": 0.0, "turn": 0.0}, [])  # a late displacement
    assert not denied(
        {"tau": -1e-4, "lag": 0.02, "turn": 0.0}, []
    )  # a low-pass of first order, to the accuracy of a fit
    assert not denied({"tau": 2e-3, "lag": 3e-3, "turn": 0.0}, [])
