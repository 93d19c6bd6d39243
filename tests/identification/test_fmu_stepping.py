"""FMUs in a vehicle study, as the damper and as the vehicle: from sample to sample, and what is refused."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from pythonfmu3 import FmuBuilder

import damper_rig as dr
from api.cli.main import main
from excitation.configuration import to_spec
from excitation.errors import DesignError
from identification.errors import DataError, SimulationError
from identification.fmu import Choice, FmuModel, open_fmu
from identification.models.motion import Motion
from identification.models.stepping import Moment, Stepper
from identification.physical.literature import literature
from identification.physical.model import Model, element
from identification.physical.modelfile import write_model
from identification.studies.realtime import realtime
from identification.studies.vehicle import (
    FmuVehicle,
    FmuWiring,
    OnOwn,
    OnRoad,
    Skyhook,
    open_vehicle,
    own_study,
    quarter_car,
    ride,
    road_study,
)
from identification.studies.vehicle import grounds as g
from tests.identification.maxwell_runs import sine_motion
from tests.identification.packed_car import WIRING, packed_car
from tests.identification.packed_fmu import compiled, packed

DT = 1e-3
VISCOUS = Model(name="viscous", elements=(element("viscous_damping", {"c": 1500.0}),))
SHORT = OnRoad(seconds=5.0, period_s=2.0, step_s=0.004, current=0.0)


@dataclass(frozen=True)
class Fmus:
    """A damper of 1 500 N·s/m with a lag of 1 ms, and a quarter car, each with a step that can be taken back or not."""

    back: FmuModel
    forth: FmuModel
    car: FmuVehicle
    once: FmuVehicle


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fmus]:
    place = tmp_path_factory.mktemp("fmu")
    library = compiled(place)
    choice = Choice(parameters={"c": "1500", "lag": "0.001"})
    wiring = to_spec(FmuWiring, tomllib.loads(WIRING), "wiring")
    with ExitStack() as opened:
        dampers = [
            opened.enter_context(closing(open_fmu(packed(place / f"{name}.fmu", library, back=back), choice)))
            for name, back in (("back", True), ("forth", False))
        ]
        cars = [
            opened.enter_context(closing(open_vehicle(packed_car(place, back=back), wiring))) for back in (True, False)
        ]
        yield Fmus(*dampers, *cars)


def stepped(stepper: Stepper, motion: Motion) -> np.ndarray:
    moments = [Moment(*row) for row in zip(motion.x, motion.v, motion.a, motion.i, strict=True)]
    return np.array([stepper.start(moments[0]), *(stepper.advance(at) for at in moments[1:])])


def test_step_by_step_it_gives_the_force_that_it_gives_along_the_motion(fmus: Fmus) -> None:
    motion = sine_motion(0.01, 2.0, 500, 2)
    for model in (fmus.back, fmus.forth):
        whole = model.force(motion)
        assert stepped(model.stepper(motion.dt), motion)[10:] == pytest.approx(whole[10:], abs=1e-6)


MODEL_EXCHANGE = """
from pythonfmu3 import Fmi3Causality as C, Fmi3SlaveBase, Fmi3Variability as V, Fmi3Initial, Float64, ModelExchange
class Three(Fmi3SlaveBase, ModelExchange):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time = self.v = self.y = self.dy = 0.0
        self.register_variable(Float64("time", causality=C.independent, variability=V.continuous))
        self.register_variable(Float64("v", causality=C.input, variability=V.continuous, start=0.0))
        self.register_variable(Float64("y", causality=C.local, variability=V.continuous, initial=Fmi3Initial.exact,
                                       start=0.0))
        self.register_variable(Float64("dy", causality=C.local, variability=V.continuous, derivative=2))
        self.register_variable(Float64("F", causality=C.output, variability=V.continuous,
                                       getter=lambda: 650.0 * self.y))
    def get_continuous_state_derivatives(self):
        self.dy = (self.v - self.y) / 0.01
        return [self.dy]
"""


def test_a_model_exchange_of_version_3_is_taken_back_by_its_continuous_states(tmp_path: Path) -> None:
    (tmp_path / "three.py").write_text(MODEL_EXCHANGE)
    FmuBuilder.build_FMU(tmp_path / "three.py", dest=tmp_path)
    with closing(open_fmu(tmp_path / "Three.fmu")) as model:
        stepper, lag, y, v = model.stepper(DT), 0.01, 0.0, 0.0
        stepper.start(Moment())
        for k in range(1, 41):
            after = 0.3 * np.sin(0.1 * k)
            stepper.force(Moment(v=-5.0))
            found = stepper.advance(Moment(v=after))
            ramp, decay = (after - v) / DT, np.exp(-DT / lag)  # the exact answer to an input that is linear
            y = after - ramp * lag + (y - v + ramp * lag) * decay
            v = after
            assert found == pytest.approx(650.0 * y, abs=1e-3)  # of 200 N: tolerance of the solver


def test_a_question_leaves_no_trace(fmus: Fmus) -> None:
    asked, plain = fmus.back.stepper(DT), fmus.back.stepper(DT)
    for stepper in (asked, plain):
        stepper.start(Moment(v=0.1))
    for k in range(5):
        there = Moment(v=0.1 * (k + 2))
        assert asked.force(Moment(v=-3.0)) < 0.0 < plain.force(there)
        assert asked.advance(there) == plain.advance(there)


@pytest.mark.slow
def test_in_a_vehicle_it_is_the_damper_that_it_is_an_export_of(fmus: Fmus) -> None:
    names = ("weighted acceleration a_w (Wk)", "rms of the tyre force", "rms of the stroke", "power in the damper")
    same, back, forth = (road_study([model], SHORT).answers[0] for model in (VISCOUS, fmus.back, fmus.forth))
    for name in names:
        assert back.figure(name).value == pytest.approx(same.figure(name).value, rel=0.02)  # the lag of 1 ms
        assert forth.figure(name).value == pytest.approx(back.figure(name).value, rel=0.01)
    assert not any("guess" in note for note in back.notes)
    assert any("the guess is off by" in note for note in forth.notes)


def test_a_current_is_looked_up_only_in_what_can_be_asked(fmus: Fmus) -> None:
    Skyhook(inverse=fmus.back)
    with pytest.raises(DataError, match=r"'forth\.fmu' cannot be taken back a step"):
        Skyhook(inverse=fmus.forth)


def test_it_runs_against_the_clock(fmus: Fmus) -> None:
    found = realtime(fmus.back, DT, seconds=0.5, current=0.0)
    assert found.finite
    assert found.recovery_s < 0.05


def test_a_failure_says_what_failed_and_when(fmus: Fmus) -> None:
    for how, words in (("0", "no solution"), ("1", "gives nan for axial at t = 0.01 s"), ("2", "crashed")):
        wiring = replace(fmus.back.wiring, parameters={"fails_at": "0.009", "how": how})
        stepper = replace(fmus.back, wiring=wiring).stepper(DT)
        with pytest.raises(SimulationError, match=words):
            stepped(stepper, sine_motion(0.01, 5.0, 200, 1))


@pytest.mark.slow
def test_a_vehicle_in_an_fmu_answers_as_the_same_vehicle_here(fmus: Fmus) -> None:
    ground = g.sine(2.0, 0.01, 1.5, DT)
    for damper in (VISCOUS, literature("Bouc–Wen")):
        ours = ride(quarter_car(), {"suspension": damper}, ground)
        back, once = (ride(car, {"suspension": damper}, ground) for car in (fmus.car, fmus.once))
        assert back.outputs["body"] == pytest.approx(ours.outputs["body"], abs=1e-9)
        assert back.outputs["a_body"] == pytest.approx(ours.outputs["body_acceleration"], abs=1e-6)
        assert back.force == pytest.approx(ours.force, abs=1e-5)
        assert once.outputs["body"] == pytest.approx(ours.outputs["body"], abs=3e-4)  # of 12 mm


@pytest.mark.slow
def test_a_study_in_a_vehicle_of_ones_own_gives_the_figures_of_the_same_vehicle_here(fmus: Fmus) -> None:
    asked = OnOwn(seconds=5.0, period_s=2.0, step_s=0.004)
    found = own_study(fmus.car, [VISCOUS], asked).answers[0]
    ours = road_study([VISCOUS], SHORT).answers[0]
    for name, same in (
        ("weighted a_body (Wk)", "weighted acceleration a_w (Wk)"),
        ("rms of the stroke of suspension", "rms of the stroke"),
        ("power in suspension", "power in the damper"),
        ("peak of the transmissibility to body", "peak of the transmissibility"),
    ):
        assert found.figure(name).value == pytest.approx(
            ours.figure(same).value, rel=1e-3
        )  # the FMU is a Runge–Kutta one
    late = own_study(fmus.once, [VISCOUS], asked).answers[0]
    assert any("one step late" in note for note in late.notes)


@pytest.mark.slow
def test_a_notebook_and_the_command_drive_it_alike(
    fmus: Fmus, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "wiring.toml").write_text(WIRING)
    (tmp_path / "study.toml").write_text("seconds = 5.0\nperiod = 2.0\nstep = 0.004\n")
    write_model(tmp_path / "m.json", VISCOUS)
    given = ["--fmu", str(fmus.car.path), "--wiring", str(tmp_path / "wiring.toml"), "--json"]
    page = ["-o", str(tmp_path / "own.html"), "--config", str(tmp_path / "study.toml")]
    assert main(["study", "own", str(tmp_path / "m.json"), *given, *page]) == 0
    told = json.loads(capsys.readouterr().out)
    found = dr.study.vehicle([VISCOUS], {"seconds": 5.0, "period": 2.0, "step": 0.004}, own=fmus.car)
    assert found.data()["answers"] == told["answers"]
    assert "Transmissibility to body" in (tmp_path / "own.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("was", "now", "said"),
    [
        ('"s_dot"', '"speed"', "damper is 'speed': it is no output of the FMU, which has a_body, body, s, s_dot"),
        ('"F"', '"s"', "force is 's': it is no input of the FMU, which has F, v_road, z_road"),
        ('["a_body", "body"]', "[]", "output is empty"),
        ("[[ground]]", "[parameters]\nmass = 1.0\n[[ground]]", "the FMU has no variable 'mass'"),
    ],
)
def test_a_wiring_that_cannot_be_right_is_refused_in_one_line(
    fmus: Fmus, was: str, now: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "wiring.toml").write_text(WIRING.replace(was, now))
    write_model(tmp_path / "m.json", VISCOUS)
    given = ["--fmu", str(fmus.car.path), "--wiring", str(tmp_path / "wiring.toml"), "-o", str(tmp_path / "own.html")]
    assert main(["study", "own", str(tmp_path / "m.json"), *given]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
    assert not (tmp_path / "own.html").exists()


def test_two_dampers_of_one_name_are_refused() -> None:
    twice = tomllib.loads(WIRING)
    twice["damper"] *= 2
    with pytest.raises(DesignError, match="two dampers are called 'suspension'"):
        to_spec(FmuWiring, twice, "wiring")
