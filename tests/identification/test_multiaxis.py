"""Several axes: the inputs of each load, superposed training, its check, and a model that bad inputs leave bounded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from threadpoolctl import threadpool_info, threadpool_limits

from identification.blackbox import Base
from identification.errors import DataError, SimulationError
from identification.multiaxis import (
    LOADS,
    MOTIONS,
    UNITS,
    MultiAxis,
    axes_data,
    axes_text,
    check_multiaxis,
    check_superposition,
    chosen,
    correlations,
    identify_axes,
    identify_multiaxis,
    superposed,
)
from identification.multiaxis.axes import moves
from identification.physical.model import Model, element
from identification.physical.modelfile import model_to_json
from rigctl.runfile import Run, read_run, write_run
from sim_rig.multi_axis import ANTI_YAW, played
from tests.identification.six_axes import LARGEST, RATE_HZ, by_formula, motion, run_of, singles_of

Floats = NDArray[np.float64]
INPUTS = (
    {"displacement", "displacement_y"},
    {"displacement_y"},
    {"displacement_z"},
    {"displacement_rx"},
    {"displacement_z", "displacement_ry"},
    {"displacement_rz"},
)


@cache
def singles() -> tuple[Run, ...]:
    return tuple(singles_of(motion(1), by_formula))


@cache
def model() -> MultiAxis:
    return identify_axes([superposed(singles())])


def test_a_base_with_a_force_that_no_machine_has_is_named() -> None:
    hard = Model(name="hard", elements=(element("viscous_damping", {"c": 1e300}),))
    with pytest.raises(SimulationError, match=r"'hard' gives .* N at .* s: no machine has more than 1e\+12 N"):
        identify_axes([by_formula(motion(1), "together")], base=Base(hard, model_to_json(hard)))


def test_the_inputs_of_each_load_are_those_that_it_depends_on() -> None:
    found = chosen(correlations([superposed(singles())]))
    assert {load: set(axes) for load, axes in found.items()} == dict(zip(LOADS, INPUTS, strict=True))


def test_a_model_of_superposed_single_tests_holds_when_all_axes_move() -> None:
    shown = by_formula(motion(2), "shown")
    for load, force in model().simulate(shown).items():
        measured = shown.channels[load]
        assert np.sqrt(np.mean((measured - force) ** 2)) < 0.2 * np.std(measured), load


def test_superposition_is_exact_where_the_loads_add_up_and_fails_where_they_do_not() -> None:
    together = by_formula(motion(1), "together")
    found = check_superposition(together, singles())
    assert max(found.missed.values()) < 1e-9
    assert not found.failing
    product = together.channels["displacement"] * together.channels["displacement_rz"]
    coupled = {**together.channels, "torque_z": together.channels["torque_z"] + 1e5 * product}
    found = check_superposition(replace(together, channels=coupled), singles())
    assert found.failing == ("torque_z",)
    assert "torque_z: the sum of the single tests misses" in found.described()[0]
    assert "superposition fails" in found.described()[0]


@pytest.mark.slow
def test_a_damper_between_bushes_adds_up_in_service_and_not_far_sideways() -> None:
    def made(moved: Floats, name: str) -> Run:
        return run_of(moved, played(ANTI_YAW, moved, RATE_HZ, seed=len(name)), name)

    near, far = (motion(3, factor)[:700] for factor in (0.5, 5.0))
    assert "force" not in check_superposition(made(near, "near"), singles_of(near, made)).failing
    assert "force" in check_superposition(made(far, "far"), singles_of(far, made)).failing


BAD = st.one_of(st.sampled_from([math.nan, math.inf, -math.inf, 1e300]), st.floats(-1e6, 1e6, allow_nan=False))


@settings(max_examples=40, deadline=None)
@given(at=st.integers(0, 900), length=st.integers(1, 60), bad=BAD, axis=st.sampled_from(MOTIONS))
def test_a_bad_input_for_a_moment_neither_diverges_nor_lasts(at: int, length: int, bad: float, axis: str) -> None:
    shown = by_formula(motion(2), "shown")
    hit = shown.channels[axis].copy()
    hit[at : at + length] = bad
    found = model().along({**shown.channels, axis: hit})
    clean = model().simulate(shown)
    for load, force in found.items():
        scale = model().loads[load].scale
        margin = 0.5 * (scale.high - scale.low) + 1e-9
        assert np.all(np.isfinite(force))
        assert scale.low - margin <= force.min() <= force.max() <= scale.high + margin
        np.testing.assert_allclose(force[at + length + 40 :], clean[load][at + length + 40 :], rtol=1e-9, atol=1e-9)


def test_what_leaves_the_training_is_stated() -> None:
    assert not model().outside(superposed(singles()))
    far = by_formula(3.0 * motion(2), "far")
    assert set(model().outside(far)) == set(MOTIONS)


def test_where_and_how_far_an_axis_or_its_speed_leaves_the_training_is_told() -> None:
    assert not model().described(superposed(singles()))
    shown = by_formula(0.5 * motion(1), "jumps")
    turned = shown.channels["displacement_ry"].copy()
    turned[700] = 0.05
    told = model().described(replace(shown, channels={**shown.channels, "displacement_ry": turned}))
    low, high = model().scales["displacement_ry"].low, model().scales["displacement_ry"].high
    assert told[0] == (
        f"displacement_ry leaves the training range [{low:.4g}, {high:.4g}] rad in 0.0667 % of the samples, first at "
        f"7 s, farthest at 7 s with 0.05 rad, {0.05 - high:.2g} rad beyond"
    )
    assert told[1].startswith("speed of displacement_ry leaves the training range")
    assert len(told) == 2


@pytest.mark.slow
def test_single_tests_that_play_one_motion_tell_the_axes_apart_all_the_same() -> None:
    same = motion(1)[:, :1] / LARGEST[0] * LARGEST
    held_out = by_formula(motion(2), "together")
    found = identify_multiaxis(singles_of(same, by_formula), held_out=[held_out])
    assert found.model.loads["force_y"].axes == ("displacement_y",)
    assert min(found.shown["together"].values()) > 95.0  # of the sum alone: force 74 %, the others -23 to -61 %


def test_an_axis_that_follows_another_in_all_runs_is_refused_and_learned_once_a_run_parts_them() -> None:
    together = motion(3)
    together[:, 2] = 2.0 * together[:, 1] + 1e-5
    tied = by_formula(together, "tied")
    with pytest.raises(DataError, match="displacement_y follows displacement_z in all runs: nothing tells which"):
        check_multiaxis([tied], [])
    check_multiaxis([tied, by_formula(motion(4), "free")], [])


def test_a_run_file_carries_the_further_axes(tmp_path: Path) -> None:
    write_run(tmp_path / "six.h5", by_formula(motion(2), "six"))
    back = read_run(tmp_path / "six.h5")
    assert {name: back.units[name] for name in LOADS} == UNITS
    assert [back.units[name] for name in MOTIONS] == ["m"] * 3 + ["rad"] * 3
    assert np.array_equal(
        model().simulate(back)["torque_z"], model().simulate(by_formula(motion(2), "six"))["torque_z"]
    )


def with_noise(run: Run, axes: Sequence[str], share: float, seed: int) -> Run:
    rng = np.random.default_rng(seed)
    channels = {name: one for name, one in run.channels.items() if name not in LOADS[2:]}
    for name in axes:
        size = share * LARGEST[MOTIONS.index(name)]
        channels[name] = channels[name] + 1e-3 + size * rng.standard_normal(run.samples)
    return replace(run, channels=channels)


def test_an_axis_that_is_held_with_noise_is_constant_and_is_named() -> None:
    held, noise = MOTIONS[4], 0.003 * LARGEST[4]
    tests = [with_noise(one, MOTIONS, 0.003, k) for k, one in enumerate(singles()) if k != 4]
    moved = motion(1) * (np.arange(6) != 4)
    together = with_noise(by_formula(moved, "together"), MOTIONS, 0.003, 9)
    result = identify_multiaxis(tests, held_out=[together, by_formula(motion(1), "all six")])
    assert result.summed == 5
    assert result.held == {held: pytest.approx(noise, rel=0.1)}
    assert all(held not in load.axes for load in result.model.loads.values())
    assert list(result.checks) == ["together"]
    assert not result.checks["together"].failing
    said = axes_text(result)
    assert f"{held} is held in all runs, but for noise of" in said
    assert f"all six moves {held}, which no run of the training moves" in said
    assert axes_data(result)["held_but_moved"] == {"all six": [held]}


def test_an_identification_works_with_one_thread_of_linear_algebra() -> None:
    seen: list[int] = []

    def told(done: float, text: str) -> None:
        seen.extend(one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas")

    light = [with_noise(one, (), 0.0, 1) for one in singles()[:2]]
    with threadpool_limits(2, user_api="blas"):
        identify_multiaxis(light, tell=told)
    assert set(seen) == {1}


def test_noise_and_steps_of_a_recorder_are_no_motion_and_a_fast_small_motion_is_one() -> None:
    rng, t = np.random.default_rng(1), np.arange(2000) / 200.0
    noise = 1e-5 * rng.standard_normal(2000)
    assert not moves(2e-3 + noise)
    assert not moves(np.full(2000, 0.1))
    assert not moves(np.round((2.4e-4 + noise) / 1e-4) * 1e-4)  # between two values of a recorder
    assert not moves(np.where(t > 5.0, 1e-5, 0.0))  # one step of a recorder
    assert moves(5e-5 * np.sin(2.0 * np.pi * 20.0 * t) + noise)
    assert moves(5e-5 * np.sin(2.0 * np.pi * 0.1 * t) + noise)


def test_runs_that_move_one_axis_alone_make_no_model_of_several() -> None:
    first = with_noise(singles()[0], MOTIONS, 0.01, 1)
    with pytest.raises(DataError, match=r"the runs move displacement; displacement_y, .* are held, but for noise"):
        identify_multiaxis([first])


def test_tests_that_cannot_be_superposed_are_refused_in_one_line() -> None:
    first, second, *rest = singles()
    slow = replace(second, sample_rate_hz=50.0)
    bare = replace(second, channels={name: one for name, one in second.channels.items() if name != "torque_x"})
    both = by_formula(motion(1), "both")
    for given_, words in (
        ([], "no run was given"),
        ([first, slow], "axis-1 has 50 Hz, axis-0 100 Hz"),
        ([first, bare], "axis-1 has no torque_x, axis-0 has"),
        ([first, both], "both moves displacement and displacement_y"),
        ([first, replace(first, run_id="again")], "again moves displacement as axis-0 does"),
    ):
        with pytest.raises(DataError, match=words):
            superposed(given_)
    with pytest.raises(DataError, match="displacement is not that of the single test"):
        check_superposition(by_formula(motion(2), "other"), singles())
    with pytest.raises(SimulationError, match="identified at 100 Hz and axis-1 has 50 Hz"):
        model().simulate(slow)
    lacking = {name: one for name, one in first.channels.items() if name != "displacement_y"}
    with pytest.raises(DataError, match="has no displacement_y, which the model needs"):
        model().simulate(replace(first, channels=lacking))
    short = {name: one[:200] for name, one in both.channels.items()}
    with pytest.raises(DataError, match="200 samples for"):
        identify_axes([replace(both, channels=short)])
    assert len(rest) == 4
