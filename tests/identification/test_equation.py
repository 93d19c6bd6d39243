"""What has no name is written down as an equation, where a short one describes it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from identification.discrepancy.equation import Equation, describe
from identification.discrepancy.preparation import prepared
from identification.discrepancy.signatures import tangent
from identification.errors import DataError
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model, element
from identification.record import Record, compact, record_from_run
from tests.identification.specimens import campaign, run

BASE = Model(name="plain", elements=(element("viscous_damping", {"c": 900.0}),))
PITCH = 0.0041


def described(force_of: object) -> Equation:
    """The equation for a force added to a viscous damper of 900 N·s/m."""
    records = []
    for k in range(4):
        record = compact(record_from_run(run("none", k, 3)))
        m = record.motion
        noise = 3.0 * np.random.default_rng(k).standard_normal(m.x.size)
        records.append(replace(record, force=900.0 * m.v + force_of(record) + noise, sigma=3.0))  # type: ignore[operator]
    model = fit_records(BASE, records).model
    return describe(records, tangent(model, records))


def test_a_force_that_repeats_along_the_stroke_is_told_with_its_pitch_and_size() -> None:
    found = described(lambda r: 40.0 * np.sin(2 * np.pi * r.motion.x / PITCH + 0.7))
    pitch = float(re.search(r"x/([\d.]+) mm", found.terms[0][0]).group(1)) * 1e-3  # type: ignore[union-attr]
    assert pitch == pytest.approx(PITCH, rel=0.06)
    assert np.hypot(found.terms[0][1], found.terms[1][1]) == pytest.approx(40.0, rel=0.15)
    assert found.share > 0.8


def test_friction_that_grows_with_the_stroke_is_told_by_its_one_term() -> None:
    def force(r: Record) -> np.ndarray:
        return 2000.0 * np.abs(r.motion.x) * np.sign(r.motion.v)

    found = described(force)
    assert found.terms[0][0].startswith("|(x/")
    assert found.terms[0][0].endswith("·sgn v")
    size = float(re.search(r"x/([\d.]+) mm", found.terms[0][0]).group(1)) * 1e-3  # type: ignore[union-attr]
    assert found.terms[0][1] / size == pytest.approx(2000.0, rel=0.1)
    assert "of it on runs left out" in found.text


def test_noise_alone_gets_no_equation() -> None:
    found = described(lambda r: np.zeros(r.motion.x.size))
    assert found.terms == ()
    assert found.text.startswith("no short equation")


def test_a_curve_over_velocity_is_told_as_odd_or_even() -> None:
    assert "velocity, even" in described(lambda r: 60.0 * np.abs(r.motion.v) / 0.1).parity
    assert "displacement, odd" in described(lambda r: 3e6 * r.motion.x**3).parity


def test_the_runs_of_a_campaign_may_differ_in_length() -> None:
    train, _ = campaign("cogging", seed=2)
    records = [compact(record_from_run(r)) for r in train]
    assert len({r.measured.size for r in records}) > 1
    found = describe(records, tangent(BASE, records))
    assert 0.0 <= found.share <= 1.0


def test_terms_of_a_current_need_it_in_every_run() -> None:
    records = [compact(record_from_run(run("none", k, 3))) for k in range(2)]
    assert all(r.has_current for r in records)
    some = [records[0], replace(records[1], has_current=False)]
    for each in (some, some[::-1]):
        found = describe(each, tangent(BASE, each))
        assert not any(" A)" in name for name, _ in found.terms)


def test_zero_current_is_a_current_where_other_runs_have_more() -> None:
    without, with_current = run("none", 0, 3), run("none", 1, 3)
    zero = np.zeros(without.samples)
    recorded = replace(without, channels={**without.channels, "current": zero})
    valve = element("valve_damping", {"c_soft": 900, "c_firm": 2100, "u_soft": 0.0, "u_firm": 1.6, "w_knee": 0.6})
    controlled = Model(name="controlled", elements=(valve,))
    _, train, held = prepared(controlled, [recorded, with_current], [run("none", 2, 3)])
    assert all(r.has_current for r in (*train, *held))
    with pytest.raises(DataError, match="has no control current"):
        prepared(controlled, [recorded], [replace(recorded, run_id="again")])
