"""Exploration: lanes agree with the general solver, the feasible set holds the truth, every executor agrees."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.compute import Cluster, Processes, Serial, Threads, using
from identification.errors import DataError, ModelError
from identification.physical.simulate import simulate
from identification.studies import journal as journals
from identification.studies.exploration import (
    Exploration,
    Limits,
    explore,
    explored_data,
    explored_text,
    simulating,
    write_explored,
)
from identification.studies.exploration.asked import sampled
from identification.studies.exploration.result import ranked
from identification.studies.exploration.simulating import figures_over, in_lanes, lane_forces
from identification.studies.exploration.sine_tests import sine_tests
from tests.identification.loopback_cluster import dask_on_loopback
from tests.identification.maxwell_runs import VARIED, maxwell, sine_motion, sine_runs

Floats = NDArray[np.float64]

TRUTH = maxwell()
RUNS = sine_runs(TRUTH)
ASKED = Exploration(samples=48, vary=VARIED, points=500)


def test_a_lane_gives_the_force_of_the_general_solver() -> None:
    test = sine_tests(RUNS, 2000)[0][1]
    values = sampled(TRUTH, replace(ASKED, samples=16))
    forces = lane_forces(TRUTH, values, test)
    motion = sine_motion(test.amplitude_m, test.frequency_hz, 2000, 120)
    for k in (0, 7, 15):
        fine = simulate(TRUTH.with_values(values[k]), replace(motion, period=0, settle=0)).force[-2000:]
        assert np.sqrt(np.mean((forces[:, k] - fine) ** 2) / np.mean(fine**2)) < 2e-6


@pytest.mark.parametrize("slope", [60.0, 2000.0])
def test_lanes_are_exact_to_a_millionth_of_the_force_against_a_fine_solution(slope: float) -> None:
    test = sine_tests(RUNS, 2000)[0][2]
    values = sampled(maxwell(S=slope), replace(ASKED, samples=16))
    motion = sine_motion(test.amplitude_m, test.frequency_hz, 16 * 2000, 1)
    fine = lane_forces(TRUTH, values, replace(test, x=motion.x, v=motion.v))[::16]
    motion = sine_motion(test.amplitude_m, test.frequency_hz, 2000, 1)
    coarse = lane_forces(TRUTH, values, replace(test, x=motion.x, v=motion.v))
    assert np.max(np.sqrt(np.mean((coarse - fine) ** 2, axis=0) / np.mean(fine**2, axis=0))) < 2e-6


def test_the_truth_is_feasible_within_narrow_limits() -> None:
    found = explore(TRUTH, RUNS, replace(ASKED, low=0.999, high=1.001, limits=Limits(
        dynamic_stiffness=0.01, loss_angle=0.01, loop_shape=0.01)))  # fmt: skip
    assert found.feasible.all()


def test_every_feasible_sample_keeps_every_limit_and_every_other_breaks_one() -> None:
    found = explore(TRUTH, RUNS, ASKED)
    assert 0 < found.feasible.sum() < ASKED.samples
    assert np.all(found.worst[found.feasible] <= ASKED.limits.row())
    assert np.all((found.worst[~found.feasible] > ASKED.limits.row()).any(axis=1))


def test_the_answer_is_the_same_to_the_bit_on_every_executor() -> None:
    asked = replace(ASKED, samples=33)
    answers = []
    for executor in (Serial(), Threads(2), Processes(2)):
        with using(executor):
            answers.append(explore(TRUTH, RUNS[:1], asked).figures.tobytes())
        executor.close()
    assert answers[0] == answers[1] == answers[2]


@pytest.mark.slow
def test_the_answer_is_the_same_to_the_bit_on_a_dask_cluster(tmp_path: Path) -> None:
    asked = replace(ASKED, samples=33)
    with dask_on_loopback(tmp_path) as dask:
        dask.add_workers(1)
        with closing(Cluster(dask.address, threads=1)) as cluster, using(cluster):
            there = explore(TRUTH, RUNS[:1], asked).figures.tobytes()
    with using(Serial()):
        assert explore(TRUTH, RUNS[:1], asked).figures.tobytes() == there


def test_an_interrupted_study_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal, whole = tmp_path / "journal", explore(TRUTH, RUNS, ASKED)

    def interrupt(done: float, text: str) -> None:
        if done > 0.5:
            raise KeyboardInterrupt

    with using(Serial()):
        with pytest.raises(KeyboardInterrupt):
            explore(TRUTH, RUNS, ASKED, tell=interrupt, journal=journal)
        journal.write_bytes(journal.read_bytes() + b"cut off")
        told: list[float] = []
        again = explore(TRUTH, RUNS, ASKED, tell=lambda done, text: told.append(done), journal=journal)
    assert len(told) == 1  # of three groups
    assert again.figures.tobytes() == whole.figures.tobytes()
    assert not journal.exists()


def test_a_journal_of_another_study_is_not_used(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    items = [np.zeros(2), np.ones(2)]
    journal.write_bytes(b"something else")
    done = journals.carry_on(np.cumsum, items, identity=b"a", journal=journal, what="", tell=lambda d, t: None)
    assert [list(d) for d in done] == [[0.0, 0.0], [1.0, 2.0]]


def test_an_empty_feasible_set_is_an_answer_that_names_the_limit() -> None:
    asked = replace(ASKED, limits=Limits(dynamic_stiffness=9.0, loss_angle=1e-9, loop_shape=9.0))
    found = explore(TRUTH, RUNS, asked)
    assert not found.feasible.any()
    assert found.reached() is None
    assert explored_data(found)["binding_limit"] == "loss angle"
    assert "loss angle limit (±1e-07 %) empties the set" in explored_text(found)


def test_other_models_are_simulated_by_their_own_solver() -> None:
    model = maxwell()
    tests = sine_tests(RUNS[:1], 500)[0]
    values = sampled(model, replace(ASKED, samples=3))
    assert in_lanes(model)
    by_solver = np.stack([simulating._by_itself(model, values, t) for t in tests], axis=1)
    assert figures_over(model, values, tests) == pytest.approx(by_solver, rel=1e-4)


def test_sobol_samples_fill_the_range_more_evenly() -> None:
    def gap(sampling: str) -> float:
        asked = replace(ASKED, samples=256, sampling="sobol" if sampling == "sobol" else "log-uniform")
        column = np.sort(np.log(sampled(TRUTH, asked)[:, TRUTH.names().index(VARIED[0])]))
        return float(np.max(np.diff(column)))

    assert gap("sobol") < 0.5 * gap("log-uniform")


def test_ranks_correlate_a_monotone_function_fully() -> None:
    x = np.array([1.0, 4.0, 2.0, 9.0])
    found = ranked(np.column_stack([x, -np.exp(x), np.ones(4)]))
    assert found is not None
    assert found[0, 1] == pytest.approx(-1.0)
    assert found[0, 2] == 0.0


def test_bad_input_is_named_before_anything_is_simulated() -> None:
    with pytest.raises(ModelError, match="has no parameter 'k9'"):
        explore(TRUTH, RUNS, replace(ASKED, vary=("k9",)))
    with pytest.raises(ModelError, match="starts at 0"):
        explore(TRUTH, RUNS, replace(ASKED, vary=("arctan_damping.F2",)))
    with pytest.raises(DataError, match="low … high"):
        Exploration(low=2.0, high=1.0)
    with pytest.raises(DataError, match=r"limits\.loss_angle is 0"):
        Limits(loss_angle=0.0)
    slow = replace(RUNS[0], channels={"displacement": np.zeros(3000), "force": RUNS[0].channels["force"]})
    with pytest.raises(DataError, match="no run is a steady sine"):
        explore(TRUTH, [slow], ASKED)


def test_the_page_holds_the_answer_and_opens_offline(tmp_path: Path) -> None:
    found = explore(TRUTH, RUNS, ASKED)
    write_explored(tmp_path / "page.html", found)
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "feasible" in text
    assert "relaxing_compliance.k1" in text
    assert 'src="http' not in text
