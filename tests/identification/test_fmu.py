"""Somebody else's simulation as an FMU: a real one, compiled here."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from pythonfmu3 import FmuBuilder

from api.cli.main import main
from identification.discrepancy import explain
from identification.errors import DataError, ModelError, SimulationError
from identification.fmu import Choice, Patience, open_fmu, with_fmu
from identification.fmu_process.wiring import Variable, wired
from identification.models import simulate_run
from identification.physical.model import Model, element
from identification.physical.modelfile import write_model
from rigctl.runfile import Run, read_run, write_run
from tests.identification.packed_fmu import compiled, packed


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(tmp_path_factory.mktemp("built"))


@pytest.fixture(scope="module")
def fmu(library: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return packed(tmp_path_factory.mktemp("fmu") / "damper.fmu", library)


def a_run(k: int, frequency_hz: float, *, friction_n: float = 30.0, lag_s: float = 0.0, samples: int = 2000) -> Run:
    """The damper of the FMU with another rate, and with dry friction; current in steps."""
    t = np.arange(samples) / 1000.0
    phase = 2 * np.pi * frequency_hz * t
    v = 0.02 * 2 * np.pi * frequency_hz * np.cos(phase)
    current = 0.5 + 0.5 * (np.floor(t / 0.25) % 2)
    if lag_s:  # of first order on the viscous force, in steady state
        shift = np.arctan(2 * np.pi * frequency_hz * lag_s)
        delayed = 0.02 * 2 * np.pi * frequency_hz * np.cos(shift) * np.cos(phase - shift)
    else:
        delayed = v
    force = 650.0 * delayed + friction_n * np.tanh(v / 0.004) + np.random.default_rng(k).normal(0, 0.5, t.size)
    return Run(
        run_id=f"run {k}",
        created="2026-11-21T00:00:00+00:00",
        specimen="damper 7",
        sample_rate_hz=1000.0,
        period_samples=round(1000 / frequency_hz),
        excitation_kind="sine",
        status="complete",
        channels={"displacement": 0.02 * np.sin(phase), "force": force, "current": current},
        units={"displacement": "m", "force": "N", "current": "A"},
    )


def test_an_fmu_answers_in_its_own_units_and_without_a_lag_of_its_coupling(fmu: Path) -> None:
    plain, lagging = (a_run(1, 2.0, friction_n=0.0, lag_s=lag) for lag in (0.0, 0.01))
    [along] = with_fmu(fmu, [plain])
    assert along.units["force_simulated"] == "N"
    error = along.channels["force_simulated"] - plain.channels["force"]
    assert np.std(error) == pytest.approx(0.5, rel=0.1)  # nothing but the noise
    [along] = with_fmu(fmu, [lagging], Choice(parameters={"lag": "0.01"}))
    error = (along.channels["force_simulated"] - lagging.channels["force"])[500:]
    assert np.std(error) < 0.56  # half a step of coupling, 0.125 ms, beside a lag of 10 ms and the noise
    wired_to_current = Choice(parameters={"c": "0", "c_i": "100"})
    [along] = with_fmu(fmu, [plain], wired_to_current)
    v = 0.02 * 4 * np.pi * np.cos(4 * np.pi * np.arange(2000) / 1000.0)
    assert np.allclose(along.channels["force_simulated"], 100.0 * plain.channels["current"] * v, atol=0.02)


CO_SIMULATION = """
from pythonfmu3 import Fmi3Causality as C, Fmi3Slave, Fmi3Variability as V, Float64
class Three(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time = self.v = self.F = 0.0
        self.register_variable(Float64("time", causality=C.independent, variability=V.continuous))
        self.register_variable(Float64("v", causality=C.input, variability=V.continuous, start=0.0))
        self.register_variable(Float64("F", causality=C.output, variability=V.continuous))
    def exit_initialization_mode(self):
        self.F = 650.0 * self.v
    def do_step(self, t, dt):
        self.F = 650.0 * self.v
        return True
"""
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


@pytest.mark.parametrize(("source", "lag_s"), [(CO_SIMULATION, 0.0), (MODEL_EXCHANGE, 0.01)])
def test_an_fmu_of_version_3_and_one_for_model_exchange_run_too(source: str, lag_s: float, tmp_path: Path) -> None:
    (tmp_path / "three.py").write_text(source)
    FmuBuilder.build_FMU(tmp_path / "three.py", dest=tmp_path)
    run = a_run(1, 4.0, friction_n=0.0, lag_s=lag_s, samples=750)
    [along] = with_fmu(tmp_path / "Three.fmu", [run])
    error = (along.channels["force_simulated"] - run.channels["force"])[250:]
    assert np.std(error) < 1.2  # a fifth of a sample at 4 Hz is 1 N of 230 N, beside the noise of 0.5 N


def test_an_effect_is_named_on_top_of_an_fmu_and_what_is_inside_it_is_out_of_reach(
    fmu: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = []
    for k, frequency in enumerate((1.0, 2.0, 4.0, 2.5)):
        paths.append(tmp_path / f"run{k}.h5")
        write_run(paths[-1], a_run(k, frequency))
    given = [str(fmu), *map(str, paths[:3]), "--held-out", str(paths[3]), "-o", str(tmp_path / "report"), "--json"]
    assert main(["explain", *given]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [(e["element"], e["path"]) for e in report["effects"]] == [("coulomb_friction", "core")]
    assert report["gap"]["held_out"]["closed"] > 0.95
    assert any("out of reach" in note for note in report["notes"])


def test_an_fmu_that_meets_the_data_leaves_no_discrepancy(fmu: Path) -> None:
    runs = with_fmu(fmu, [a_run(k, f, friction_n=0.0) for k, f in enumerate((1.0, 2.0, 4.0))])
    assert explain(None, runs).effects == ()


@pytest.mark.slow
def test_an_fmu_is_compared_with_a_physical_model(
    fmu: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_run(Path("run.h5"), a_run(1, 2.0, friction_n=0.0))
    write_model("own.json", Model(name="own", elements=(element("viscous_damping", {"c": 600.0}),)))
    given = ["compare", "own.json", str(fmu), "--runs", "run.h5", "-o", "page.html", "--json"]
    assert main(given) == 0
    own, foreign = json.loads(capsys.readouterr().out)["models"]
    assert (foreign["kind"], foreign["parameters"], foreign["training_range"]) == ("fmu", None, "not stated")
    assert foreign["rms"] == pytest.approx(0.5, rel=0.1)
    assert own["rms"] > 5.0
    assert foreign["cost_ns_per_sample"] > own["cost_ns_per_sample"]
    assert main([*given, "--fmu-set", "fails_at=0.5", "--fmu-set", "how=0"]) == 0
    failed = json.loads(capsys.readouterr().out)["models"][1]
    assert failed["rms"] is None
    assert "fails at t = 0.5" in failed["runs"][0]["failure"]
    assert main(["simulate", str(fmu), "run.h5", "-o", "out.h5"]) == 0
    [along] = with_fmu(fmu, [a_run(1, 2.0, friction_n=0.0)])
    assert np.array_equal(read_run("out.h5").channels["force_simulated"], along.channels["force_simulated"])


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("0", ["run 1: damper.fmu fails at t = 0.5", "(it printed: the valve model has no solution)"]),
        ("1", ["run 1: damper.fmu gives a force of nan at t = 0.5"]),
        ("2", ["the FMU crashed"]),
    ],
)
def test_an_fmu_that_fails_is_said_to_fail_where_it_does(fmu: Path, how: str, words: list[str]) -> None:
    with pytest.raises(SimulationError) as caught:
        with_fmu(fmu, [a_run(1, 2.0)], Choice(parameters={"fails_at": "0.5", "how": how}))
    assert all(word in str(caught.value) for word in words), caught.value
    assert "\n" not in str(caught.value)


def test_an_fmu_that_never_comes_back_is_ended_when_its_time_is_up_and_starts_again(fmu: Path) -> None:
    choice = Choice(parameters={"fails_at": "0.5", "how": "3"})
    model, run = open_fmu(fmu, choice, patience=Patience(least_s=0.2, times=0.1)), a_run(1, 2.0)
    with pytest.raises(SimulationError, match=r"run 1: damper.fmu took more than 0.2 s: is it stuck\?"):
        simulate_run(model, run)
    brief = replace(run, channels={name: row[:400] for name, row in run.channels.items()})
    assert np.all(np.isfinite(simulate_run(replace(model, patience=Patience()), brief)))
    model.close()


def test_what_cannot_be_used_is_refused_in_one_line(
    fmu: Path, library: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run.h5"
    write_run(run, a_run(1, 2.0))
    torn = tmp_path / "torn.fmu"
    torn.write_bytes(b"PK no zip")
    foreign = packed(tmp_path / "foreign.fmu", library, platform="win32")
    cases = [
        ([str(torn)], "not an FMU"),
        ([str(tmp_path / "absent.fmu")], "absent.fmu"),
        ([str(foreign)], f"contains binaries for win32, this machine is {fmpy.platform}"),
        ([str(fmu), "--fmu-input", "speed=rate"], "'speed': a run drives displacement"),
        ([str(fmu), "--fmu-set", "c"], "--fmu-set is 'c': write NAME=VALUE"),
        (["model.json", "--fmu-set", "c=1"], "ends in .fmu"),
        ([str(fmu), "--fmu-output=-axial"], "the sign of the simulated force is reversed"),
    ]
    for arguments, words in cases:
        assert main(["explain", arguments[0], str(run), *arguments[1:], "-o", str(tmp_path / "out")]) == 2, arguments
        said = capsys.readouterr().err
        assert words in said, (arguments, said)
        assert said.count("\n") == 1
    passive = a_run(1, 2.0)
    without = {name: row for name, row in passive.channels.items() if name != "current"}
    with pytest.raises(DataError, match=r"has no control current, which input 'coil' of damper\.fmu needs"):
        with_fmu(fmu, [replace(passive, channels=without)])
    assert not (tmp_path / "out").exists()


FORCE = Variable(name="F", unit="N", dimension=(1, 1, -2, 0, 0))
LENGTH = Variable(name="a1", unit="m", dimension=(0, 1, 0, 0, 0))


def test_variables_are_told_by_what_the_user_says_by_name_and_by_unit() -> None:
    inputs = [LENGTH, Variable(name="damper.v_rel"), Variable(name="plug")]
    choice = Choice(inputs={"current": "plug"}, force="-F")
    wiring = wired(inputs, [FORCE], ["a1", "damper.v_rel", "plug", "F"], choice)
    assert [wire.channel for wire in wiring.inputs] == ["displacement", "velocity", "current"]
    assert wiring.force.sign == -1.0


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        (Choice(force="a1"), r"'a1' is not an output of the FMU: it has F \(N\)"),
        (Choice(inputs={"velocity": "nothing"}), "no variable 'nothing': it has F, a1"),
        (Choice(parameters={"nothing": "1"}), "no variable 'nothing'"),
    ],
)
def test_a_name_that_the_fmu_does_not_have_is_refused(choice: Choice, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        wired([LENGTH], [FORCE], ["a1", "F"], choice)


@pytest.mark.parametrize(
    ("inputs", "outputs", "words"),
    [
        ([LENGTH], [], "no output is a force: it has none"),
        ([LENGTH], [LENGTH], "no output is a force: it has a1"),
        ([LENGTH], [replace(FORCE, name=n) for n in ("left", "right")], "more than one output is a force"),
        ([LENGTH, replace(LENGTH, name="a2")], [FORCE], r"input a1 \(m\) is not known"),
        ([Variable(name="x"), Variable(name="s")], [FORCE], "x and s both look like displacement"),
        ([Variable(name="i")], [FORCE], "no input is a displacement or a velocity"),
        ([LENGTH, Variable(name="p_ref", unit="bar")], [FORCE], r"input p_ref \(bar\) is not known"),
    ],
)
def test_variables_that_cannot_be_told_are_refused(inputs: list[Variable], outputs: list[Variable], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        wired(inputs, outputs, [v.name for v in (*inputs, *outputs)], Choice())
