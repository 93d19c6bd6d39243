"""What holds for every design, whatever its kind: limits, rest, repetition, files and scaling."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.envelope import check, excesses, scale_to_fit
from excitation.files import read_excitation, read_plan, write_excitation, write_plan
from excitation.kinds import DESIGNED
from excitation.motion import motion
from excitation.plan import Test, TestPlan
from excitation.signal import Excitation
from excitation.synthesis import SPECS, excitation_from_config
from tests.excitation.generators import CONFIGS, file_config, replay_config, rig_of

OF_FILES = {"replay": replay_config, "file": file_config}

EVERY = pytest.mark.parametrize("name", [*CONFIGS, *OF_FILES])


@pytest.fixture(scope="module")
def of_files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return {name: make(tmp_path_factory.mktemp("records")) for name, make in OF_FILES.items()}


@pytest.fixture
def excitation(name: str, of_files: dict[str, Any]) -> Excitation:
    return excitation_from_config({**CONFIGS, **of_files}[name])


def test_every_kind_that_can_be_designed_is_here() -> None:
    assert {*OF_FILES, *(config["kind"] for config in CONFIGS.values())} == set(DESIGNED) == set(SPECS)


@EVERY
def test_motion_rate_and_current_keep_within_the_limits(name: str, excitation: Excitation) -> None:
    check(Test(name=name, excitation=excitation), rig_of())
    assert np.abs(excitation.displacement_m).max() <= 0.02
    assert np.abs(excitation.velocity_m_s).max() <= 0.4 * (1 + 1e-9)
    assert np.abs(excitation.acceleration_m_s2).max() <= 30.0 * (1 + 1e-9)


@EVERY
def test_it_repeats_about_the_middle_or_begins_and_ends_there_at_rest(name: str, excitation: Excitation) -> None:
    x, period = excitation.displacement_m, excitation.period_samples
    steps = np.abs(np.diff(x)).max()
    if period:
        assert np.array_equal(x[: x.size - period], x[period:])
        assert abs(x[-period:].mean()) <= 1e-12
        assert abs(x[-1] - x[-period]) <= steps * (1 + 1e-9)
    elif excitation.kind == "steps":
        assert x[0] == 0.0
        assert abs(x[-1]) <= steps * (1 + 1e-9)
    else:
        assert (x[0], x[-1]) == (0.0, 0.0)
        assert abs(x[1]) + abs(x[-2]) <= 1e-3 * np.abs(x).max()


@EVERY
def test_its_design_makes_the_same_bytes_again(name: str, excitation: Excitation) -> None:
    again = excitation_from_config(excitation.design)
    assert again.displacement_m.tobytes() == excitation.displacement_m.tobytes()
    assert again.design == excitation.design
    if excitation.current_a is not None and again.current_a is not None:
        assert again.current_a.tobytes() == excitation.current_a.tobytes()


@EVERY
def test_it_goes_through_every_file(name: str, excitation: Excitation, tmp_path: Path) -> None:
    for ending in (".h5", ".csv", ".mat", ".drv"):
        write_excitation(tmp_path / f"x{ending}", excitation)
        back = read_excitation(tmp_path / f"x{ending}")
        tolerance = np.abs(excitation.displacement_m).max() / 60_000 if name in OF_FILES and ending == ".drv" else 0.0
        np.testing.assert_allclose(back.displacement_m, excitation.displacement_m, rtol=0.0, atol=tolerance)
        assert (back.kind, back.period_samples, back.design) == (
            excitation.kind,
            excitation.period_samples,
            excitation.design,
        )
    for ending in (".toml", ".csv", ".h5"):
        plan = TestPlan(tests=(Test(name=name, excitation=excitation, dwell_s=2.0),))
        write_plan(tmp_path / f"plan{ending}", plan)
        [test] = read_plan(tmp_path / f"plan{ending}").tests
        assert test.excitation.displacement_m.tobytes() == excitation.displacement_m.tobytes(), ending


@EVERY
def test_a_rig_of_half_its_size_plays_it_scaled(name: str, excitation: Excitation) -> None:
    small = rig_of(0.4)
    fitted = scale_to_fit(Test(name=name, excitation=excitation), small).excitation
    assert not excesses(fitted, small)
    smaller = np.abs(fitted.displacement_m).max() < np.abs(excitation.displacement_m).max()
    assert smaller == bool(excesses(excitation, small))


@EVERY
def test_its_lines_reach_as_high_as_is_said(name: str, excitation: Excitation) -> None:
    if name == "triangle":
        return  # all harmonics
    moved = motion(excitation)
    amplitude = np.abs(np.fft.rfft(moved.displacement_m))
    highest = np.flatnonzero(amplitude > 1e-3 * amplitude.max())[-1] * 500.0 / moved.displacement_m.size
    assert highest <= 25.0
