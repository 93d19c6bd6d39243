"""The family of models: one protocol, one loader, a motion from arrays, simulation along a run."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.discrepancy.foreign import as_base
from identification.errors import DataError, ModelError, ModelFileError, SimulationError
from identification.models import (
    KINDS,
    Choice,
    Motion,
    SimulationModel,
    TrainingRange,
    compare,
    load_model,
    motion_from,
    motion_of,
    simulate_run,
    with_simulation,
)
from identification.physical.model import Model, element
from identification.physical.modelfile import model_to_json, read_model, write_model
from identification.physical.simulate import simulate
from tests.identification.polynomial import POLYNOMIAL, Polynomial
from tests.identification.specimens import AS_SIMULATED, run

CUBIC = {
    "format": "damper-rig/model",
    "format_version": 1,
    "name": "cubic",
    "kind": "polynomial",
    "coefficients": [0.0, 1000.0, 0.0, -200.0],
    "trained": 0.1,
}
VISCOUS = Model(name="viscous", elements=(element("viscous_damping", {"c": 1000.0}),))


def test_a_force_that_no_machine_has_is_named_and_not_given() -> None:
    hard = Model(name="hard", elements=(element("viscous_damping", {"c": 1e30}),))
    with pytest.raises(
        SimulationError, match=r"'hard' gives -?\d\.\d+e\+\d+ N at .* s: no machine has more than 1e\+12"
    ):
        simulate_run(hard, run("none", 1, seed=4))
    (row,) = compare([hard], [run("none", 1, seed=4)]).rows
    assert row.rms is None
    assert "no machine has" in row.cells[0].failure


def written(path: Path, data: Any) -> Path:
    path.write_text(json.dumps(data), encoding="utf-8")
    return path


def test_a_further_kind_is_one_file_and_one_line_in_the_table(tmp_path: Path) -> None:
    model = load_model(written(tmp_path / "cubic.json", CUBIC), kinds=(*KINDS, POLYNOMIAL))
    assert isinstance(model, Polynomial)
    motion = motion_of(run("none", 2, seed=1))
    assert np.allclose(simulate_run(model, run("none", 2, seed=1)), 1000.0 * motion.v - 200.0 * motion.v**3)
    broken = written(tmp_path / "broken.json", {key: value for key, value in CUBIC.items() if key != "coefficients"})
    with pytest.raises(ModelFileError, match=r"broken\.json: coefficients is missing: give"):
        load_model(broken, kinds=(*KINDS, POLYNOMIAL))


@pytest.mark.parametrize("model", [VISCOUS, AS_SIMULATED, Polynomial(name="p", coefficients=(1.0,), trained_m_s=1.0)])
def test_every_kind_says_what_it_is_and_what_it_needs(model: SimulationModel) -> None:
    low, high = model.bounds()
    values = model.values()
    assert len(model.names()) == values.size == low.size == high.size == model.free().size
    assert np.all((low <= values) & (values <= high))
    assert "displacement" in model.inputs
    motion = motion_of(run("none", 2, seed=1))
    force = model.force(motion)
    assert force.shape == motion.x.shape
    assert force.dtype == np.float64


def test_a_physical_model_is_simulated_to_the_bit_as_the_solver_does() -> None:
    measured = run("none", 1, seed=4)
    assert np.array_equal(simulate_run(AS_SIMULATED, measured), simulate(AS_SIMULATED, motion_of(measured)).force)


def test_the_loader_gives_back_what_was_written(tmp_path: Path) -> None:
    write_model(tmp_path / "m.json", AS_SIMULATED)
    assert load_model(tmp_path / "m.json") == read_model(tmp_path / "m.json") == AS_SIMULATED


PHYSICAL = model_to_json(VISCOUS)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            {**PHYSICAL, "kind": "magic"},
            "kind is 'magic': this program reads 'physical' or 'nnoe' or .* is a file .fmu",
        ),
        ({**PHYSICAL, "kind": ["physical"]}, r"kind is \['physical'\]"),
        ({k: v for k, v in PHYSICAL.items() if k != "kind"}, "kind is None"),
        ({**PHYSICAL, "kind": "fmu"}, "kind is 'fmu': .* is a file .fmu"),
        ({**PHYSICAL, "format": "x"}, "format is 'x'"),
        ({**PHYSICAL, "format_version": 9}, "format_version is 9"),
        ({**PHYSICAL, "name": 3}, "name is 3: it must be text"),
        ([1], "a model is an object, this is a list"),
        ({**PHYSICAL, "paths": {"core": []}}, "core is empty"),
    ],
)
def test_a_file_that_is_no_model_is_refused_in_one_line_that_names_it(content: Any, words: str, tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=rf"m\.json: {words}") as caught:
        load_model(written(tmp_path / "m.json", content))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"), [(b"\xff\xfe", "not UTF-8"), (b"{", "line 1, column 2: no JSON"), (b"[" * 100_000, "no JSON")]
)
def test_bytes_that_are_no_json_are_refused_in_one_line(content: bytes, words: str, tmp_path: Path) -> None:
    (tmp_path / "m.json").write_bytes(content)
    with pytest.raises(ModelFileError, match=rf"m\.json: .*{words}") as caught:
        load_model(tmp_path / "m.json")
    assert "\n" not in str(caught.value)


def test_a_kind_that_cannot_be_used_is_refused_before_its_file_is_opened(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r"absent\.fmu: kind is 'fmu': here a model of kind 'physical' is needed"):
        load_model(tmp_path / "absent.fmu", only=("physical",))
    with pytest.raises(ModelFileError, match="kind is 'polynomial': here a model of kind 'physical'"):
        load_model(written(tmp_path / "c.json", CUBIC), only=("physical",), kinds=(*KINDS, POLYNOMIAL))


def test_a_model_file_that_cannot_be_written_is_an_error_of_its_own_and_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r"absent.m\.json: cannot be written .*: give a place"):
        write_model(tmp_path / "absent" / "m.json", VISCOUS)
    assert list(tmp_path.iterdir()) == []
    assert issubclass(ModelFileError, ModelError)


def test_a_choice_names_channels_of_a_run() -> None:
    with pytest.raises(ModelError, match="'pressure': a run drives displacement"):
        Choice(inputs={"pressure": "p"})


def test_a_run_without_what_a_model_needs_is_refused_with_the_element_that_needs_it() -> None:
    measured = run("none", 2, seed=1)
    channels = {name: row for name, row in measured.channels.items() if name != "current"}
    with pytest.raises(DataError, match="none-1-2 has no control current, which 'valve_damping' needs"):
        simulate_run(AS_SIMULATED, replace(measured, channels=channels))
    channels = {name: row for name, row in measured.channels.items() if name != "displacement"}
    with pytest.raises(DataError, match="no channel 'displacement'"):
        simulate_run(VISCOUS, replace(measured, channels=channels))


def test_a_simulation_that_fails_names_the_run() -> None:
    huge = Model(
        name="huge", elements=(element("cubic_stiffness", {"k3": 1e308}), element("viscous_damping", {"c": 1}))
    )
    measured = run("none", 2, seed=1)
    channels = {**measured.channels, "displacement": 1e6 * measured.channels["displacement"]}
    with np.errstate(over="ignore", invalid="ignore"), pytest.raises(SimulationError, match="none-1-2: 'huge' gives"):
        simulate_run(huge, replace(measured, channels=channels))


def test_a_model_without_named_elements_is_explained_as_a_foreign_simulation() -> None:
    measured = [run("none", 2, seed=1)]
    assert as_base(VISCOUS, measured) == (VISCOUS, measured)
    cubic = Polynomial(name="c", coefficients=(0.0, 900.0), trained_m_s=1.0)
    told: list[str] = []
    base, driven = as_base(cubic, measured, on_progress=lambda done, text: told.append(text))
    assert base is None
    assert np.array_equal(driven[0].channels["force_simulated"], simulate_run(cubic, measured[0]))
    assert told == ["c on none-1-2"]
    assert with_simulation(cubic, []) == []


def sine(n: int = 2000, frequency_hz: float = 2.0) -> np.ndarray:
    return 0.01 * np.sin(2 * np.pi * frequency_hz * np.arange(n) / 1000.0)


def test_a_motion_that_repeats_is_differentiated_exactly() -> None:
    motion = motion_from(sine(), 1000.0, period=500)
    w = 4 * np.pi
    assert np.allclose(motion.v, 0.01 * w * np.cos(w * motion.t), atol=1e-12)
    assert np.allclose(motion.a, -0.01 * w**2 * np.sin(w * motion.t), atol=1e-10)
    assert (motion.period, motion.settle, motion.dt) == (500, 0, 1e-3)
    one = motion_from(sine(500), 1000.0, period=500)
    assert np.allclose(one.v, motion.v[:500], atol=1e-12)


def test_a_motion_from_a_run_without_noise_is_that_of_the_run() -> None:
    measured = run("none", 2, seed=1)
    clean = replace(measured, channels={**measured.channels, "displacement": sine(measured.samples)})
    found, made = motion_of(clean), motion_from(sine(measured.samples), 1000.0, period=500)
    for series in ("x", "v", "a", "t"):
        assert np.allclose(getattr(found, series), getattr(made, series), rtol=0, atol=1e-10), series


def test_given_derivatives_are_taken_as_they_are() -> None:
    v = np.cos(np.arange(100) / 10)
    motion = motion_from(np.zeros(100), 10.0, velocity=v, current=0.5, temperature=np.full(100, 40.0))
    assert np.array_equal(motion.v, v)
    assert np.allclose(motion.a[1:-1], (v[2:] - v[:-2]) * 5.0)
    assert np.all(motion.i == 0.5)
    assert np.all(motion.temperature == 40.0)
    a = np.ones(100)
    assert np.array_equal(motion_from(np.zeros(100), 10.0, velocity=v, acceleration=a).a, a)


def test_a_motion_does_not_hold_the_callers_array() -> None:
    x = sine()
    motion = motion_from(x, 1000.0, velocity=np.zeros(2000))
    x[0] = 1.0
    assert motion.x[0] == 0.0


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"sample_rate_hz": 0.0}, "sample rate is 0 Hz"),
        ({"sample_rate_hz": float("nan")}, "sample rate is nan Hz"),
        ({"displacement": [0.0]}, "at least 2 samples"),
        ({"displacement": np.zeros((2, 3))}, r"displacement has the shape \(2, 3\)"),
        ({"displacement": ["a", "b"]}, "displacement has a value that is not a number"),
        ({"displacement": np.where(np.arange(2000) == 7, np.nan, 0.0)}, "displacement is nan at sample 7"),
        ({"velocity": np.zeros(3)}, "velocity has 3 samples, the displacement 2000"),
        ({"current": np.full(2000, np.inf)}, "current is inf at sample 0"),
        ({"temperature": float("nan")}, "temperature is nan at sample 0"),
        ({"period": 3}, r"period is 3 samples: it must be 0, or lie within \[8, 2000\]"),
        ({"period": 300}, "displacement has 2000 samples: not a whole number of periods of 300"),
        ({"period": 400}, "displacement does not repeat after 400 samples"),
        ({"period": 500, "settle": 4}, "settle is 4"),
        ({"period": 500, "settle": -1}, "settle is -1"),
        ({"period": 500, "current": np.arange(2000.0)}, "current does not repeat"),
        ({"settle": 1}, "settle is 1"),
    ],
)
def test_a_motion_that_cannot_be_is_refused_in_one_line(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(DataError, match=words) as caught:
        motion_from(**({"displacement": sine(), "sample_rate_hz": 1000.0} | changed))
    assert "\n" not in str(caught.value)


@given(low=st.floats(-1, 0.9), width=st.floats(0.01, 2), level=st.floats(-3, 3))
def test_a_training_range_is_left_by_what_lies_outside_and_by_nothing_else(
    low: float, width: float, level: float
) -> None:
    motion = motion_from(np.zeros(10), 10.0, velocity=np.full(10, level))
    left = TrainingRange({"velocity": (low, low + width)}).left(motion)
    assert left == ({} if low <= level <= low + width else {"velocity": 1.0})


@pytest.mark.parametrize("limits", [{"pressure": (0.0, 1.0)}, {"velocity": (1.0, 1.0)}, {"velocity": (0.0, np.inf)}])
def test_a_training_range_that_is_none_is_refused(limits: dict[str, tuple[float, float]]) -> None:
    with pytest.raises(ModelError, match="training range of"):
        TrainingRange(limits)


def test_a_sentence_says_by_how_much_a_range_is_left_with_its_unit_also_where_it_is_little() -> None:
    motion = motion_from(np.zeros(1000), 100.0, current=np.where(np.arange(1000) == 300, 0.9 + 2e-6, 0.5))
    said = TrainingRange({"current": (0.1, 0.9), "velocity": (-1.0, 1.0)}).described(motion)
    assert said == [
        "current leaves the training range [0.1, 0.9] A in 0.1 % of the samples, first at 3 s, farthest at 3 s with "
        "0.9 A, 2e-06 A beyond"
    ]
    whole = TrainingRange({"temperature": (40.0, 60.0)}).described(motion)
    assert "[40, 60] °C in 100 % of the samples, first at 0 s" in whole[0]
    assert whole[0].endswith("with 25 °C, 15 °C beyond")


def test_a_sample_that_is_no_number_hides_none_that_leaves_the_range() -> None:
    current = np.where(np.arange(1000) == 300, 2.0, 0.5)
    motion = replace(motion_from(np.zeros(1000), 100.0), i=np.where(np.arange(1000) == 100, np.nan, current))
    assert "farthest at 3 s with 2 A, 1.1 A beyond" in TrainingRange({"current": (0.1, 0.9)}).described(motion)[0]


def test_the_model_of_a_motion_needs_no_run() -> None:
    motion: Motion = motion_from(sine(), 1000.0, period=500)
    assert np.allclose(VISCOUS.force(motion), 1000.0 * motion.v)
