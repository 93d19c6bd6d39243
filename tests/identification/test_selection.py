"""The selection of regressors by the error in free run: its path, its resumption, and what each signal is worth."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from identification.blackbox.network import network
from identification.blackbox.past import velocity_before
from identification.blackbox.preparation import course_of
from identification.blackbox.promise import gains, inherited, losses
from identification.blackbox.samples import LEAD, Course, samples_of
from identification.blackbox.search import SHORTLIST, Offer, search
from identification.blackbox.search_page import search_html
from identification.blackbox.selection import Known, Step, candidates, select, without_each
from identification.blackbox.selectionfile import digest_of, read_selection, write_selection
from identification.blackbox.share import fair_share
from identification.blackbox.structure import Structure, regressors
from identification.blackbox.training import scales_of
from identification.errors import DataError
from tests.identification.hysteretic import hysteretic

START = Structure(regressors("F1"), 4)
OFFERED = candidates("Fxv", 1)


@pytest.fixture(scope="module")
def course() -> Course:
    """A force F(t) = 0.7·F(t − 1) + tanh 2v(t − 1), scaled by 100 N: it needs F1 and v1 and nothing else.

    It has the past that a motion is taken to have, since every sample is learned.
    """
    one = course_of(hysteretic(1, 700), ())
    speed = np.concatenate([velocity_before(one.motion, LEAD), one.motion.v]) / np.std(one.motion.v)
    force = np.zeros(speed.size)
    for k in range(1, force.size):
        force[k] = 0.7 * force[k - 1] + 100.0 * np.tanh(2.0 * speed[k - 1])
    return replace(one, force=force[LEAD:])


@pytest.fixture(scope="module")
def path(course: Course) -> tuple[list[Step], list[Known]]:
    told: list[Known] = []
    scales = scales_of([course], ["displacement", "velocity"])
    steps = select([course], scales, START, OFFERED, on_step=lambda step, known: told.append(dict(known)))
    return steps, told


def test_what_the_force_depends_on_is_found_and_the_error_falls_with_every_step(
    path: tuple[list[Step], list[Known]],
) -> None:
    steps, _ = path
    assert steps[0].act == "start"
    assert {"F1", "v1"} <= {str(one) for one in steps[-1].tried.structure.regressors}
    errors = [step.tried.error for step in steps]
    assert all(after <= before for before, after in pairwise(errors))
    assert steps[-1].tried.rrmsse < 3.0


def test_an_interrupted_search_goes_on_where_it_was_and_ends_at_the_same(
    course: Course, path: tuple[list[Step], list[Known]]
) -> None:
    steps, told = path
    scales = scales_of([course], ["displacement", "velocity"])
    counted: list[int] = []
    again = select(
        [course], scales, START, OFFERED, known=told[-1], on_step=lambda step, known: counted.append(len(known))
    )
    assert [step.act for step in again] == [step.act for step in steps]
    assert np.array_equal(again[-1].tried.weights, steps[-1].tried.weights)
    assert counted[0] == len(told[-1])


def test_a_search_is_kept_in_a_file_of_its_own_runs(
    course: Course, path: tuple[list[Step], list[Known]], tmp_path: Path
) -> None:
    steps, told = path
    file = tmp_path / "search.json"
    assert read_selection(file, [course]) == {}
    write_selection(file, [course], steps, told[-1])
    again = read_selection(file, [course])
    assert again.keys() == told[-1].keys()
    assert all(np.array_equal(one.weights, again[name].weights) for name, one in told[-1].items())
    with pytest.raises(DataError, match=r"search\.json: it belongs to other runs"):
        read_selection(file, [replace(course, force=2.0 * course.force)])
    data = json.loads(file.read_text())
    data["tried"][0]["error"] = -1.0
    file.write_text(json.dumps(data))
    with pytest.raises(DataError, match=r"tried\[0\].error is -1: a mean square is not below 0"):
        read_selection(file, [course])
    file.write_bytes(b"\x89HDF")
    with pytest.raises(DataError, match="not the JSON of a search: name another file"):
        read_selection(file, [course])
    file.write_text("{")
    with pytest.raises(DataError, match=r"search\.json: "):
        read_selection(file, [course])


def test_a_structure_that_grew_begins_as_good_as_its_parent(course: Course) -> None:
    scales = scales_of([course], ["displacement", "velocity"])
    parent_of = Structure(regressors("F1 v1"), 4)
    weights = 0.2 * np.random.default_rng(1).standard_normal(parent_of.size)
    grown = parent_of.with_regressor(regressors("v0")[0])
    old = network(parent_of, scales).simulate(weights, samples_of([course], parent_of, scales))
    new = network(grown, scales).simulate(inherited(grown, parent_of, weights), samples_of([course], grown, scales))
    assert np.allclose(old, new, atol=1e-12)


def test_without_the_signal_that_matters_the_error_is_far_higher(
    course: Course, path: tuple[list[Step], list[Known]]
) -> None:
    found = path[0][-1].tried
    scales = scales_of([course], ["displacement", "velocity"])
    left = without_each(found, [course], scales, symbols="Fv")
    assert left["v"].rrmsse > 5.0 * found.rrmsse
    assert left["F"].rrmsse > found.rrmsse


def test_what_a_regressor_promises_puts_those_that_matter_first(course: Course) -> None:
    scales = scales_of([course], ["displacement", "velocity"])
    alone = select([course], scales, START, OFFERED, most=1)[0].tried
    promised = gains(
        alone.structure, alone.weights, [one for one in OFFERED if str(one) != "F1"], [course], scales, 0.02
    )
    assert max(promised, key=lambda one: promised[one]) in regressors("v0 v1")
    both = select([course], scales, Structure(regressors("F1 v1 x0"), 4), OFFERED, most=3)[0].tried
    lost = losses(both.structure, both.weights, [course], scales, 0.02)
    assert min(lost, key=lambda one: lost[one]) == regressors("x0")[0]


def test_a_shortlist_reaches_the_error_of_the_whole_search_with_fewer_structures(course: Course) -> None:
    scales, offered = scales_of([course], ["displacement", "velocity"]), candidates("Fxv", 3)
    tried: dict[int | None, int] = {}
    found: dict[int | None, float] = {}
    for shortlist in (SHORTLIST, None):
        counts: list[int] = []
        told = partial(_count, counts)
        path = select([course], scales, START, offered, shortlist=shortlist, most=3, on_step=told)
        found[shortlist], tried[shortlist] = path[-1].tried.rrmsse, counts[-1]
    assert found[SHORTLIST] < 1.2 * found[None]
    assert tried[SHORTLIST] < tried[None]


def _count(counts: list[int], step: Step, known: Known) -> None:
    counts.append(len(known))


def test_a_fair_share_visits_what_is_rare_and_keeps_short_courses_whole() -> None:
    long, short = course_of(hysteretic(4, 6000), ()), course_of(hysteretic(5, 600), ())
    assert fair_share([long, short], 10_000) == [long, short]
    share = fair_share([long], 1500)
    counted = sum(int(one.counted.sum()) for one in share)
    assert 1500 <= counted < 2200
    speed = np.concatenate([one.motion.v[one.counted] for one in share])
    assert np.ptp(speed) > 0.85 * np.ptp(long.motion.v)


def test_a_search_of_runs_is_drawn_and_goes_on_from_its_file(tmp_path: Path) -> None:
    state, runs = tmp_path / "search.json", [hysteretic(6, 700, current=True)]
    offer = Offer(nodes=2, longest=1, most=4)
    found = search("nnoe", runs, offer=offer, state=state)
    assert str(found.path[0].tried.structure) == "F1 v1 i1, 2 nodes"
    assert set(found.without) == {one.symbol for one in found.found.structure.regressors}
    again = search("nnoe", runs, offer=offer, state=state)
    assert [step.act for step in again.path] == [step.act for step in found.path]
    assert again.trained == found.trained
    page = search_html("a <damper>", found)
    assert "a &lt;damper&gt;" in page
    assert all(f"without {name}" in page for name in ("force", "velocity"))
    with pytest.raises(DataError, match="not for 'hybrid'"):
        search("hybrid", runs)
    with pytest.raises(DataError, match="longest delay is 0"):
        Offer(longest=0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not the JSON of a search: name another file, or remove it"),
        ('{"format": "damper-rig/selection", "training": "%s", "tried": 5}', r"tried is a number: it must be a list"),
    ],
)
def test_a_state_that_is_none_is_refused_with_the_cure(text: str, message: str, tmp_path: Path) -> None:
    course = course_of(hysteretic(6, 700), ())
    (tmp_path / "search.json").write_text(text.replace("%s", digest_of([course])))
    with pytest.raises(DataError, match=rf"search\.json: {message}"):
        read_selection(tmp_path / "search.json", [course])
