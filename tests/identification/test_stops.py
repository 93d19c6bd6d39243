"""Stop operators of the displacement: bounded, forgetting, and what a network gains by them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.blackbox import Structure, identify, regressors, write_identified
from identification.blackbox.choose import FED_BACK, Candidate, Judged, in_order
from identification.blackbox.stops import LIMITS, stopped, stopped_once
from identification.models import load_model, motion_of
from tests.identification.hysteretic import hysteretic

TRAVELS = st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=60).map(np.array)
LIMIT = st.sampled_from(sorted(LIMITS.values()))


@given(TRAVELS, LIMIT)
def test_a_stop_operator_is_bounded_and_the_same_sample_by_sample(travel: np.ndarray, limit: float) -> None:
    whole, s = stopped(travel, limit), 0.0
    assert np.max(np.abs(whole)) <= 1.0
    for k in range(1, travel.size):
        s = stopped_once(s, travel[k] - travel[k - 1], limit)
        assert math.isclose(s, whole[k], rel_tol=1e-9, abs_tol=1e-9 / limit)


@given(TRAVELS, TRAVELS, LIMIT)
def test_it_forgets_what_was_before_a_motion_of_twice_its_limit(
    one: np.ndarray, other: np.ndarray, limit: float
) -> None:
    top = 6.0 + 2.0 * limit
    after = top + np.array([0.0, -0.3 * limit, 0.5 * limit, -1.4 * limit])
    ends = [stopped(np.concatenate([past, [5.0], after]), limit)[-4:] for past in (one, other)]
    assert np.allclose(*ends, atol=1e-9 / limit)


@given(TRAVELS, LIMIT)
def test_it_does_not_know_how_fast_the_motion_is(travel: np.ndarray, limit: float) -> None:
    slow = np.interp(np.arange(0, travel.size - 0.5, 0.5), np.arange(travel.size), travel)
    assert np.allclose(stopped(slow, limit)[::2], stopped(travel, limit), atol=1e-9 / limit)


def test_with_them_a_network_without_feedback_learns_a_force_with_memory(tmp_path: Path) -> None:
    learned, shown = hysteretic(1, 1600), hysteretic(2, 1000)
    fit = {}
    for text in ("v0 v1 x0", "v0 v1 x0 P0 Q0 R0"):
        found = identify("nnoe", [learned], held_out=[shown], structures=[Structure(regressors(text), 8)])
        (fit[text],) = found.shown.values()
        assert found.memory_s == 0.0  # no force is fed back
    without, with_stops = fit.values()
    assert 100.0 - with_stops < 0.5 * (100.0 - without)
    write_identified(tmp_path / "m.json", found.model)
    motion = motion_of(shown)
    assert np.array_equal(load_model(tmp_path / "m.json").force(motion), found.model.force(motion))


@given(st.floats(1e-6, 1.0), st.floats(1e-6, 1.0))
def test_feedback_is_preferred_only_where_the_error_is_clearly_lower(fed: float, alone: float) -> None:
    judged = [
        Judged(Candidate(Structure(regressors(text), 8), 0.2), error)
        for text, error in (("F1 v0 v1", fed), ("x0 v0 P0 R0", alone))
    ]
    assert in_order(judged)[0].error == (fed if fed * FED_BACK < alone else alone)


BAD = st.one_of(st.sampled_from([math.nan, math.inf, -math.inf, 1e300]), st.floats(-1e6, 1e6, allow_nan=False))


@settings(max_examples=40, deadline=None)
@given(st.lists(BAD, min_size=1, max_size=60))
def test_a_scaled_travel_is_followed_within_its_limit_whatever_was_measured(values: list[float]) -> None:
    from identification.blackbox.scaling import Scale, seen

    scaled = seen(Scale(0.0, 0.01, -0.02, 0.02), np.array(values))
    for limit in LIMITS.values():
        assert np.max(np.abs(stopped(scaled, limit))) <= 1.0
