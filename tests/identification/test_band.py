"""Prediction bands: what they hold of runs that were never learned from, in the file, and on the page."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.blackbox import Base, BlackBox, Identified, Structure, identify, regressors, write_identified
from identification.blackbox.band import LEVELS, Band, LeftOut, Place, band_of, coverage_of
from identification.blackbox.described import identified_text
from identification.blackbox.folds import folds_of
from identification.blackbox.outside import added_outside
from identification.blackbox.preparation import course_of
from identification.errors import DataError, ModelError, ModelFileError
from identification.models import compare, comparison_data, load_model, motion_of
from identification.models.band import half_width_of
from identification.models.comparison_page import comparison_html
from identification.physical.model import Model, element
from identification.physical.modelfile import model_to_json
from tests.identification.hysteretic import hysteretic

LEARNED = tuple(hysteretic(seed, 1200, noise=0.05) for seed in (1, 2))
SHOWN = tuple(hysteretic(seed, 1200, noise=0.05) for seed in (11, 12, 13, 14))


@cache
def found(kind: str) -> Identified:
    chosen = {
        "nnoe": [Structure(regressors("F1 F2 v0 v1"), 4), Structure(regressors("F1 F2 x0 v0 v1"), 4)],
        "hybrid": [Structure(regressors("F1 v0 v1 M0"), 4)],
        "polynomial": [Structure(regressors("F1 F2 v0 v1"), 0)],
    }
    viscous = Model(name="v", elements=(element("viscous_damping", {"c": 400.0}),))
    base = Base(viscous, model_to_json(viscous)) if kind == "hybrid" else None
    return identify(kind, LEARNED, held_out=SHOWN, structures=chosen.get(kind, []), base=base)


@pytest.mark.parametrize(
    "kind", [*(pytest.param(kind, marks=pytest.mark.slow) for kind in ("nnoe", "mlp")), "arx", "polynomial", "hybrid"]
)
def test_a_band_of_90_percent_holds_85_to_95_percent_of_runs_that_were_never_seen(kind: str) -> None:
    result = found(kind)
    reached = np.mean(list(result.reached.values()))
    assert 0.85 <= reached <= 0.95, result.reached
    assert abs(result.coverage - reached) < 0.06
    assert result.model.facts["coverage_held_out"] == pytest.approx(reached)


CURRENTS_A = (0.0, 0.5, 1.5, 2.0)
AT_CURRENTS = tuple(
    hysteretic(10 * k + seed, 800, held_a=held_a) for k, held_a in enumerate(CURRENTS_A) for seed in (1, 2)
)
BETWEEN, BEYOND = hysteretic(91, 1200, held_a=1.0), hysteretic(92, 1200, held_a=3.0)


@cache
def of_currents() -> Identified:
    return identify(
        "nnoe", AT_CURRENTS, held_out=[BETWEEN, BEYOND], structures=[Structure(regressors("P0 Q0 R0 v0 i0"), 8)]
    )


@pytest.mark.slow
def test_the_band_holds_its_level_at_a_current_between_and_widens_beyond_the_training() -> None:
    result = of_currents()
    assert min(result.reached.values()) >= 0.85, result.reached
    between, beyond = (half_width_of(result.model, motion_of(run)) for run in (BETWEEN, BEYOND))
    assert between is not None
    assert beyond is not None
    assert np.mean(beyond) > 2.0 * np.mean(between)


def test_a_held_out_run_that_leaves_the_training_is_told() -> None:
    told = identified_text(of_currents())
    assert "hysteretic-92: current leaves the training range [0, 2] A in 100 % of the samples" in told
    assert "hysteretic-91: current" not in told


def test_outside_of_the_training_nothing_is_added_along_a_motion_inside() -> None:
    model, motion = of_currents().model, motion_of(AT_CURRENTS[0])
    known = model.training_range
    assert known is not None
    assert np.all(added_outside(known, motion, model.force(motion), model.force) == 0.0)
    far = replace(motion, i=np.full(motion.i.size, 3.0))
    inside = replace(motion, i=np.full(motion.i.size, 2.0))
    added = added_outside(known, far, model.force(far), model.force)
    assert added == pytest.approx(np.abs(model.force(far) - model.force(inside)))


@pytest.mark.parametrize("each", [1, 2, 6])
def test_whole_currents_between_the_lowest_and_the_highest_are_left_out(each: int) -> None:
    rng = np.random.default_rng(each)
    runs = [hysteretic(10 * k + n, 400, held_a=0.3 * k) for k in range(5) for n in range(each)]
    folds = folds_of([course_of(run, ()) for run in rng.permutation(np.array(runs, dtype=object))])
    for fold in folds:
        learned, shown = ({float(one.motion.i[0]) for one in part} for part in (fold.learned, fold.shown))
        assert not learned & shown - {0.0, 0.3 * 4}
        assert learned >= {0.0, 0.3 * 4}
    shown_samples = sum(int(one.counted.sum()) for fold in folds for one in fold.shown)
    assert shown_samples == sum(run.samples for run in runs)


def test_runs_whose_currents_overlap_are_left_out_as_runs_of_one_current() -> None:
    courses = [course_of(hysteretic(seed, 400, current=True), ()) for seed in range(6)]
    folds = folds_of(courses)
    assert [len(fold.shown) for fold in folds] == [2, 2, 2]
    assert [len(fold.learned) for fold in folds] == [4, 4, 4]
    assert all(fold.whole for fold in folds)
    assert not any(fold.whole for fold in folds_of(courses[:2]))  # stretches of two runs


def test_a_higher_level_has_a_wider_band() -> None:
    motion = motion_of(SHOWN[0])
    widths = [half_width_of(found("nnoe").model, motion, level) for level in (0.5, 0.8, 0.9, 0.93, 0.99)]
    means = [float(np.mean(one)) for one in widths if one is not None]
    assert len(means) == 5
    assert means == sorted(means)
    with pytest.raises(DataError, match=r"band of 20 %: it must lie within 50 … 99 %"):
        half_width_of(found("nnoe").model, motion, 0.2)


def place(count: int, **columns: Any) -> Place:
    """Any: a number, or one for each sample."""
    zeros = np.zeros(count)
    return Place(**{name: zeros + columns.get(name, 0.0) for name in ("spreads", "swings", "added", "apart", "past")})


@given(st.integers(0, 10_000), st.integers(40, 400))
@settings(max_examples=30, deadline=None)
def test_the_band_holds_its_level_of_errors_that_could_be_exchanged(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    spread = rng.uniform(0.0, 3.0, 4 * count)
    errors = rng.standard_normal(4 * count) * np.hypot(1.0, spread)
    swings = rng.uniform(0.0, 300.0, count)
    spans = [slice(k * count, (k + 1) * count) for k in range(4)]
    *parts, last = (LeftOut(errors[one], place(count, spreads=spread[one], swings=swings)) for one in spans)
    held = float(np.mean(np.abs(last.errors) <= band_of(parts).half_width(last.place, 0.9)))
    tolerance = 5.0 * np.sqrt(0.09 * (1.0 / count + 1.0 / (3 * count)))
    assert abs(held - 0.9) < tolerance
    assert abs(coverage_of(parts) - 0.9) < tolerance


@pytest.mark.parametrize("grows", [True, False])
def test_beyond_the_forces_of_the_training_a_band_grows_as_far_as_errors_did(grows: bool) -> None:
    rng = np.random.default_rng(4)
    swings = rng.uniform(50.0, 200.0, (3, 3000))
    sizes = 0.1 * swings if grows else np.full(swings.shape, 12.0)
    errors = rng.standard_normal(swings.shape) * sizes
    band = band_of([LeftOut(e, place(e.size, swings=s)) for e, s in zip(errors, swings, strict=True)])
    far = rng.standard_normal(20_000) * (40.0 if grows else 12.0)
    held = float(np.mean(np.abs(far) <= band.half_width(place(far.size, swings=400.0), 0.9)))
    assert 0.85 <= held <= 0.96


def of_distances(name: str, weight: float, count: int) -> Band:
    """The band of parts, every second of which lies up to 0.3 of the ranges from what was learned, where the errors
    grow by `weight`·100 N with the distance; elsewhere they are 5 N."""
    rng = np.random.default_rng(8)
    parts = []
    for k in range(count):
        away = (k % 2) * rng.uniform(0.0, 0.3, 1000)
        errors = rng.standard_normal(1000) * np.hypot(5.0, weight * 100.0 * away)
        parts.append(LeftOut(errors, place(1000, swings=100.0, **{name: away})))
    return band_of(parts)


DISTANCES = pytest.mark.parametrize(("column", "name"), [("apart", "within"), ("past", "beyond")])


@DISTANCES
def test_a_band_widens_with_a_distance_as_far_as_the_errors_that_were_left_out_did(column: str, name: str) -> None:
    bands = [of_distances(column, weight, 6) for weight in (0.0, 6.0)]
    weights = [getattr(one, name) for one in bands]
    assert weights[1] > 2.0 * weights[0]
    widths = [float(one.half_width(place(1, swings=100.0, **{column: 0.2}), 0.9)[0]) for one in bands]
    assert widths[0] < 30.0 < 100.0 < widths[1]  # N; 8 and 197 were the weights known


@DISTANCES
def test_a_weight_is_nearer_to_what_was_seen_the_more_parts_were_left_out(column: str, name: str) -> None:
    few, more, none = (getattr(of_distances(column, 0.0, count), name) for count in (4, 12, 1))
    assert more < few < none
    assert getattr(of_distances(column, 4.0, 1), name) == none  # its one part lies nowhere far


def test_a_band_takes_its_weights_from_parts_that_are_left_out() -> None:
    model = of_currents().model
    assert isinstance(model, BlackBox)
    assert model.band is not None
    assert model.band.within != pytest.approx(
        of_distances("apart", 0.0, 1).within, rel=0.05
    )  # whole currents were left out


@pytest.mark.slow
@pytest.mark.parametrize("runs", [3, 6, 24])
def test_a_band_of_few_runs_holds_its_level_of_a_further_run_whose_errors_are_off_together(
    runs: int,
) -> None:
    rng = np.random.default_rng(runs)
    held = []
    for _ in range(300):
        *left, further = 100.0 * rng.standard_normal(runs + 1)[:, None] + rng.standard_normal((runs + 1, 30))
        parts = [LeftOut(np.concatenate(left[k::3]), place(30 * len(left[k::3])), len(left[k::3])) for k in range(3)]
        held.append(np.mean(np.abs(further) <= band_of(parts).half_width(place(30), 0.9)))
    assert 0.87 <= np.mean(held) <= 0.95


def test_a_band_of_stretches_of_runs_is_no_wider_for_their_number() -> None:
    rng = np.random.default_rng(5)
    parts = [LeftOut(rng.standard_normal(500), place(500)) for _ in range(3)]
    whole = [replace(one, runs=1) for one in parts]
    ratio = np.array(band_of(whole).factors) / np.array(band_of(parts).factors)
    assert ratio[0] == pytest.approx(1.21, abs=0.01)  # Student's t, two degrees of freedom
    assert np.all(np.diff(ratio) > 0.0)


def test_a_band_of_a_file_without_a_growth_is_the_same_everywhere() -> None:
    band = Band(3.0, (1.5,) * len(LEVELS))
    assert np.array_equal(band.half_width(place(3, swings=np.array([0.0, 1e3, 1e12])), 0.9), np.full(3, 4.5))


def test_a_band_of_a_file_without_weights_of_the_distances_has_those_of_before(tmp_path: Path) -> None:
    path = tmp_path / "network.json"
    write_identified(path, found("arx").model)
    data = json.loads(path.read_text())
    assert data["band"].pop("within") > 0.0
    assert data["band"].pop("beyond") > 0.0
    path.write_text(json.dumps(data))
    model = load_model(path)
    assert isinstance(model, BlackBox)
    assert model.band is not None
    assert (model.band.within, model.band.beyond) == (1.0, 1.0)


def test_the_band_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    motion = motion_of(SHOWN[0])
    for kind in ("nnoe", "polynomial", "hybrid"):
        path = tmp_path / f"{kind}.json"
        write_identified(path, found(kind).model)
        assert np.array_equal(half_width_of(load_model(path), motion), half_width_of(found(kind).model, motion))  # type: ignore[arg-type]


def test_a_file_without_a_band_is_read_and_has_none(tmp_path: Path) -> None:
    path = tmp_path / "network.json"
    write_identified(path, found("nnoe").model)
    data = json.loads(path.read_text())
    del data["band"]
    path.write_text(json.dumps(data))
    assert half_width_of(load_model(path), motion_of(SHOWN[0])) is None


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"floor": 0.0}, r"band\.floor is 0 N: it must be above 0"),
        ({"factors": [1.0]}, r"band\.factors has 1 entries"),
        ({"factors": [2.0] + [1.0] * (len(LEVELS) - 1)}, r"band\.factors must be finite, not negative, and rise"),
        ({"factors": ["1"] * len(LEVELS)}, r"band\.factors\[0\] is '1'"),
        ({"levels": [0.9]}, r"band\.levels must be"),
        ({"growth": -0.1}, r"band\.growth is -0\.1: it must lie within 0 … 1"),
        ({"growth": None}, r"band\.growth is None"),
        ({"swing": 0.0}, r"band\.swing is 0 N"),
        ({"within": -0.1}, r"band\.within is -0\.1: it must lie within 0 … 32"),
        ({"beyond": None}, r"band\.beyond is None"),
    ],
)
def test_a_broken_band_is_refused_with_the_place(more: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = tmp_path / "network.json"
    write_identified(path, found("nnoe").model)
    data = json.loads(path.read_text())
    data["band"] |= more
    path.write_text(json.dumps(data))
    with pytest.raises(ModelFileError, match=message):
        load_model(path)
    with pytest.raises(ModelError):
        Band(-1.0, (1.0,) * len(LEVELS))


def test_a_comparison_states_and_draws_what_a_band_holds() -> None:
    plain = replace(found("arx").model, band=None, name="plain")
    assert isinstance(plain, BlackBox)
    comparison = compare([found("nnoe").model, plain], SHOWN[:2])
    data = comparison_data(comparison)
    reached = [one["coverage_90"] for one in data["models"][0]["runs"]]
    assert reached == pytest.approx(list(found("nnoe").reached.values())[:2])
    assert [one["coverage_90"] for one in data["models"][1]["runs"]] == [None, None]
    page = comparison_html(comparison)
    assert f"90 % band holds {100 * reached[0]:.0f} %" in page
    assert "tonexty" in page
