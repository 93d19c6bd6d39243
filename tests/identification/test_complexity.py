"""Complexity: what matters is measured or kept, the rest is left out, the ladder descends, bad plans are refused."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from excitation import plan_from_config
from excitation.configuration import to_spec
from excitation.errors import DesignError
from identification.compute import Serial, using
from identification.errors import DataError, ModelError
from identification.models.protocol import SimulationModel
from identification.physical.model import Model, element
from identification.studies.complexity import (
    BogieStep,
    Complexity,
    Plan,
    RoadStep,
    complexity,
    complexity_data,
    complexity_text,
    plan_of_tests,
    write_complexity,
)
from identification.studies.complexity.result import Rung, Verdict
from identification.studies.journal import kept
from rigctl.runfile import Run
from tests.identification.maxwell_runs import sine_motion
from tests.identification.random_black_boxes import BLACK, DT

FULL = Model(
    name="damper",
    elements=(
        element("viscous_damping", {"c": 1500.0}),
        element("coulomb_friction", {"f_c": 60.0}),
        element("linear_stiffness", {"k": 15.0}),
    ),
)


@dataclass(frozen=True)
class Along:
    """rms of the force along a sine: a step of a plan that a user writes."""

    name: str
    amplitude_m: float
    frequency_hz: float

    def check(self, model: SimulationModel) -> None:
        if "current" in model.inputs:
            raise DataError(f"step '{self.name}': no current for {model.inputs['current']}")

    def __call__(self, model: SimulationModel) -> float:
        motion = sine_motion(self.amplitude_m, self.frequency_hz, 200, 3)
        return float(np.sqrt(np.mean(model.force(motion) ** 2)))


STEPS = (Along("fast", 0.02, 2.0), Along("slow", 0.005, 0.5))


def runs() -> list[Run]:
    random = np.random.default_rng(3)
    return [_run(a, f, random) for a, f in ((0.002, 0.5), (0.01, 1.0), (0.02, 2.0), (0.005, 3.0))]


def _run(amplitude: float, frequency: float, random: np.random.Generator, rate_hz: float = 0.0) -> Run:
    period = round(rate_hz / frequency) or 250
    motion = sine_motion(amplitude, frequency, period, 6)
    force = FULL.force(motion) + 5.0 * random.standard_normal(motion.x.size)
    return Run(
        run_id=f"{amplitude} {frequency}", created="2026-01-01T00:00:00+00:00", specimen="s",
        sample_rate_hz=1.0 / motion.dt, period_samples=period, excitation_kind="sine", status="complete",
        channels={"displacement": motion.x, "force": force, "current": np.full(force.size, 0.5)},
        units={"displacement": "m", "force": "N", "current": "A"},
    )  # fmt: skip


@cache
def found() -> Complexity:
    return complexity(FULL, runs(), STEPS)


def verdicts(found: Complexity, element: str) -> list[Verdict]:
    return [one.verdict for one in found.indicators if one.element == element]


def test_what_every_step_can_do_without_is_left_out_and_the_rest_fitted_again() -> None:
    assert verdicts(found(), "linear_stiffness") == [Verdict.SIMPLIFY] * 2
    assert found().dropped == ("linear_stiffness",)
    assert found().simplified.ids == ("viscous_damping", "coulomb_friction")


def test_what_a_step_needs_is_kept() -> None:
    assert Verdict.KEEP in verdicts(found(), "coulomb_friction")
    assert verdicts(found(), "viscous_damping") == [Verdict.KEEP] * 2


def test_what_the_tests_leave_uncertain_is_to_be_measured_with_a_test_that_tells_more() -> None:
    vague = [{"coulomb_friction.f_c": 20.0}, {"coulomb_friction.f_c": 100.0}]
    answer = complexity(FULL, runs(), STEPS[1:], feasible=vague)
    one = next(i for i in answer.indicators if i.element == "coulomb_friction")
    assert one.verdict is Verdict.MEASURE
    assert one.test.startswith(("a sine of ", "a triangle of "))
    [designed] = answer.designed
    assert designed.parameter == "coulomb_friction.f_c"
    assert designed.left < 0.1  # 40 N of friction beside a noise of 5 N
    [test] = plan_from_config(tomllib.loads(plan_of_tests(answer))).tests
    assert test.excitation.displacement_m.max() <= 0.0201  # within what the runs have shown
    assert answer.spread == "the feasible set"


def test_the_ladder_leads_from_a_linear_dashpot_to_the_full_model_with_less_error_on_every_rung() -> None:
    ladder = found().ladder
    assert ladder[0].free == 1
    assert ladder[-1].label == "full: damper"
    errors = [rung.rrmsse or np.inf for rung in ladder]
    assert all(after <= before * 1.001 for before, after in pairwise(errors))
    assert all(rung.cost is not None and rung.cost > 0.0 for rung in ladder)
    knee = found().knee
    assert knee is not None
    assert "coulomb_friction" in knee.label


def test_other_models_stand_on_the_same_ladder() -> None:
    other = Model(name="guess", elements=(element("viscous_damping", {"c": 900.0}),))
    answer = complexity(FULL, runs()[:2], STEPS[:1], beside=[other])
    assert [rung.label for rung in answer.beside] == ["guess"]
    assert answer.beside[0].outputs[0] == pytest.approx(STEPS[0](other))


@pytest.mark.slow
def test_black_boxes_and_hybrids_stand_on_the_same_ladder_and_in_the_same_steps() -> None:
    small, random = Model(name="small", elements=FULL.elements[:2]), np.random.default_rng(3)
    measured = [_run(0.01, 1.0, random, 1.0 / DT), _run(0.02, 2.0, random, 1.0 / DT)]
    step = RoadStep(name="road", output="stroke", seconds=3.0, current_a=0.5)
    rungs = complexity(small, measured, [step], beside=BLACK).beside
    assert [rung.kind for rung in rungs] == [box.kind for box in BLACK]
    for rung, box in zip(rungs, BLACK, strict=True):
        assert rung.rrmsse is not None
        assert rung.cost is not None
        assert rung.outputs == (step(box),)


@pytest.mark.slow
def test_the_steps_of_a_plan_are_of_any_vehicle() -> None:
    text = """
    [[step]]
    name = "seat"
    vehicle = "seat"
    output = "weighted acceleration"
    [[step]]
    name = "yaw"
    vehicle = "bogie"
    output = "damper force"
    speed = 60.0
    seconds = 1.0
    """
    seat, bogie = to_spec(Plan, tomllib.loads(text), "plan.toml").step
    assert isinstance(bogie, BogieStep)
    soft, hard = (Model(name="m", elements=(element("viscous_damping", {"c": c}),)) for c in (300.0, 3000.0))
    assert 0.0 < seat(soft) != seat(hard) > 0.0
    assert bogie(soft) < bogie(hard)
    swift = replace(bogie, output="critical speed", low_m_s=60.0, high_m_s=100.0, speeds=2, seconds=1.0)
    assert 60.0 <= swift(soft) <= 100.0
    wrong = {"step": [{"name": "yaw", "vehicle": "bogie", "output": "stroke"}]}
    with pytest.raises(DesignError, match=r"step\.0\.output is 'stroke'.*critical speed"):
        to_spec(Plan, wrong, "plan.toml")
    with pytest.raises(DesignError, match="vehicle is 'ship': use car, seat or bogie"):
        to_spec(Plan, {"step": [{"name": "sea", "vehicle": "ship", "output": "stroke"}]}, "plan.toml")


def test_a_ladder_of_two_rungs_has_no_knee() -> None:
    rung = Rung(label="a", kind="physical", free=1, rrmsse=1.0, cost=1.0, outputs=())
    assert replace(found(), ladder=(rung, rung)).knee is None


def test_the_page_and_the_data_hold_the_answer(tmp_path: Path) -> None:
    write_complexity(tmp_path / "page.html", found())
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "The knee of the ladder is" in text
    data = complexity_data(found())
    assert data["dropped"] == ["linear_stiffness"]
    assert data["simplified"]["kind"] == "physical"
    assert "simplify" in complexity_text(found())


def a_plan(**changed: object) -> Callable[[], Plan]:
    return lambda: to_spec(Plan, {"step": [{"name": "comfort", "output": "stroke", **changed}]}, "plan.toml")  # type: ignore[dict-item]


def test_a_plan_that_cannot_be_right_is_refused_before_the_work() -> None:
    with pytest.raises(DesignError, match="output"):
        to_spec(Plan, {"step": [{"name": "comfort"}]}, "plan.toml")
    with pytest.raises(DesignError, match="seconds is 1"):
        a_plan(seconds=1.0)()
    with pytest.raises(DesignError, match="no step"):
        to_spec(Plan, {"step": []}, "plan.toml")
    with pytest.raises(DataError, match="two steps are called 'fast'"):
        complexity(FULL, runs(), (STEPS[0], STEPS[0]))
    controlled = Model(name="mr", elements=(element("viscous_damping", {"c": 1e3, "c_control": 500.0}),))
    with pytest.raises(DataError, match="current"):
        complexity(controlled, runs(), (RoadStep(name="road", output="stroke"),))
    with pytest.raises(ModelError, match="the feasible set has nothing"):
        complexity(FULL, runs(), STEPS, feasible=[{"nothing": 1.0}, {"nothing": 2.0}])


def test_a_road_is_a_step_whose_output_depends_on_the_damper() -> None:
    step = RoadStep(name="stroke", output="stroke", seconds=3.0)
    soft, hard = (Model(name="m", elements=(element("viscous_damping", {"c": c}),)) for c in (800.0, 4000.0))
    assert step(soft) > step(hard)


def test_an_interrupted_study_goes_on_where_it_was_to_the_bit(tmp_path: Path) -> None:
    journal, told = tmp_path / "part", list[str]()

    def interrupt(done: float, text: str) -> None:
        told.append(text)
        if len(told) == 6:
            raise KeyboardInterrupt

    with using(Serial()):
        with pytest.raises(KeyboardInterrupt), kept(journal):
            complexity(FULL, runs(), STEPS, tell=interrupt)
        assert journal.stat().st_size > 500
        again = list[str]()
        with kept(journal):
            answer = complexity(FULL, runs(), STEPS, tell=lambda done, text: again.append(text))
    assert "fitting" not in again
    assert not journal.exists()
    data = [complexity_data(one) for one in (answer, found())]
    for one in data:
        for rung in one["ladder"]:
            rung.pop("cost_s")  # the only figure that is measured
    assert json.dumps(data[0]) == json.dumps(data[1])
