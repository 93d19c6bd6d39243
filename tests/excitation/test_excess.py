"""What exceeds the rig is refused, dropped, shortened or scaled, and listed; presets and joins of several plans."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from excitation import DesignError, EnvelopeError, ExcitationError, TestPlan, write_plan
from excitation.configuration import read_config, to_config
from excitation.design import design, design_file
from excitation.envelope import read_envelope
from excitation.excess import fit_plan
from excitation.plan import plan_from_config

EXAMPLES = Path(__file__).parents[2] / "examples"
RIG: Any = to_config(read_envelope(EXAMPLES / "rig_25kn.toml"))
MATRIX: dict[str, Any] = {
    "sample_rate": 1000.0, "order": {"method": "listed"}, "envelope": RIG,
    "series": [{"amplitude": [0.01, 0.02, 0.1], "frequency": 1.0}],
}  # fmt: skip
HOT: dict[str, Any] = {**MATRIX, "cycles": 500, "series": [{"amplitude": 0.04, "frequency": 4.0, "current": 1.0}]}
PRESET: dict[str, Any] = {"sample_rate": 1000.0, "amplitude": 0.025, "max_velocity": 1.0}


def plan(command: str, config: dict[str, Any]) -> TestPlan:
    made = design(command, config)
    assert isinstance(made, TestPlan)
    return made


def test_tests_beyond_the_rig_are_refused_unless_something_else_is_asked() -> None:
    for config in (MATRIX, HOT):
        with pytest.raises(EnvelopeError):
            design("harmonic", config)


def test_dropped_tests_are_gone_and_listed() -> None:
    left = plan("harmonic", {**MATRIX, "on_excess": "drop"})
    assert [test.name for test in left.tests] == ["sine_10mm_1Hz", "sine_20mm_1Hz"]
    [change] = left.changes
    assert change.startswith("sine_100mm_1Hz: dropped: displacement 0.1 m, the limit is 0.075 m")


def test_shortened_tests_are_as_long_as_the_heat_allows_and_listed() -> None:
    left = plan("harmonic", {**HOT, "on_excess": "shorten"})
    cycles = int(str(left.tests[0].excitation.design["cycles"]))
    assert 10 < cycles < 500
    assert f"shortened, cycles 500 → {cycles}: temperature rise" in left.changes[0]
    with pytest.raises(EnvelopeError):
        design("harmonic", {**HOT, "cycles": cycles + 1})
    with pytest.raises(EnvelopeError, match=r"every test exceeds .* cannot be shortened to fit: displacement"):
        design("harmonic", {**MATRIX, "series": [{"amplitude": 0.1, "frequency": 1.0}], "on_excess": "shorten"})


def test_what_cannot_be_shortened_is_left_out_and_listed_and_the_others_are_shortened() -> None:
    wide = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.1, "frequency": 1.0, "cycles": 3}
    hot = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.04, "frequency": 4.0, "current": 1.0, "cycles": 500}
    tests = [{"test": {**wide, "name": "wide"}}, {"test": {**hot, "name": "hot"}}]
    for parts in (tests, tests[::-1]):
        left = plan("plan", {"parts": parts, "envelope": RIG, "on_excess": "shorten"})
        [name] = [test.name for test in left.tests]
        assert name == "hot"
        listed = {change.split(":")[0]: change for change in left.changes}
        assert listed["wide"].startswith("wide: left out, cannot be shortened to fit: displacement 0.1 m, the limit is")
        assert listed["hot"].startswith("hot: shortened, cycles 500 →")


def test_what_has_no_length_is_left_out_and_what_cannot_be_scaled_too() -> None:
    sine = {"name": "s", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "cycles": 4}
    wide = plan_from_config({"tests": [{**sine, "amplitude": 0.1, "name": "wide"}, sine]})
    [test, fits] = wide.tests
    bare = replace(test.excitation.held(), design={})
    given = replace(wide, tests=(replace(test, excitation=bare), fits))
    for how, says in (("shorten", "its design has none of cycles, periods, duration"), ("scale", "only samples")):
        left = fit_plan(given, read_envelope(EXAMPLES / "rig_25kn.toml"), how)  # type: ignore[arg-type]
        assert [one.name for one in left.tests] == ["s"]
        [change] = left.changes
        assert change.startswith("wide: left out, cannot be ")
        assert says in change


def test_heat_of_the_tests_before_counts() -> None:
    hot = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.04, "frequency": 4.0, "current": 1.0, "cycles": 300}
    parts = [{"test": {**hot, "name": "first"}}, {"test": {**hot, "name": "second", "dwell": 5.0}}]
    with pytest.raises(EnvelopeError, match="'second' ends at"):
        design("plan", {"parts": parts, "envelope": RIG})
    dropped = plan("plan", {"parts": parts, "envelope": RIG, "on_excess": "drop"})
    assert [test.name for test in dropped.tests] == ["first"]
    assert dropped.changes[0].startswith("second: dropped: it ends at 110.3 °C")
    shortened = plan("plan", {"parts": parts, "envelope": RIG, "on_excess": "shorten"})
    assert [test.name for test in shortened.tests] == ["first", "second"]
    assert "second: shortened, cycles 300 →" in shortened.changes[0]


def test_scaled_tests_fit_and_are_listed_and_the_older_key_does_the_same() -> None:
    left = plan("harmonic", {**MATRIX, "on_excess": "scale"})
    assert left.changes[0].startswith("sine_100mm_1Hz: scaled, amplitude 0.1 → 0.075: displacement 0.1 m")
    assert plan("harmonic", {**MATRIX, "scale_to_fit": True}).changes == left.changes


def test_where_no_test_is_left_or_the_word_is_wrong_it_is_refused() -> None:
    with pytest.raises(EnvelopeError, match="every test exceeds the rig"):
        design("harmonic", {**HOT, "on_excess": "drop"})
    with pytest.raises(DesignError, match="on_excess is 'ignore'"):
        design("harmonic", {**MATRIX, "on_excess": "ignore"})


def test_the_presets_are_the_series_of_their_names() -> None:
    pvp = plan("preset", {**PRESET, "preset": "pvp"})
    speeds = [_speed(t.excitation) for t in pvp.tests]
    assert speeds == pytest.approx([0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0], rel=2e-3)
    assert {t.excitation.design["amplitude"] for t in pvp.tests} == {0.025}
    cvp = plan("preset", {**PRESET, "preset": "cvp", "current": [0.0, 1.0]})
    assert len(cvp.tests) == 10
    assert {round(_speed(t.excitation), 2) for t in cvp.tests} == {1.0}
    slow = plan("preset", {**PRESET, "preset": "friction"})
    assert [t.excitation.kind for t in slow.tests] == ["triangle"] * 3
    names = {t.name.split("_")[0] for t in plan("preset", {**PRESET, "preset": "shock-dyno"}).tests}
    assert names == {"gas", "friction", "pvp", "cvp"}
    rail = plan("preset", {**PRESET, "preset": "en-13802", "frequencies": [1.0, 5.0], "max_temperature": 40.0})
    assert [t.name.split("_")[0] for t in rail.tests] == ["characteristic"] * 8 + ["dynamic"] * 2
    assert {t.max_temperature_degc for t in rail.tests} == {40.0}


def _speed(excitation: Any) -> float:
    return float(abs(excitation.velocity_m_s).max())


def test_a_plan_is_joined_of_files_configurations_and_tests(tmp_path: Path) -> None:
    sine = {"name": "s", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "cycles": 4}
    write_plan(tmp_path / "old.csv", plan_from_config({"tests": [sine], "warm_up": {**sine, "name": "warm"}}))
    (tmp_path / "sweep.toml").write_text(
        (EXAMPLES / "sweep.toml").read_text().replace('envelope = "rig_25kn.toml"', "")
    )
    (tmp_path / "all.toml").write_text(
        '[[parts]]\nfile = "old.csv"\nrepeats = 2\ndwell = 7.0\n[[parts]]\nname = "p"\ncommand = "sweep"\n'
        'config = "sweep.toml"\nmax_temperature = 40.0\n[[parts]]\ntest = {kind = "sine", sample_rate = 1000.0, '
        "amplitude = 0.01, frequency = 2.0, cycles = 4}\n"
    )
    made = design_file("plan", tmp_path / "all.toml")
    assert isinstance(made, TestPlan)
    assert [t.name for t in made.tests] == ["s", "s_2", "p_sweep", "test"]
    assert [t.dwell_s for t in made.tests] == [7.0, 7.0, 0.0, 0.0]
    assert made.tests[2].max_temperature_degc == 40.0
    assert made.warm_up is not None
    assert made.warm_up.name == "warm"


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ([], "parts is empty"),
        ([{}], "either file, or command and config, or test"),
        ([{"file": "a.csv", "command": "sweep", "config": "b.toml"}], "either file"),
        ([{"file": "nowhere.csv"}], r"parts\[0\]: .*nowhere.csv: no such file"),
        ([{"command": "dance", "config": "nowhere.toml"}], r"parts\[0\]"),
        ([{"test": {"kind": "sine"}}], r"parts\[0\]: test 'test': sample_rate is missing"),
        ([{"test": {"kind": "music"}}], "kind is 'music'"),
        (7, "parts is 7"),
    ],
)
def test_a_join_that_cannot_be_made_is_refused_in_one_line(parts: Any, says: str) -> None:
    with pytest.raises(ExcitationError, match=says) as refused:
        design("plan", {"parts": parts})
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "change",
    [
        {"cycles": 0},
        {"settling_cycles": -1},
        {"series": [{"amplitude": 0.01, "frequency": 1.0, "cycles": 0}]},
        {"series": [{"amplitude": 0.01, "frequency": 1.0, "settling_cycles": -2}]},
        {"warm_up": {"amplitude": 0.01, "frequency": 1.0, "cycles": 0}, "min_temperature": 20.0},
    ],
)
def test_cycles_that_are_none_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(DesignError, match="cycles is"):
        design("harmonic", {**MATRIX, "envelope": None, **change})


@pytest.mark.parametrize("number", [5e-324, 1e-300, 1e300, 1.7e308])
@pytest.mark.parametrize("command", ["harmonic", "sweep", "noise", "road", "steps", "random-phase"])
def test_a_number_at_the_end_of_its_range_is_refused_in_one_line_without_a_warning(command: str, number: float) -> None:
    name = {"harmonic": "first_sines", "steps": "current_steps", "random-phase": "first_run"}.get(command, command)
    config = {key: value for key, value in read_config(EXAMPLES / f"{name}.toml").items() if key != "envelope"}
    for key, value in config.items():
        if isinstance(value, float):
            _designed_or_refused(command, {**config, key: number})
        if isinstance(value, dict):
            for inner in [one for one, plain in value.items() if isinstance(plain, float)]:
                _designed_or_refused(command, {**config, key: {**value, inner: number}})


def _designed_or_refused(command: str, config: dict[str, Any]) -> None:
    try:
        design(command, config)
    except ExcitationError as error:
        assert "\n" not in str(error)  # noqa: PT017 - what is designed is as good


@pytest.mark.parametrize("text", ["a = " + "[" * 5000 + "]" * 5000, "a" + ".a" * 3000 + " = 1"])
def test_a_text_nested_too_deep_is_refused_in_one_line(text: str, tmp_path: Path) -> None:
    (tmp_path / "deep.toml").write_text(text)
    for command in ("sweep", "harmonic", "plan"):
        with pytest.raises(ExcitationError) as refused:
            design_file(command, tmp_path / "deep.toml")
        assert "\n" not in str(refused.value)
