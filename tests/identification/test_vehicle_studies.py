"""Studies in the vehicle: seat, bogie, own vehicles, what an effect is worth; range and real time."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from identification.compute import Cluster, Serial, Threads, using
from identification.errors import DataError, ModelError
from identification.models import SimulationModel, load_model
from identification.physical.literature import literature
from identification.physical.model import Model, element
from identification.studies.journal import kept
from identification.studies.realtime import realtime, realtime_data
from identification.studies.service_range import Limits, covered, range_of
from identification.studies.vehicle import (
    Bogie,
    Ground,
    OnRail,
    OnRoad,
    OnSeat,
    OwnVehicle,
    RailBogie,
    Skyhook,
    quarter_car,
    ride,
    road_study,
    seat_suspension,
    study_data,
    vehicle_study,
    without,
    worth,
)
from identification.studies.vehicle import grounds as g
from identification.studies.vehicle.bogie import linear_bogie, saturated
from identification.studies.vehicle.bogie_study import hunting, limit_cycle
from identification.studies.vehicle.skyhook import looked_up
from identification.studies.vehicle.transmissibility import by_multisine, stepped_sine
from tests.identification.loopback_cluster import dask_on_loopback
from tests.identification.random_black_boxes import BLACK

DT = 1e-3
SEAT = Path("examples/seat")


def viscous(c: float) -> Model:
    return Model(name="viscous", elements=(element("viscous_damping", {"c": c}),))


def test_the_passive_seat_has_its_peak_where_its_transfer_function_has() -> None:
    seat, frequencies = seat_suspension(), np.array([2.0, 3.5, 7.0])
    found = stepped_sine(seat, {"suspension": viscous(942.0)}, "seat", frequencies.tolist(), 0.005, DT)
    exact = seat.transfer("seat", frequencies, np.array([942.0]))
    assert found.ratio == pytest.approx(exact, rel=5e-3)
    assert found.rms == pytest.approx(np.abs(exact), rel=1e-2)


def test_a_multisine_finds_the_transfer_function_at_all_lines_at_once() -> None:
    car, tones = quarter_car(), g.tones(0.5, 20.0, 0.005, 4.0, DT, 2)
    ground = g.multisine(tones, 3, DT)
    found = by_multisine(
        ride(car, {"suspension": viscous(1500.0)}, ground), ground, "body", tones.lines, tones.period_samples
    )
    exact = np.abs(car.transfer("body", found.frequency_hz, np.array([1500.0])))
    assert np.abs(found.ratio) == pytest.approx(exact, rel=0.03, abs=0.01)
    assert found.peak[0] == pytest.approx(float(found.frequency_hz[np.argmax(exact)]), abs=0.26)


def test_a_current_is_looked_up_where_the_force_is_nearest() -> None:
    levels, forces = np.array([0.0, 0.5, 1.0]), np.array([100.0, 300.0, 400.0])
    assert looked_up(levels, forces, 200.0) == pytest.approx(0.25)
    assert looked_up(levels, forces, 900.0) == 1.0
    assert looked_up(levels, forces, -900.0) == 0.0


def test_skyhook_with_the_true_inverse_gives_the_wanted_force_where_any_current_can() -> None:
    elements = (element("viscous_damping", {"c": 200.0, "c_control": 3000.0}),)
    model, seat = Model(name="controlled", elements=elements), seat_suspension()
    hook = Skyhook(inverse=model, period_s=DT, levels=21)
    found = ride(seat, {"suspension": model}, g.sine(3.0, 0.01, 3.0, DT), control=hook)
    wanted = 2000.0 * found.outputs["seat_velocity"]
    inside = (found.current[:, 0] > 0.02) & (found.current[:, 0] < 0.98)
    inside[:1000] = False
    assert np.sum(inside) > 100
    assert np.median(np.abs(found.force[1:, 0] - wanted[:-1])[inside[1:]]) < 0.05 * np.max(np.abs(found.force))


def test_a_seat_controlled_by_what_has_no_current_is_refused() -> None:
    with pytest.raises(DataError, match="does not depend on a current"):
        Skyhook(inverse=viscous(900.0))
    hook = Skyhook(inverse=load_model(SEAT / "original.json"))
    with pytest.raises(DataError, match="skyhook controls one damper by the output 'seat_velocity': quarter car has"):
        ride(quarter_car(), {"suspension": viscous(900.0)}, g.sine(3.0, 0.01, 1.0, DT), control=hook)


def test_creep_is_linear_where_it_is_small_and_friction_where_it_is_large() -> None:
    bogie = Bogie()
    assert saturated(bogie, 1e-7, 1e-7) == pytest.approx(1.0, abs=1e-4)
    large = 0.1
    assert saturated(bogie, 0.0, large) * bogie.creep_lateral_n * large == pytest.approx(
        bogie.friction * bogie.wheel_load_n
    )


@pytest.mark.parametrize(("speed", "stable"), [(40.0, True), (80.0, False)])
def test_a_small_shift_grows_exactly_where_the_linear_bogie_is_unstable(speed: float, stable: bool) -> None:
    bogie = Bogie(speed_m_s=speed, shift_m=1e-5)
    grows = linear_bogie(bogie).growth(np.array([5e3, 5e3, 0.0, 0.0, 0.0, 0.0]))
    assert (grows < 0.0) == stable
    found = hunting(viscous(5e3), OnRail(bogie=bogie, seconds=2.0), speed)
    y = found.outputs["front_wheelset"]
    early, late = (np.max(np.abs(part)) for part in np.array_split(y, 2))
    assert (late < early) == stable
    if not stable:
        assert np.log(late / early) == pytest.approx(grows, rel=0.25)  # e-folds in the second between them


@pytest.mark.slow
def test_a_yaw_damper_stops_the_hunting_that_a_bogie_without_one_keeps_up() -> None:
    given = OnRail(seconds=3.0)
    assert limit_cycle(hunting(viscous(10.0), given, 80.0)) > 5e-3
    assert limit_cycle(hunting(load_model("examples/models/yaw.json"), given, 80.0)) == 0.0


def test_both_yaw_dampers_of_a_bogie_work_against_each_other() -> None:
    rail = np.zeros((400, 2))
    vehicle = RailBogie(replace(Bogie(), speed_m_s=60.0))
    damper = literature("Bingham", {"viscous_damping.c": 5e4, "coulomb_friction.f_c": 800.0})
    found = ride(vehicle, {"right": damper, "left": damper}, Ground(dt=DT, x=rail, v=rail, a=rail))
    assert found.loose == 0
    slides = np.abs(found.v[:, 0]) > 1e-4
    assert found.force[slides, 0] == pytest.approx(-found.force[slides, 1], abs=1e-2)


def own_quarter_car() -> OwnVehicle:
    """The quarter car of the package, written down by a user."""

    def derivative(s: np.ndarray, ground: np.ndarray, force: np.ndarray) -> list[float]:
        spring = 17e3 * (s[0] - s[1]) + force[0]
        tyre = 180e3 * (s[1] - ground[0, 0]) + 100.0 * (s[3] - ground[0, 1])
        return [s[2], s[3], -spring / 300.0, (spring - tyre) / 40.0]

    return OwnVehicle(
        name="mine",
        dampers=("suspension",),
        grounds=("road",),
        outputs={"body": "m"},
        begin=(0.0, 0.0, 0.0, 0.0),
        derivative=derivative,
        motion=lambda s, ground, force: [[s[0] - s[1], s[2] - s[3]]],
        observe=lambda s, ground, force: [s[0]],
    )


def test_a_vehicle_of_the_users_own_answers_as_the_same_vehicle_here() -> None:
    ground, damper = g.sine(2.0, 0.01, 1.5, DT), literature("Bouc–Wen")
    mine = ride(own_quarter_car(), {"suspension": damper}, ground)
    ours = ride(quarter_car(), {"suspension": damper}, ground)
    assert mine.outputs["body"] == pytest.approx(ours.outputs["body"], abs=5e-6)
    assert mine.force == pytest.approx(ours.force, abs=3.0)
    with pytest.raises(ModelError, match=r"mine: observe gives the shape \(2,\)"):
        replace(own_quarter_car(), observe=lambda s, ground, force: [s[0], s[1]])


SHORT = OnRoad(seconds=5.0, period_s=2.0)
COARSE = replace(SHORT, step_s=0.004)  # what is asked does not depend on the step


def test_what_an_effect_is_worth_is_told_with_the_figure_that_changes_most() -> None:
    full = Model(
        name="full",
        elements=(element("viscous_damping", {"c": 1200.0}), element("coulomb_friction", {"f_c": 120.0})),
    )
    found = worth(full, without(full, ["coulomb_friction"]), lambda models: road_study(models, COARSE), "the friction")
    assert found.matters
    assert "the friction matters in this vehicle" in found.sentence
    assert found.changes["power in the damper"] == pytest.approx(
        found.study.change(found.study.answers[1].label, "power in the damper")
    )
    same = worth(full, replace(full, name="same"), lambda models: road_study(models, COARSE), "nothing")
    assert not same.matters
    assert set(same.changes.values()) == {0.0}


@pytest.mark.parametrize(
    "model",
    [pytest.param(m, id=m.name, marks=[] if m.name == "no memory" else pytest.mark.slow) for m in BLACK],
)
def test_a_black_box_of_any_kind_is_a_damper_that_tells_where_it_leaves_its_training(model: SimulationModel) -> None:
    found = road_study([model], replace(SHORT, current=0.5)).answers[0]
    assert 0.0 < found.figure("weighted acceleration a_w (Wk)").value < 10.0
    assert any("velocity leaves the training range" in note for note in found.notes)


def test_an_effect_of_the_rig_is_worth_nothing_in_a_vehicle() -> None:
    model = Model(name="m", elements=(*viscous(9.0).elements, element("moving_mass", {"m": 2.0})))
    with pytest.raises(ModelError, match="belongs to the rig"):
        without(model, ["moving_mass"])
    with pytest.raises(ModelError, match="has no element 'nothing'"):
        without(model, ["nothing"])


def test_a_study_is_the_same_every_time() -> None:
    one, other = (road_study([viscous(1200.0)], COARSE) for _ in range(2))
    assert json.dumps(study_data(one)) == json.dumps(study_data(other))


def test_every_step_is_measured_by_the_clock_that_is_given() -> None:
    ticks = iter(range(0, 10**12, 5000))
    found = realtime(viscous(900.0), DT, seconds=0.5, clock=lambda: next(ticks))
    assert found.durations_s.size == 499
    assert found.mean_s == pytest.approx(5e-6)
    assert found.worst_s == pytest.approx(5e-6)
    assert realtime_data(found)["over"] == 0


@pytest.mark.parametrize("name", ["Bouc–Wen", "enriched Maxwell", "LuGre", "hyperbolic tangent"])
def test_no_model_diverges_on_a_momentary_bad_input(name: str) -> None:
    found = realtime(literature(name), DT, seconds=4.0)
    assert found.finite
    assert found.recovery_s < 0.5


def test_a_real_time_run_needs_the_current_that_the_model_needs() -> None:
    with pytest.raises(DataError, match="needs a current"):
        realtime(load_model("examples/models/mr.json"), DT)
    with pytest.raises(DataError, match="step is 0 s"):
        realtime(viscous(1.0), 0.0)


def test_the_share_of_the_service_outside_the_training_is_that_of_the_areas() -> None:
    rng = np.random.default_rng(1)
    inner, outer = rng.uniform(-1.0, 1.0, (2, 40000)), rng.uniform(-1.0, 1.0, (2, 40000))
    trained = covered("training", 0.5 * inner[0], 0.5 * inner[1])
    service = covered("service", outer[0], outer[1])
    found = range_of(service, [trained], [Limits(name="rig", stroke=(-1.0, 1.0), velocity=(-0.5, 0.5))])
    assert found.outside_hull == pytest.approx(0.75, abs=0.02)
    assert found.limits[0].outside(service) == pytest.approx(0.5, abs=0.02)
    with pytest.raises(DataError, match="nothing to compare the service with"):
        range_of(service, [], [None])


@pytest.mark.slow
def test_the_commands_answer_in_json_and_write_their_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, page = "examples/models/passive.json", tmp_path / "page.html"
    assert main(["study", "vehicle", model, "--seconds", "5", "-o", str(page), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["answers"][0]["figures"]
    assert "plotly" in page.read_text(encoding="utf-8")
    assert main(["study", "realtime", model, "--seconds", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["finite"] is True


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["vehicle", "examples/models/mr.json"], "needs a current"),
        (["vehicle", "examples/models/passive.json", "--road", "Z"], "road_class"),
        (["vehicle", "examples/models/passive.json", "--step", "1"], "step is 1 s"),
        (["bogie", "examples/models/yaw.json", "--speeds", "200", "100"], "the lower first"),
        (["seat", "examples/models/passive.json"], "does not depend on a current"),
        (["worth", "examples/models/passive.json"], "give --base"),
        (["worth", "examples/models/passive.json", "--without", "x"], "has no element 'x'"),
    ],
)
def test_bad_input_is_one_line_before_the_work(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", *words, "-o", str(tmp_path / "x.html")]) == 2
    told = capsys.readouterr()
    assert said in told.err
    assert told.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


SETTINGS = [
    OnRoad(seconds=5.0, period_s=2.0, sines_hz=(2.0,), step_s=0.004),
    OnRail(seconds=1.0, speeds=2, resolution_m_s=20.0),
]


@pytest.mark.slow
@pytest.mark.parametrize("setting", SETTINGS, ids=["car", "bogie"])
def test_an_interrupted_study_goes_on_where_it_was_to_the_bit(setting: OnRoad | OnRail, tmp_path: Path) -> None:
    models, journal = [viscous(1200.0), viscous(2400.0)], tmp_path / "page.html.part"
    whole = vehicle_study(models, setting)
    told: list[float] = []

    def interrupt(done: float, text: str) -> None:
        told.append(done)
        if len(told) == 3:
            raise KeyboardInterrupt

    with using(Serial()):
        with pytest.raises(KeyboardInterrupt), kept(journal):
            vehicle_study(models, setting, on_progress=interrupt)
        count = len(told)
        with kept(journal):
            again = vehicle_study(models, setting, on_progress=lambda done, text: told.append(done))
        alone: list[float] = []
        vehicle_study(models, setting, on_progress=lambda done, text: alone.append(done))
    assert len(told) - count == len(alone) - 3
    assert not journal.exists()
    assert json.dumps(study_data(again)) == json.dumps(study_data(whole))
    for one, other in zip(again.answers, whole.answers, strict=True):
        assert all(np.array_equal(a.y, b.y) for a, b in zip(one.curves, other.curves, strict=True))


@pytest.mark.slow
def test_a_seat_is_controlled_the_same_in_any_number_of_threads() -> None:
    models, setting = [load_model(SEAT / "original.json")], OnSeat(sines_hz=(3.0, 4.0), step_s=0.005)
    found = []
    for executor in (Serial(), Threads(3)):
        with closing(executor), using(executor):
            found.append(json.dumps(study_data(vehicle_study(models, setting))))
    assert found[0] == found[1]


@pytest.mark.slow
def test_a_study_is_the_same_to_the_bit_on_a_dask_cluster(tmp_path: Path) -> None:
    models, setting = [viscous(1200.0)], SETTINGS[0]
    with dask_on_loopback(tmp_path) as dask:
        dask.add_workers(1)
        with closing(Cluster(dask.address, threads=1)) as cluster, using(cluster):
            there = vehicle_study(models, setting)
    with using(Serial()):
        here = vehicle_study(models, setting)
    assert json.dumps(study_data(here)) == json.dumps(study_data(there))
