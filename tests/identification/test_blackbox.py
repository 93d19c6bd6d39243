"""Black boxes: the gradient, the training, what a free run does with any input, and the model file."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from identification.blackbox import BlackBox, Identified, Member, Structure, identify, regressors, write_identified
from identification.blackbox.folds import folds_of
from identification.blackbox.lanes import put, taken
from identification.blackbox.modelfile import blackbox_to_json
from identification.blackbox.network import network
from identification.blackbox.past import burg, predicted_backwards, velocity_before
from identification.blackbox.preparation import course_of
from identification.blackbox.samples import LEAD, Samples, course_along, samples_of
from identification.blackbox.scaling import MARGIN, Scale
from identification.blackbox.structure import Regressor
from identification.blackbox.tangent import tanh
from identification.blackbox.training import scales_of
from identification.errors import DataError, ModelError, ModelFileError, SimulationError
from identification.models import Motion, compare, load_model, model_from_json, motion_of, simulate_run
from rigctl.runfile import Run
from tests.identification.hysteretic import RATE_HZ, hysteretic

SMALL = Structure(regressors("F1 F2 v0 v1"), 4)


@cache
def runs() -> tuple[Run, Run]:
    return hysteretic(1, 1600), hysteretic(2, 1000)


@cache
def found(kind: str) -> Identified:
    learned, shown = runs()
    return identify(kind, [learned], held_out=[shown], structures=[SMALL] if kind == "nnoe" else [])


def model() -> BlackBox:
    return network_of(found("nnoe"))


def network_of(result: Identified) -> BlackBox:
    assert isinstance(result.model, BlackBox)
    return result.model


def with_series(motion: Motion, signal: str, series: np.ndarray) -> Motion:
    """The motion with another course of one signal."""
    given = {name: getattr(motion, name) for name in ("x", "v", "a", "i")} | {signal: series}
    return replace(motion, x=given["x"], v=given["v"], a=given["a"], i=given["i"])


def rows(structure: Structure, seed: int, count: int) -> tuple[np.ndarray, Samples]:
    """Random weights and samples of two runs."""
    rng = np.random.default_rng(seed)
    begin = np.repeat([structure.longest, count // 2 + structure.longest], [count // 2, count - count // 2])
    samples = Samples(
        inputs=rng.standard_normal((count, len(structure.inputs))),
        force=rng.standard_normal(count),
        begin=begin,
        counted=rng.random(count) < 0.9,
    )
    return 0.3 * rng.standard_normal(structure.size), samples


SCALES = {"force": Scale(0.0, 1.0, -6.0, 6.0)}


@given(
    names=st.lists(st.sampled_from(["F1", "F2", "F4", "x0", "v0", "v1", "a3", "i2"]), min_size=1, unique=True),
    nodes=st.sampled_from([0, 3, 4, 9]),
    horizon=st.sampled_from([1, 7, None]),
    seed=st.integers(0, 99),
)
@settings(max_examples=25, deadline=None)
def test_the_gradient_is_that_of_the_free_run(names: list[str], nodes: int, horizon: int | None, seed: int) -> None:
    structure = Structure(regressors(names), nodes)
    weights, samples = rows(structure, seed, 40)
    net = network(structure, SCALES)
    force = net.simulate(weights, samples, horizon)
    sums = net.sums(weights, samples, force, horizon)
    step = 1e-6 * np.random.default_rng(seed).standard_normal(weights.size)
    rise = net.squares(weights + step, samples, horizon) - net.squares(weights - step, samples, horizon)
    assert rise == pytest.approx(-4.0 * float(step @ sums.slope), rel=1e-4, abs=1e-9 * sums.squares + 1e-12)


def test_nodes_beyond_the_structure_have_no_gradient() -> None:
    structure = Structure(regressors("F1 v0"), 5)
    weights, samples = rows(structure, 0, 60)
    unused = np.tile(np.arange(structure.lanes) >= 5, 4)
    weights[: unused.size][unused] = 0.0
    net = network(structure, SCALES)
    gram = net.sums(weights, samples, net.simulate(weights, samples)).gram
    assert np.all(gram[: unused.size][unused] == 0.0)
    assert structure.weights == structure.size - int(unused.sum())


@njit(_nrt=False)
def tangents(numbers: np.ndarray, nodes: tuple[int, ...], into: np.ndarray) -> None:
    """The hyperbolic tangents of as many numbers as there are nodes."""
    put(into, 0, tanh(taken(numbers, 0, nodes)))


@given(st.lists(st.floats(-1e300, 1e300), min_size=8, max_size=8))
def test_the_hyperbolic_tangent_is_exact_to_the_last_digits(numbers: list[float]) -> None:
    found = np.full(9, 7.0)
    tangents(np.array(numbers), (0,) * 8, found)
    assert found[:8] == pytest.approx(np.tanh(numbers), rel=0.0, abs=3e-15)
    assert found[8] == 7.0  # nothing is written beyond the nodes


def test_a_network_learns_a_force_with_memory_and_says_beforehand_how_well() -> None:
    result = found("nnoe")
    (shown,) = result.shown.values()
    assert shown > 95.0
    assert abs(result.predicted - shown) < 3.0
    assert result.stable
    assert result.memory_s < 1.0


def test_a_network_beats_the_linear_model_and_the_one_without_memory() -> None:
    (best,) = found("nnoe").shown.values()
    for kind in ("arx", "mlp"):
        (shown,) = found(kind).shown.values()
        assert 0.0 < shown < best - 5.0, kind


def test_a_linear_model_finds_a_linear_difference_equation() -> None:
    learned, shown = (_linear(hysteretic(seed, 1200)) for seed in (3, 4))
    result = identify("arx", [learned], structures=[Structure(regressors("F1 v0 v1"), 0)])
    inner = slice(50, -50)  # near its ends a motion is known less well
    error = (simulate_run(result.model, shown) - shown.channels["force"])[inner]
    assert np.std(error) < 0.01 * np.std(shown.channels["force"])
    assert result.trained > 99.0


def _linear(run: Run) -> Run:
    v = motion_of(run).v
    force = np.zeros(v.size)
    for k in range(1, v.size):
        force[k] = 0.8 * force[k - 1] + 300.0 * v[k] - 120.0 * v[k - 1]
    late = {**run.channels, "force": force}
    return replace(run, channels={name: one[200:] for name, one in late.items()})


def test_the_same_runs_give_the_same_model_to_the_last_bit() -> None:
    learned, shown = runs()
    again = identify("nnoe", [learned], held_out=[shown], structures=[SMALL])
    assert np.array_equal(again.model.values(), model().values())


def test_a_run_that_begins_just_after_a_reversal_is_right_from_its_first_sample() -> None:
    _, shown = runs()
    v = motion_of(shown).v
    first = 200 + int(np.argmax((v[200:-1] < 0.0) & (v[201:] >= 0.0)))
    late = replace(shown, channels={name: one[first + 1 :] for name, one in shown.channels.items()})
    force, measured = simulate_run(model(), late), late.channels["force"]
    assert np.max(np.abs(force[:10] - measured[:10])) < 0.25 * np.std(measured)


def test_every_sample_of_a_run_is_learned_and_the_fit_is_predicted_for_those_in_motion() -> None:
    course = course_of(hysteretic(11, 700, rest_s=0.5), ())
    assert course.counted.all()
    parts = [part for fold in folds_of([course]) for part in fold.shown]
    shown = np.concatenate([part.judged().counted[part.counted] for part in parts])
    learned = [part.counted for fold in folds_of([course]) for part in fold.learned]
    assert not shown[:80].any()
    assert not shown[-80:].any()
    assert shown[150:-150].all()
    assert np.concatenate(learned).all()


def test_of_a_run_that_repeats_the_settling_is_not_learned() -> None:
    run = hysteretic(11, 500)
    repeated = {name: np.tile(values, 3) for name, values in run.channels.items()}
    repeated["force"][:500] += 50.0  # it settles for a period
    course = course_of(replace(run, channels=repeated, period_samples=500), ())
    assert not course.counted[: course.counted.size - 500].any()
    assert course.counted[-500:].all()


@pytest.mark.parametrize("settling", [1, 3])
def test_a_run_that_repeats_is_learned_however_long_it_settles(settling: int) -> None:
    run = hysteretic(11, 500)
    repeated = {name: np.tile(values, 9) for name, values in run.channels.items()}
    for k in range(settling):
        repeated["force"][500 * k : 500 * (k + 1)] += 200.0 * (settling - k)
    whole = replace(run, channels=repeated, period_samples=500)
    found = identify("nnoe", [whole], structures=[Structure(regressors("v0 v1 P0"), 4)])
    assert found.trained > 90.0
    assert course_of(whole, ()).force.size == 1000


def test_a_run_that_rests_most_of_the_time_is_learned() -> None:
    run = hysteretic(1, 400)
    resting = {name: np.concatenate([np.full(1300, values[0]), values]) for name, values in run.channels.items()}
    resting["displacement"] += 1e-7 * np.random.default_rng(0).standard_normal(1700)
    assert np.isfinite(identify("mlp", [replace(run, channels=resting)]).coverage)


def test_a_motion_that_begins_at_rest_was_at_rest_and_one_that_begins_at_its_turn_was_not() -> None:
    motion = motion_of(runs()[1])
    rest, cycle = np.zeros(40), np.arange(800) / RATE_HZ
    late = with_series(motion.head(840), "v", np.concatenate([rest, np.sin(2.0 * np.pi * cycle)]))
    assert not np.any(velocity_before(late, LEAD))
    turned = with_series(motion.head(800), "v", np.sin(2.0 * np.pi * cycle))
    assert np.allclose(
        velocity_before(turned, LEAD), np.sin(-2.0 * np.pi * np.arange(LEAD, 0, -1) / RATE_HZ), atol=0.05
    )


@pytest.mark.parametrize("names", ["x0 v0 a0", "F1 v0 P0", "x0 v3"])
@pytest.mark.parametrize("uncounted", [0, 50, LEAD, 300])
def test_samples_that_do_not_count_are_part_of_the_lead_and_change_nothing_after_it(names: str, uncounted: int) -> None:
    course = course_of(runs()[0], ())
    course = replace(course, counted=np.arange(course.force.size) >= uncounted)
    structure = Structure(regressors(names), 4)
    scales = scales_of([course], ["displacement", "velocity", "acceleration"])
    rows = samples_of([course], structure, scales)
    assert rows.force.size == course.force.size + structure.longest + max(LEAD - uncounted, 0)
    whole = samples_of([course.whole()], structure, scales)
    late = slice(-(course.force.size - max(uncounted, structure.longest)), None)
    assert np.allclose(rows.inputs[late], whole.inputs[late], atol=0.05)  # a stop operator began elsewhere
    assert rows.counted.sum() == course.counted.sum()


@given(seed=st.integers(0, 999), ahead=st.integers(1, 60))
@settings(max_examples=25, deadline=None)
def test_a_prediction_backwards_continues_a_sum_of_tones_and_never_grows(seed: int, ahead: int) -> None:
    rng = np.random.default_rng(seed)
    t = np.arange(-ahead, 400)
    tones = sum(np.sin(w * t + p) for w, p in zip(rng.uniform(0.05, 0.5, 3), rng.uniform(0, 6, 3), strict=True))
    back = predicted_backwards(tones[ahead:], ahead)
    assert np.max(np.abs(back - tones[:ahead])) < 0.5
    roots = np.roots(np.concatenate([[1.0], -burg(rng.standard_normal(200), 12)]))
    assert np.max(np.abs(roots)) < 1.0


@pytest.mark.parametrize("seed", [53, 144, 276])
def test_a_smooth_motion_is_not_continued_from_its_rounding(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tones = np.outer(np.arange(400), rng.uniform(0.01, 0.1, 3)) + rng.uniform(0.0, 6.0, 3)
    assert np.max(np.abs(predicted_backwards(np.sin(tones).sum(axis=1), LEAD))) < 4.0  # the tones themselves: 3


@pytest.mark.parametrize("seed", range(3))
def test_a_motion_that_starts_with_a_jerk_was_not_much_faster_before(seed: int) -> None:
    motion = motion_of(hysteretic(seed, 600))
    started = motion.v * np.minimum(np.arange(600) / 3.0, 1.0)  # as of a machine that is switched on
    before = velocity_before(with_series(motion, "v", started), LEAD)
    assert np.max(np.abs(before)) <= 1.5 * np.max(np.abs(started))


# What a wire, a sensor or a program may give for a moment.
BAD = st.one_of(
    st.sampled_from([math.nan, math.inf, -math.inf, 1e300, -1e300, 0.0]), st.floats(-1e6, 1e6, allow_nan=False)
)


@given(at=st.integers(0, 400), length=st.integers(1, 60), bad=BAD, signal=st.sampled_from(["x", "v", "a", "i"]))
@settings(max_examples=60, deadline=None)
def test_a_bad_input_for_a_moment_neither_diverges_nor_lasts(at: int, length: int, bad: float, signal: str) -> None:
    motion = motion_of(runs()[1]).head(800)
    hit = getattr(motion, signal).copy()
    hit[at : at + length] = bad
    force = model().force(with_series(motion, signal, hit))
    check_bounded(force)
    settled = at + length + SMALL.longest + int(2.0 * found("nnoe").memory_s * RATE_HZ) + 60
    assert np.allclose(force[settled:], model().force(motion)[settled:], atol=0.02 * np.std(force))


@given(st.lists(BAD, min_size=60, max_size=60), st.sampled_from(["x", "v"]))
@settings(max_examples=60, deadline=None)
def test_the_force_is_finite_and_bounded_whatever_the_input(values: list[float], signal: str) -> None:
    motion = motion_of(runs()[1]).head(300)
    check_bounded(model().force(with_series(motion, signal, np.repeat(values, 5))))


def check_bounded(force: np.ndarray) -> None:
    scale = model().scales["force"]
    margin = MARGIN * (scale.high - scale.low) + 1e-9
    assert np.all(np.isfinite(force))
    assert scale.low - margin <= force.min()
    assert force.max() <= scale.high + margin


def test_a_model_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "network.json"
    write_identified(path, model())
    again = load_model(path)
    assert isinstance(again, BlackBox)
    assert again.facts == model().facts
    motion = motion_of(runs()[1])
    assert np.array_equal(again.force(motion), model().force(motion))
    assert model_from_json(json.loads(path.read_text())).kind == "nnoe"


def changed(**more: Any) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(json.dumps(blackbox_to_json(model())))
    return data | more


def scaled(**more: Any) -> dict[str, Any]:
    data = changed()
    data["signals"]["velocity"] |= more
    return data


def member(**more: Any) -> dict[str, Any]:
    data = changed()
    data["members"][0] |= more
    return data


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (lambda: changed(members=[]), r"members must be a list of 1 … 64 networks"),
        (lambda: changed(sample_rate=0), r"sample_rate is 0 Hz: it must be above 0"),
        (lambda: changed(signals={}), r"signals\.force is missing: a member sees it|signals\.\w+ is missing"),
        (lambda: changed(signals={"pressure": {}}), r"signals\.pressure is no signal"),
        (lambda: scaled(size=1e-320), r"size is 9\.99\d+e-321: it must lie within"),
        (lambda: scaled(size=1e300), r"size is 1e\+300: it must lie within 1e-06 … 1 of the range"),
        (lambda: scaled(centre=1e308), r"centre is 1e\+308: it must lie in the range"),
        (lambda: changed(measured=["current"]), r"measured names 'current'"),
        (lambda: member(regressors=["os.system"]), r"members\[0\]: regressor 'os\.system'"),
        (lambda: member(regressors=["F0", "v0"]), r"regressor F0 is 0 samples old: it must be 1 … 256"),
        (lambda: member(regressors=["v0", "v0"]), r"regressor v0 is given twice"),
        (lambda: member(regressors=["v0", "F1"]), r"must be in the order F1 v0"),
        (lambda: member(hidden=[[0.0]]), r"members\[0\]\.hidden must be a list of 5 rows"),
        (lambda: member(output=[0.0, "1", 0.0, 0.0]), r"members\[0\]\.output\[1\] is '1'"),
        (lambda: member(output=[0.0] * 65), r"nodes is 65"),
        (lambda: member(linear=None), r"members\[0\]\.linear must be a list of 5 numbers"),
    ],
)
def test_a_broken_file_is_refused_with_the_place(data: Any, message: str, tmp_path: Path) -> None:
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(data()))
    with pytest.raises(ModelFileError, match=message):
        load_model(path)


def test_a_run_of_another_rate_is_refused_unless_it_is_resampled() -> None:
    learned, _ = runs()
    faster = hysteretic(2, 3000, rate_hz=500.0)
    with pytest.raises(
        SimulationError, match=r"identified at 200 Hz and the run has 500 Hz: identify the model again with --rate 500"
    ):
        simulate_run(model(), faster)
    with pytest.raises(DataError, match=r"hysteretic-2 has 500 Hz, hysteretic-1 200 Hz"):
        identify("arx", [learned, faster])
    both = identify("arx", [learned, faster], rate_hz=200.0)
    assert network_of(both).dt == pytest.approx(1.0 / 200.0)


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        ("spline", {}, "kind is 'spline': a black box is nnoe, narx, mlp, arx"),
        ("nnoe", {"runs": []}, "no run was given"),
        (
            "nnoe",
            {"samples": 320, "regressors": [f"v{k}" for k in range(24)]},
            r"samples for \d+ weights: at least 3 for each are needed",
        ),
        ("arx", {"samples": 200}, r"the longest run has 200 samples: .* at least one run needs 300"),
        ("polynomial", {"samples": 200}, r"the longest run has 200 samples: .* at least one run needs 300"),
        ("nnoe", {"regressors": "F1 v0 i0"}, "current does not vary in these runs"),
        ("nnoe", {"missing": "force"}, "no channel 'force'"),
    ],
)
def test_runs_that_cannot_be_used_are_refused_by_name(kind: str, change: dict[str, Any], message: str) -> None:
    learned = hysteretic(1, change.get("samples", 1600))
    kept = {name: one for name, one in learned.channels.items() if name != change.get("missing")}
    given_runs = change.get("runs", [replace(learned, channels=kept)])
    chosen = [Structure(regressors(change["regressors"]), 4)] if "regressors" in change else []
    with pytest.raises(DataError, match=message):
        identify(kind, given_runs, structures=chosen)


def test_a_run_without_the_current_that_the_model_needs_is_refused() -> None:
    driven = [hysteretic(seed, 1200, current=True) for seed in (1, 2)]
    with pytest.raises(DataError, match="has no current, hysteretic-1 has: give runs that all have it"):
        identify("arx", [driven[0], hysteretic(3, 1200)])
    result = identify("arx", driven)
    assert "current" in result.model.inputs
    with pytest.raises(DataError, match="has no control current, which the black box 'arx' needs"):
        simulate_run(result.model, hysteretic(3, 1200))


def test_a_measured_velocity_is_used_and_then_needed() -> None:
    learned, shown = (_with_velocity(run) for run in runs())
    result = identify("arx", [learned], held_out=[shown])
    assert network_of(result).measured == ("velocity",)
    with pytest.raises(DataError, match="has no velocity, which the black box 'arx' needs"):
        simulate_run(result.model, runs()[1])


def _with_velocity(run: Run) -> Run:
    return replace(run, channels={**run.channels, "velocity": motion_of(run).v}, units={**run.units, "velocity": "m/s"})


def test_a_run_outside_the_training_is_flagged_with_where_and_how_far() -> None:
    known = model().training_range
    assert known is not None
    motion = motion_of(runs()[1])
    far = replace(motion, v=np.where(np.arange(motion.v.size) == 500, 9.0, 0.0))
    (sentence,) = known.described(far)
    assert "first at 2.5 s, farthest at 2.5 s with 9" in sentence


def test_compare_puts_every_kind_on_one_page() -> None:
    kinds = ("nnoe", "narx", "mlp", "arx")
    comparison = compare([found(kind).model for kind in kinds], [runs()[1]])
    assert {row.kind for row in comparison.rows} == set(kinds)
    assert comparison.best_first()[0].kind in ("nnoe", "narx")
    assert all(row.ranged and row.rms is not None and row.parameters for row in comparison.rows)


def test_a_committee_forgets_its_start_or_says_that_it_does_not() -> None:
    one = Structure((Regressor("F", 1), Regressor("v", 0)), 4)
    held = np.zeros(one.size)
    held[one.lanes * 4 : one.lanes * 4 + 2] = [1.0, 0.0]  # F(t) = F(t − 1)
    data = model()
    never = replace(data, members=(type(data.members[0])(one, held),))
    assert never.memory(course_along(motion_of(runs()[1]))) == math.inf


def test_a_memory_that_is_shorter_than_the_lead_is_told_too() -> None:
    course = course_along(motion_of(runs()[1]))
    slow = Structure(regressors("F1 v0"), 0)
    scales = model().scales
    for gain in (0.5, 0.9, 0.98):
        one = BlackBox(
            name="", kind="arx", dt=1.0 / RATE_HZ, scales=scales, members=(Member(slow, np.array([gain, 1e-3, 0.0])),)
        )
        low, high = scales["force"].edges
        samples = math.log(0.01 / (high - low)) / math.log(gain)  # until gain^n·(high − low) is a hundredth
        assert one.memory(course) * RATE_HZ == pytest.approx(samples, abs=2.0)


def test_a_structure_that_is_none_is_refused() -> None:
    with pytest.raises(ModelError, match="regressors is empty"):
        Structure((), 4)
    with pytest.raises(ModelError, match="signals are F, x, v, a, i, T"):
        Regressor("q", 1)
