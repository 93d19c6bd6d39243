"""Plans: from configurations, to and from files, checked against the rig."""

from __future__ import annotations

import copy
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import excitation
from excitation import DesignError, EnvelopeError, Excitation, ExcitationError, Kind, Test, TestPlan
from excitation.configuration import to_spec
from excitation.design import design, design_file, remake, remake_file
from excitation.envelope import Envelope, check, check_plan, excesses, read_envelope, scale_to_fit, temperatures
from excitation.files import read_plan, write_plan
from excitation.harmonic_plan import harmonic_plan
from excitation.plan import config_of, plan_from_config, test_from_config
from excitation.prediction import predict

EXAMPLES = Path(__file__).parents[2] / "examples"

MULTISINE: dict[str, Any] = {
    "name": "ms",
    "kind": "multisine",
    "sample_rate": 1000.0,
    "period_samples": 1000,
    "displacement": {"f_min": 1.0, "f_max": 30.0, "max_displacement": 0.06, "max_velocity": 1.5},
    "current": {"f_min": 1.0, "f_max": 100.0, "min": 0.3, "max": 1.6},
    "homogenise": {"grid": [10, 10]},
}
SINE: dict[str, Any] = {
    "name": "sine",
    "kind": "sine",
    "sample_rate": 1000.0,
    "amplitude": 0.02,
    "frequency": 2.0,
    "cycles": 5,
    "current": 0.5,
}
STEPS: dict[str, Any] = {
    "name": "steps",
    "kind": "steps",
    "sample_rate": 1000.0,
    "amplitude": 0.02,
    "frequency": 1.0,
    "cycles": 6,
    "levels": [0.0, 0.5, 1.0],
    "step_time": 0.4,
    "held_out": True,
}

REFUSED: list[tuple[str, dict[str, Any], dict[str, Any], str]] = [
    ("no name", MULTISINE, {"name": None}, "name is missing"),
    ("empty name", MULTISINE, {"name": " "}, "printable name"),
    ("kind", MULTISINE, {"kind": "music"}, "kind is 'music': it must be one of"),
    ("misspelt", MULTISINE, {"sampel_rate": 1.0}, "sampel_rate = 1.0 is not a known key: known are sample_rate"),
    (
        "misspelt below",
        MULTISINE,
        {"displacement.fmax": 3},
        "displacement.fmax = 3 is not a known key: known are f_min",
    ),
    ("missing below", MULTISINE, {"displacement.f_min": None}, "displacement.f_min is missing"),
    ("text for number", MULTISINE, {"displacement.f_max": "30"}, "displacement.f_max is '30'"),
    ("bool for number", SINE, {"amplitude": True}, "amplitude is True"),
    ("nan", MULTISINE, {"displacement.max_velocity": float("nan")}, "finite"),
    ("infinite", SINE, {"amplitude": float("inf")}, "finite"),
    ("negative", SINE, {"amplitude": -0.02}, "amplitude is -0.02 m: it must be above 0 m"),
    ("beyond Nyquist", MULTISINE, {"displacement.f_max": 600.0}, "half the sample rate (500 Hz)"),
    ("empty band", MULTISINE, {"displacement.f_min": 1.2, "displacement.f_max": 1.5}, "no DFT line"),
    ("band upside down", MULTISINE, {"displacement.f_min": 40.0}, "it must be above f_min"),
    ("spectrum", MULTISINE, {"displacement.spectrum": "pink"}, "one of flat, quarter-car, road"),
    ("lines", MULTISINE, {"displacement.lines": "even"}, "displacement.lines is 'even'"),
    ("table lengths", MULTISINE, {"displacement.spectrum": {"frequency": [1, 30], "amplitude": [1]}}, "same number"),
    ("table order", MULTISINE, {"displacement.spectrum": {"frequency": [30, 1], "amplitude": [1, 1]}}, "rise"),
    ("table short", MULTISINE, {"displacement.spectrum": {"frequency": [1, 9], "amplitude": [1, 1]}}, "span"),
    ("table silent", MULTISINE, {"displacement.spectrum": {"frequency": [1, 30], "amplitude": [0, 0]}}, "one above"),
    ("record", MULTISINE, {"displacement.spectrum": {"record": "nowhere.h5"}}, "nowhere.h5"),
    ("current range", MULTISINE, {"current.max": 0.1}, "above min (0.3 A)"),
    ("grid", MULTISINE, {"homogenise.grid": [10]}, "grid"),
    ("method", MULTISINE, {"homogenise.method": "magic"}, "'direct' or 'duym'"),
    ("variables", MULTISINE, {"homogenise.variables": ["velocity", "velocity"]}, "each may be given once"),
    (
        "no current to cover",
        MULTISINE,
        {"current": None, "homogenise.variables": ["velocity", "current"]},
        "no [current]",
    ),
    ("seed", MULTISINE, {"seed": -1}, "seed is -1"),
    ("seed type", MULTISINE, {"seed": 1.5}, "seed is 1.5"),
    ("level", MULTISINE, {"level": 1.5}, "level is 1.5"),
    ("huge", MULTISINE, {"period_samples": 10**12}, "period_samples"),
    ("fast", SINE, {"frequency": 400.0}, "eight samples a period"),
    ("no cycles", SINE, {"cycles": 0}, "cycles is 0"),
    ("endless", SINE, {"frequency": 1e-9}, "samples; at most"),
    ("held out", SINE, {"held_out": "yes"}, "held_out is 'yes'"),
    ("dwell", SINE, {"dwell": -1.0}, "dwell is -1"),
    ("gate", SINE, {"min_temperature": 40.0, "max_temperature": 30.0}, "min_temperature is 40"),
    ("one level", STEPS, {"levels": [1.0]}, "two or more different currents"),
    ("no step", STEPS, {"step_time": 0.0}, "step_time"),
    ("no such step", SINE, {"before": [{"step": "dance"}]}, "one of prompt, tare, gate"),
    ("no list", SINE, {"before": {"step": "tare"}}, "before"),
    ("empty prompt", SINE, {"before": [{"step": "prompt", "text": " "}]}, "printable"),
    ("misspelt step", SINE, {"before": [{"step": "tare", "limits": 3}]}, "limits"),
    ("open gate", SINE, {"before": [{"step": "gate", "of": "oil"}]}, "min, max or both"),
    ("gate of the sun", SINE, {"before": [{"step": "gate", "of": "sun", "max": 9}]}, "of is 'sun'"),
    ("shut gate", SINE, {"before": [{"step": "gate", "of": "oil", "min": 9.0, "max": 8.0}]}, "below max"),
    ("tare", SINE, {"before": [{"step": "tare", "limit": -1.0}]}, "limit is -1"),
    ("on failure", SINE, {"on_failure": "ignore"}, "on_failure is 'ignore'"),
    ("retries", SINE, {"retries": 0}, "0 retries"),
    ("energy", SINE, {"energy": -1.0}, "energy is -1"),
    ("a date", SINE, {"amplitude": __import__("datetime").date(2026, 1, 1)}, "not JSON serializable"),
]


def changed(config: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    config = copy.deepcopy(config)
    for key, value in changes.items():
        *path, last = key.split(".")
        table = config
        for step in path:
            table = table[step]
        if value is None:
            table.pop(last)
        else:
            table[last] = value
    return config


@pytest.mark.parametrize(("config", "changes", "expected"), [r[1:] for r in REFUSED], ids=[r[0] for r in REFUSED])
def test_a_wrong_configuration_is_refused_in_one_line(
    config: dict[str, Any], changes: dict[str, Any], expected: str
) -> None:
    with pytest.raises(DesignError) as refused:
        test_from_config(changed(config, changes))
    assert expected in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("config", "expected"),
    [
        ({}, "tests must be a list"),
        ({"tests": []}, "at least one test"),
        ({"tests": [3]}, "tests[0] is 3"),
        ({"tests": [SINE, SINE]}, "'sine' occurs more than once"),
        ({"tests": [{**SINE, "energy": 9.0}]}, "belong to the warm-up"),
        ({"tests": [SINE], "test": 1}, "test is not a known key"),
        (3, "plan is 3"),
    ],
)
def test_a_wrong_plan_is_refused_in_one_line(config: Any, expected: str) -> None:
    with pytest.raises(DesignError) as refused:
        plan_from_config(config)
    assert expected in str(refused.value)


BEFORE = [
    {"step": "prompt", "text": "Fit the 12 mm clevis, µ-washer „A“"},
    {"step": "tare", "limit": 300.0, "readings": 100},
    {"step": "gate", "of": "ambient", "min": 18.0, "max": 28.0, "wait": 0.0},
    {"step": "gate", "of": "oil", "max": 40.0, "wait": 600.0},
]


def plan() -> TestPlan:
    gated = {**SINE, "name": 'gated, "quoted" β', "min_temperature": 25.5, "dwell": 3.0, "data_set": "test 1"}
    triangle = {**SINE, "name": "slow", "kind": "triangle", "frequency": 0.37, "corner_time": 0.1}
    gated |= {"before": BEFORE, "on_failure": "retry", "retries": 3}
    warm_up = {**SINE, "name": "warm", "energy": 5e3, "to_temperature": 35.0}
    return plan_from_config({"warm_up": warm_up, "tests": [MULTISINE, SINE, STEPS, gated, triangle]})


@pytest.mark.parametrize("ending", ["toml", "csv", "h5"])
def test_a_plan_reads_back_what_was_written(ending: str, tmp_path: Path) -> None:
    wrote = plan()
    write_plan(tmp_path / f"p.{ending}", wrote)
    read = read_plan(tmp_path / f"p.{ending}")
    assert [config_of(t) for t in read.tests] == [config_of(t) for t in wrote.tests]
    assert read.warm_up is not None
    assert (read.warm_up.name, read.warm_up.energy_j, read.warm_up.to_temperature_degc) == ("warm", 5e3, 35.0)
    assert read.tests[3].before == wrote.tests[3].before
    assert len(wrote.tests[3].before) == 4
    for one, other in zip(read.tests, wrote.tests, strict=True):
        assert one.excitation.displacement_m.tobytes() == other.excitation.displacement_m.tobytes()


@pytest.mark.parametrize("name", ["p.toml", "p.csv", "p.h5", "x.h5", "x.csv"])
def test_whatever_a_file_holds_is_made_again(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    if name.startswith("p"):
        write_plan(path, plan())
        again = remake_file(path)
        assert isinstance(again, TestPlan)
        assert [config_of(t) for t in again.tests] == [config_of(t) for t in plan().tests]
    else:
        one = test_from_config(MULTISINE).excitation
        excitation.write_excitation(path, one)
        made = remake_file(path)
        assert isinstance(made, Excitation)
        assert made.displacement_m.tobytes() == one.displacement_m.tobytes()


@pytest.mark.parametrize("ending", [".h5", ".csv", ".mat", ".drv", ".rsp"])
def test_an_excitation_file_is_a_plan_of_one_test(ending: str, tmp_path: Path) -> None:
    excitation.write_excitation(tmp_path / f"alone{ending}", test_from_config(SINE).excitation)
    (only,) = read_plan(tmp_path / f"alone{ending}").tests
    assert only.name == "alone"


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("p.toml", "tests = [", "not valid TOML"),
        ("p.toml", 'format = "other"\n', "format is 'other'"),
        ("p.toml", "[[tests]]\nname = 'x'\nkind = 'sine'\n", "sample_rate is missing"),
        ("p.csv", "a,b\n1,2\n", "needs the columns"),
        ("p.csv", "name,wave_form,amplitude (m)\nx,sine,wide\n", "line 2, amplitude (m) is 'wide'"),
        ("p.h5", "no", "not an HDF5 file"),
        ("p.txt", "", "ending '.txt' is not known"),
    ],
)
def test_a_broken_plan_file_is_refused_in_one_line(name: str, content: str, expected: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(ExcitationError) as refused:
        read_plan(tmp_path / name)
    assert expected in str(refused.value)
    assert name in str(refused.value)
    assert "\n" not in str(refused.value)


# --- the rig's envelope ---

RIG = read_envelope(EXAMPLES / "rig_25kn.toml")


@settings(max_examples=25, deadline=None)
@given(
    st.floats(1e-3, 0.3),
    st.floats(0.2, 40.0),
    st.floats(-1.0, 4.0),
    st.sampled_from(["sine", "triangle", "steps"]),
)
def test_what_was_scaled_to_fit_fits_and_what_fits_stays(
    amplitude: float, frequency: float, current: float, kind: str
) -> None:
    own = {"levels": [0.1, current, 0.7], "step_time": 0.3} if kind == "steps" else {"current": current}
    base = {k: v for k, v in SINE.items() if k != "current"}
    test = test_from_config({**base, **own, "kind": kind, "amplitude": amplitude, "frequency": frequency})
    fits = not excesses(test.excitation, RIG)
    scaled = scale_to_fit(test, RIG)
    check(scaled, RIG)
    assert (scaled is test) == fits
    assert np.abs(scaled.excitation.displacement_m).max() <= np.abs(test.excitation.displacement_m).max()
    assert remake(scaled.excitation).displacement_m.tobytes() == scaled.excitation.displacement_m.tobytes()


def test_scaling_reaches_the_limit_to_the_digits_that_are_kept() -> None:
    test = test_from_config({**SINE, "amplitude": 0.5, "frequency": 1.0})
    scaled = scale_to_fit(test, RIG)
    assert np.abs(scaled.excitation.displacement_m).max() == pytest.approx(0.075, rel=2e-3)


def test_a_multisine_is_scaled_by_its_level() -> None:
    slow = replace(RIG, motion=replace(RIG.motion, max_velocity_m_s=0.4))
    scaled = scale_to_fit(test_from_config(MULTISINE), slow)
    assert scaled.excitation.design["level"] == pytest.approx(0.4 / 1.5, rel=2e-3)


def test_the_refusal_names_test_limit_excess_and_the_nearest_that_fits() -> None:
    with pytest.raises(EnvelopeError) as refused:
        check(test_from_config({**SINE, "name": "too wide", "amplitude": 0.09, "frequency": 0.5}), RIG)
    text = str(refused.value)
    for part in ("'too wide'", "displacement 0.09 m", "limit is 0.075 m", "20 % above", "amplitude = 0.075"):
        assert part in text
    assert "\n" not in text
    suggested = test_from_config({**SINE, "amplitude": 0.075, "frequency": 0.5})
    check(suggested, RIG)


def test_the_suggested_frequency_fits_too() -> None:
    with pytest.raises(EnvelopeError, match="or frequency = ") as refused:
        check(test_from_config({**SINE, "amplitude": 0.05, "frequency": 9.0}), RIG)
    frequency = float(str(refused.value).rsplit("frequency = ", 1)[1])
    check(test_from_config({**SINE, "amplitude": 0.05, "frequency": frequency}), RIG)


EXCEEDING: list[tuple[str, dict[str, Any], str]] = [
    ("velocity", {"amplitude": 0.05, "frequency": 8.0}, "velocity"),
    ("acceleration", {"amplitude": 0.005, "frequency": 40.0}, "acceleration"),
    ("bandwidth", {"amplitude": 1e-5, "frequency": 60.0}, "frequency 58.82 Hz"),
    ("current", {"current": 3.0}, "current 3 A"),
    ("current below", {"current": -0.5}, "the least is"),
    ("sample rate", {"sample_rate": 750.0}, "sample rate 750 Hz"),
    ("heat", {"cycles": 4000, "amplitude": 0.05, "frequency": 2.5}, "temperature rise"),
]


@pytest.mark.parametrize(("changes", "expected"), [e[1:] for e in EXCEEDING], ids=[e[0] for e in EXCEEDING])
def test_each_limit_is_checked(changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(EnvelopeError, match=expected):
        check(test_from_config({**SINE, **changes}), RIG)


def test_hydraulics_and_force_are_checked() -> None:
    oil, force = RIG.hydraulics, RIG.force
    assert oil is not None
    assert force is not None
    test = test_from_config({**SINE, "amplitude": 0.05, "frequency": 3.0})
    check(test, RIG)
    starved = replace(RIG, hydraulics=replace(oil, pump_flow_m3_s=1e-5, accumulator_volume_m3=1e-5))
    narrow = replace(RIG, hydraulics=replace(oil, valve_rated_flow_m3_s=1e-5))
    weak = replace(RIG, force=replace(force, dynamic_n=500.0))
    for rig, expected in ((starved, "accumulator oil"), (narrow, "servo-valve flow"), (weak, "force")):
        with pytest.raises(EnvelopeError, match=expected):
            check(test, rig)


def test_the_predicted_heat_of_a_viscous_damper_is_the_area_of_its_ellipse() -> None:
    config = {"motion": {"max_displacement": 1.0, "max_velocity": 10.0}, "specimen": {"damping": 700.0}}
    rig = to_spec(Envelope, config | {"specimen": {"damping": 700.0, "heat_capacity": 1000.0}})
    predicted = predict(test_from_config(SINE).excitation, rig)
    energy = 5 * np.pi * 700.0 * (2 * np.pi * 2.0) * 0.02**2
    assert predicted.energy_j == pytest.approx(energy, rel=1e-9)
    assert predicted.temperature_rise_k == pytest.approx(energy / 1000.0, rel=1e-9)
    assert predicted.force_n == pytest.approx(700.0 * 2 * np.pi * 2.0 * 0.02, rel=1e-9)
    assert predicted.velocity_m_s == pytest.approx(2 * np.pi * 2.0 * 0.02, rel=1e-9)
    assert predicted.acceleration_m_s2 == pytest.approx((2 * np.pi * 2.0) ** 2 * 0.02, rel=1e-9)


def test_a_force_model_takes_the_place_of_the_specimen() -> None:
    predicted = predict(test_from_config(SINE).excitation, RIG, lambda m: 123.0 * np.sign(m.velocity_m_s))
    assert predicted.force_n == 123.0


def test_a_dwell_cools_the_damper() -> None:
    hot = {**SINE, "amplitude": 0.05, "frequency": 3.0, "cycles": 60}
    tests = [{**hot, "name": f"t{n}"} for n in range(6)]
    without = plan_from_config({"tests": tests})
    rested = plan_from_config({"tests": [{**t, "dwell": 600.0} for t in tests]})
    ends = [temperatures(p, check_plan(p, replace(RIG, temperature=None)), RIG) for p in (without, rested)]
    assert list(ends[0]) == sorted(ends[0])
    assert ends[1][-1] < ends[0][-1]
    assert RIG.temperature is not None
    cool = replace(RIG, temperature=replace(RIG.temperature, max_degc=0.5 * (ends[0][-1] + ends[1][-1])))
    with pytest.raises(EnvelopeError, match="longer dwell"):
        check_plan(without, cool)
    check_plan(rested, cool)


def test_samples_without_a_design_are_checked_but_not_scaled() -> None:
    foreign = Excitation(
        kind=Kind.CUSTOM, sample_rate_hz=1000.0, period_samples=0, displacement_m=np.linspace(0.0, 0.1, 900)
    )
    with pytest.raises(EnvelopeError, match="displacement"):
        check(Test(name="foreign", excitation=foreign), RIG)
    with pytest.raises(EnvelopeError, match="no design"):
        scale_to_fit(Test(name="foreign", excitation=foreign), RIG)


def test_a_wrong_envelope_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text("[motion]\nmax_displacement = 0.1\nmax_velocity = -1.0\n")
    with pytest.raises(DesignError, match=r"rig\.toml: motion: max_velocity is -1"):
        read_envelope(tmp_path / "rig.toml")
    with pytest.raises(DesignError, match=r"none\.toml"):
        read_envelope(tmp_path / "none.toml")


# --- harmonic plans ---


def from_example(name: str) -> TestPlan:
    made = design_file("harmonic", EXAMPLES / f"{name}.toml")
    assert isinstance(made, TestPlan)
    return made


def values(plan_: TestPlan, key: str) -> list[float]:
    return [float(str(t.excitation.design[key])) for t in plan_.tests]


def test_the_yaw_damper_plan_has_the_papers_thirty_tests() -> None:
    made = from_example("yaw_damper_30_tests")
    amplitude, frequency = np.array(values(made, "amplitude")), np.array(values(made, "frequency"))
    speed = 2 * np.pi * amplitude * frequency
    assert len(made.tests) == 30
    assert (amplitude.min(), amplitude.max()) == (0.002, 0.025)
    assert frequency.min() == pytest.approx(0.0068, rel=2e-3)
    assert frequency.max() == pytest.approx(8.117, rel=2e-3)
    assert speed.min() == pytest.approx(0.085e-3, rel=6e-3)
    assert speed.max() == pytest.approx(0.255, rel=2e-3)


def test_the_mr_matrix_is_that_of_table_1() -> None:
    made = from_example("mr_seat_damper_matrix")
    asked = [t.excitation.design.get("frequency_asked", t.excitation.design["frequency"]) for t in made.tests]
    pairs = set(zip(values(made, "amplitude"), asked, strict=True))
    highest = {0.005: 9.0, 0.010: 7.0, 0.015: 5.0, 0.020: 4.0}
    frequencies = [0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 6, 7, 9]
    assert pairs == {(a, f) for a, top in highest.items() for f in frequencies if f <= top}
    assert len(made.tests) == 43 * 6
    assert {round(i, 9) for i in values(made, "current")} == {0.0, 0.2, 0.4, 0.6, 0.8, 1.0}
    assert made.warm_up is not None
    assert all(t.min_temperature_degc == 25.0 for t in made.tests)
    sets = [t.data_set for t in made.tests]
    assert (sets.count("validation"), sets.count("test")) == (39, 39)
    assert all(t.held_out == (t.data_set != "training") for t in made.tests)


def test_the_narx_plan_is_that_of_table_1() -> None:
    made = from_example("narx_sets")
    found: dict[str, set[tuple[float, float, float]]] = {}
    for t, a, f, i in zip(
        made.tests, values(made, "amplitude"), values(made, "frequency"), values(made, "current"), strict=True
    ):
        found.setdefault(t.data_set, set()).add((a * 1e3, round(f, 2), i))
    steps, ends = [0, 0.5, 1, 1.5, 2], [0, 1, 2]
    assert found["training"] == (
        {(7.5, 0.5, i) for i in steps}
        | {(15.0, 1.0, i) for i in steps}
        | {(7.5, 1.0, i) for i in ends}
        | {(15.0, 0.5, i) for i in ends}
    )
    assert found["validation"] == {(7.5, 0.5, 1.0), (15.0, 1.0, 1.0), (7.5, 1.0, 0.5), (7.5, 1.0, 1.5)}
    assert found["test 1"] == (
        {(15.0, 0.5, 0.5), (15.0, 0.5, 1.5)} | {(10.0, 1.0, i) for i in steps} | {(12.5, 0.75, i) for i in steps}
    )
    assert found["test 2"] == found["test 3"] == {(15.0, 0.75, i) for i in (1.0, 1.5, 2.0)}


def test_the_third_axis_follows_from_two() -> None:
    made = from_example("pvp_and_cvp")
    for t in made.tests:
        a, f = (float(str(t.excitation.design[k])) for k in ("amplitude", "frequency"))
        speed = predict(t.excitation, RIG).velocity_m_s
        if t.name.startswith("constant_velocity"):
            assert speed == pytest.approx(0.25, rel=5e-3)
        if t.name.startswith("constant_amplitude"):
            assert a == 0.025
            assert speed == pytest.approx(2 * np.pi * a * f)


AXES = st.fixed_dictionaries(
    {
        "amplitude": st.lists(st.floats(5e-3, 0.05), min_size=1, max_size=4, unique=True),
        "peak_velocity": st.lists(st.floats(1e-2, 0.5), min_size=1, max_size=4, unique=True),
        "current": st.lists(st.sampled_from([0.0, 0.5, 1.0]), min_size=1, max_size=3, unique=True),
    }
)


@settings(max_examples=15, deadline=None)
@given(AXES, st.sampled_from(["blocks", "random", "listed"]), st.integers(0, 99), st.integers(2, 9))
def test_every_order_plays_every_test_once_and_blocks_span_the_severities(
    axes: dict[str, Any], method: str, seed: int, block_size: int
) -> None:
    base = {"sample_rate": 200.0, "cycles": 1, "settling_cycles": 0, "series": [axes]}
    listed = harmonic_plan({**base, "order": {"method": "listed"}})
    played = harmonic_plan({**base, "order": {"method": method, "seed": seed, "block_size": block_size}})

    def motions(p: TestPlan) -> list[Any]:
        return sorted(
            (a, f, i) for a, f, i in zip(*(values(p, k) for k in ("amplitude", "frequency", "current")), strict=True)
        )

    assert motions(played) == motions(listed)
    if method == "blocks":
        severity = np.array([predict(t.excitation, RIG).velocity_m_s for t in played.tests])
        blocks = -(-severity.size // block_size)
        sizes = [len(range(b, severity.size, blocks)) for b in range(blocks)]
        parts = np.split(severity, np.cumsum(sizes)[:-1])
        ordered = np.sort(severity)
        for part in parts:  # each block holds one of the gentlest and one of the most severe
            assert part.min() <= ordered[blocks - 1] * (1 + 6e-2)
            assert part.max() >= ordered[-blocks] * (1 - 6e-2)


@settings(max_examples=15, deadline=None)
@given(st.floats(0.0, 0.45), st.floats(0.0, 0.45), st.integers(0, 99))
def test_splits_have_the_asked_shares(validation: float, test: float, seed: int) -> None:
    series = [{"amplitude": [0.001 * k for k in range(1, 9)], "frequency": [1.0, 2.0, 4.0]}]
    made = harmonic_plan(
        {
            "sample_rate": 100.0,
            "cycles": 1,
            "series": series,
            "split": {"validation": validation, "test": test, "seed": seed},
        }
    )
    sets = [t.data_set for t in made.tests]
    assert sets.count("validation") == round(24 * validation)
    assert sets.count("test") == round(24 * test)
    assert sets.count("training") == 24 - round(24 * validation) - round(24 * test)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"series": []}, "series is empty"),
        ({"series": [{"amplitude": 0.01}]}, "give two of the three"),
        ({"series": [{"amplitude": 0.01, "frequency": 1.0, "peak_velocity": 1.0}]}, "give two of the three"),
        ({"series": [{"amplitude": [], "frequency": 1.0}]}, "amplitude is an empty list"),
        ({"series": [{"amplitude": -0.01, "frequency": 1.0}]}, "amplitude is -0.01"),
        ({"series": [{"amplitude": 0.01, "frequency": {"min": 2.0, "max": 1.0, "count": 3}}]}, "min … max"),
        ({"split": {"validation": 0.6, "test": 0.6}}, "below 1"),
        ({"warm_up": {"amplitude": 0.01, "frequency": 1.0}}, "warm_up needs min_temperature"),
        ({"serie": 1}, "serie = 1 is not a known key"),
    ],
)
def test_a_wrong_harmonic_configuration_is_refused(changes: dict[str, Any], expected: str) -> None:
    base = {"sample_rate": 1000.0, "series": [{"amplitude": 0.01, "frequency": 1.0}]}
    with pytest.raises(DesignError) as refused:
        harmonic_plan({**base, **changes})
    assert expected in str(refused.value)


def test_a_plan_beyond_the_rig_is_refused_or_scaled(tmp_path: Path) -> None:
    text = 'sample_rate = 1000.0\nenvelope = "rig.toml"\n[[series]]\namplitude = [0.05, 0.1]\nfrequency = 0.5\n'
    (tmp_path / "plan.toml").write_text(text)
    (tmp_path / "rig.toml").write_text((EXAMPLES / "rig_25kn.toml").read_text())
    with pytest.raises(EnvelopeError, match=r"plan\.toml: test 'sine_100mm_0\.5Hz' exceeds"):
        design_file("harmonic", tmp_path / "plan.toml")
    fitted = design_file("harmonic", tmp_path / "plan.toml", fit=True)
    assert isinstance(fitted, TestPlan)
    assert max(values(fitted, "amplitude")) == pytest.approx(0.075, rel=2e-3)


# --- shipped configurations ---

COMMAND_OF = {
    "random_phase": "random-phase",
    "service_record": "random-phase",
    "low_crest": "random-phase",
    "homogenised": "homogenised",
    "homogenised_levels": "homogenised",
    "homogenised_passive": "homogenised",
    "yaw_damper_30_tests": "harmonic",
    "mr_seat_damper_matrix": "harmonic",
    "narx_sets": "harmonic",
    "pvp_and_cvp": "harmonic",
}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n == "homogenised_passive" else []) for n in COMMAND_OF]
)
def test_every_shipped_configuration_makes_what_its_first_line_says(name: str) -> None:
    path = EXAMPLES / f"{name}.toml"
    assert f"damper-rig design {COMMAND_OF[name]} examples/{name}.toml" in path.read_text().splitlines()[0]
    made = design_file(COMMAND_OF[name], path)
    assert made.duration_s > 0


def test_levels_and_realisations_make_a_plan() -> None:
    made = design(
        "random-phase",
        {k: v for k, v in MULTISINE.items() if k not in ("name", "kind")} | {"levels": [0.2, 1.0], "realisations": 3},
    )
    assert isinstance(made, TestPlan)
    assert len(made.tests) == 6
    gentle, severe = (made.tests[n].excitation for n in (0, 3))
    np.testing.assert_allclose(gentle.displacement_m * 5, severe.displacement_m, atol=1e-12)
    assert not np.allclose(made.tests[0].excitation.displacement_m, made.tests[1].excitation.displacement_m)


def test_an_envelope_bounds_multisines_too() -> None:
    config = {k: v for k, v in MULTISINE.items() if k not in ("name", "kind")}
    slow = {"motion": {"max_displacement": 0.05, "max_velocity": 0.3}}
    with pytest.raises(EnvelopeError, match="velocity"):
        design("random-phase", {**config, "envelope": slow})
    fitted = design("random-phase", {**config, "envelope": slow, "scale_to_fit": True})
    assert isinstance(fitted, Excitation)
    assert predict(fitted, to_spec(Envelope, slow)).velocity_m_s <= 0.3


def test_every_exported_name_exists() -> None:
    for name in excitation.__all__:
        assert hasattr(excitation, name)
    assert excitation.__all__ == sorted(excitation.__all__)


def test_a_plan_holds_designs_and_no_samples_however_long_its_tests_are() -> None:
    slow = [{**SINE, "name": f"slow {n}", "frequency": 0.002 * n, "cycles": n} for n in range(1, 13)]
    long = [{**MULTISINE, "name": f"long {n}", "periods": 500, "seed": n} for n in range(3)]
    plan_from_config({"tests": [slow[-1], long[0]]})  # what is imported once
    tracemalloc.start()
    try:
        plan = plan_from_config({"tests": [*slow, *long]})
        kept = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    samples = sum(test.excitation.samples for test in plan.tests)
    assert samples > 7_000_000
    assert kept < 0.2e6
    assert plan.tests[0].excitation.displacement_m.size == plan.tests[0].excitation.samples


@settings(max_examples=25, deadline=None)
@given(st.floats(0.002, 0.05), st.floats(0.05, 1.2), st.sampled_from(["sine", "triangle"]))
def test_a_plan_keeps_the_peak_velocity_and_plays_three_periods_or_more(
    amplitude: float, velocity: float, wave_form: str
) -> None:
    config = {"sample_rate": 1000.0, "wave_form": wave_form, "cycles": 3, "settling_cycles": 1}
    frequency = velocity / amplitude / (4.0 if wave_form == "triangle" else 2.0 * np.pi)
    if frequency > 40.0:
        return
    [test] = harmonic_plan({**config, "series": [{"amplitude": amplitude, "peak_velocity": velocity}]}).tests
    share = float(str(test.excitation.design["frequency"])) / frequency
    assert 1 - 5e-3 <= share <= 1 + 1e-9
    assert test.excitation.samples >= 3 * test.excitation.period_samples


def test_a_plan_that_was_read_with_its_samples_keeps_none_where_its_design_makes_them(tmp_path: Path) -> None:
    slow = [{**SINE, "name": f"slow {n}", "frequency": 0.01 * n, "cycles": n} for n in range(1, 6)]
    plan = plan_from_config({"tests": [*slow, {**MULTISINE, "kind": "multisine", "periods": 50}]})
    changed = replace(plan.tests[0].excitation, displacement_m=0.5 * plan.tests[0].excitation.displacement_m)
    write_plan(tmp_path / "plan.h5", plan)
    read_plan(tmp_path / "plan.h5")  # what is imported once
    tracemalloc.start()
    try:
        read = read_plan(tmp_path / "plan.h5")
        kept = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert kept < 0.3e6 < sum(test.excitation.displacement_m.nbytes for test in read.tests) / 10
    for one, other in zip(read.tests, plan.tests, strict=True):
        assert one.excitation.displacement_m.tobytes() == other.excitation.displacement_m.tobytes()
        assert one.excitation.figures == other.excitation.figures
    write_plan(tmp_path / "other.h5", replace(plan, tests=(replace(plan.tests[0], excitation=changed),)))
    [test] = read_plan(tmp_path / "other.h5").tests
    assert test.excitation.displacement_m.tobytes() == changed.displacement_m.tobytes()


def test_a_speed_that_no_frequency_has_is_refused_with_the_test() -> None:
    series = [{"amplitude": [0.005], "peak_velocity": [1e308]}]
    with pytest.raises(DesignError, match=r"amplitude 0.005 m has a frequency of inf Hz"):
        harmonic_plan({"sample_rate": 1000.0, "cycles": 5, "series": series})
