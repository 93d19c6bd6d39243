"""First models: of a family, at the force that was asked for, and of a sheet."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from identification.errors import ModelError
from identification.models.simulation import SIMULATED, with_simulation
from identification.physical.elements.families import FAMILIES
from identification.physical.model import Model
from identification.physical.new_model import model_of_family, model_of_sheet
from identification.sheet import sheet_of, sheet_to_json
from identification.steady import steady_cycles
from rigctl.runfile import Run, with_channel
from tests.identification.sines import Law, sine_run

FORCE, SPEED, CURRENT = 2500.0, 0.5, (0.2, 1.4)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_has_its_peak_force_at_the_velocity_that_was_given(family: str) -> None:
    run = sine_run(lambda x, v: v, 0.02, SPEED / (2 * np.pi * 0.02))
    run = with_channel(run, "current", np.full(run.samples, CURRENT[1]), "A")
    [simulated] = with_simulation(model_of_family(family, FORCE, SPEED, CURRENT), [run])
    cycles = steady_cycles(simulated, SIMULATED)
    assert cycles is not None
    assert cycles.loop()[2].max() == pytest.approx(FORCE, rel=0.12)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("spring", 1.0, 1.0, None), "family is 'spring'"),
        (("linear", 0.0, 1.0, None), "force is 0 N"),
        (("linear", 1.0, float("nan"), None), "speed is nan m/s"),
        (("mr", 1.0, 1.0, None), "give its currents"),
        (("mr", 1.0, 1.0, (1.0, 1.0)), "it must rise"),
    ],
)
def test_what_cannot_be_a_damper_is_refused(given: tuple[str, float, float, None], said: str) -> None:
    with pytest.raises(ModelError, match=said):
        model_of_family(*given)


def through(law: Law, current: float | None = None) -> list[Run]:
    runs = []
    for speed in (0.01, 0.02, 0.05, 0.1, 0.2, 0.4):
        run = sine_run(law, 0.02, speed / (2 * np.pi * 0.02), noise=2.0)
        if current is not None:
            run = with_channel(run, "current", np.full(run.samples, current), "A")
        runs.append(replace(run, run_id=f"{speed} at {current}"))
    return runs


def left(runs: list[Run], model: Model) -> float:
    """The share of the force that a model leaves."""
    found = with_simulation(model, runs)
    rest = np.concatenate([one.channels["force"] - one.channels[SIMULATED] for one in found])
    force = np.concatenate([one.channels["force"] for one in found])
    return float(np.sqrt(np.mean(rest**2) / np.mean(force**2)))


def test_a_model_of_a_sheet_is_near_the_damper_before_any_fit() -> None:
    runs = through(
        lambda x, v: np.where(v > 0, 900, 300) * np.arctan(v / 0.15) + 60 * np.tanh(v / 1e-3) + 2e3 * x + 150
    )
    assert left(runs, model_of_sheet(sheet_to_json(sheet_of(runs)))) < 0.1


def test_a_model_of_a_sheet_with_several_currents_follows_the_current() -> None:
    runs = [
        run
        for i in (0.0, 0.5, 1.0)
        for run in through(lambda x, v, i=i: (100 + 700 * i) * np.tanh(v / 5e-3) + (500 + 400 * i) * v, i)  # type: ignore[misc]
    ]
    assert left(runs, model_of_sheet(sheet_to_json(sheet_of(runs)))) < 0.2


@pytest.mark.parametrize("broken", [{}, {"format": "damper-rig/sheet"},
    {"format": "damper-rig/sheet", "tests": [], "currents": []}])  # fmt: skip
def test_what_is_no_sheet_is_refused(broken: dict[str, object]) -> None:
    with pytest.raises(ModelError, match="sheet"):
        model_of_sheet(broken)


def test_the_command_writes_what_fit_reads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = str(tmp_path / "front.json")
    assert main(["model", "new", "mr", "--force", "2000", "--velocity", "0.4", "--current", "0", "1", "-o", made]) == 0
    assert json.loads(Path(made).read_text())["kind"] == "physical"
    assert "2000 N at 0.4 m/s" in capsys.readouterr().out
    runs = through(lambda x, v: 900 * np.arctan(v / 0.15))
    (tmp_path / "sheet.json").write_text(json.dumps(sheet_to_json(sheet_of(runs))))
    assert main(["model", "new", "--sheet", str(tmp_path / "sheet.json"), "-o", made, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["file"] == made


@pytest.mark.parametrize(
    ("given", "said"), [(["linear", "--force", "1"], "--velocity"), ([], "FAMILY"), (["linear", "--sheet", "s"], "or")]
)
def test_a_family_without_its_figures_is_refused(
    given: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["model", "new", *given]) == 2
    assert said in capsys.readouterr().err
