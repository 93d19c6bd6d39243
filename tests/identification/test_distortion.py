"""What `explain` says of force and gap before any model: odd, even, noise."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.discrepancy import Explanation, explain, report_data, write_report
from identification.models import model_from_json
from identification.physical.model import Model
from identification.report import report_lines
from tests.identification.multisine_runs import multisine_run

VISCOUS = {
    "format": "damper-rig/model",
    "format_version": 1,
    "name": "viscous",
    "kind": "physical",
    "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 700.0}}]},
}


def viscous() -> Model:
    model = model_from_json(VISCOUS)
    assert isinstance(model, Model)
    return model


@pytest.fixture(scope="module")
def found() -> Explanation:
    """A viscous model of a damper with a soft friction and a one-sided damping."""
    return explain(viscous(), [multisine_run(k) for k in range(3)])


def test_the_parts_of_the_gap_are_the_gap(found: Explanation) -> None:
    assert found.distortion is not None
    whole = float(np.sqrt(sum(part**2 for part in found.distortion.gap.values())))
    both = float(np.sqrt((2 * found.train.base_refitted**2 + found.held_out.base_refitted**2) / 3))
    assert whole == pytest.approx(both, rel=0.03)


def test_friction_is_odd_and_a_one_sided_damping_is_even(found: Explanation) -> None:
    assert found.distortion is not None
    one_sided = [
        multisine_run(k).channels["force"] - multisine_run(k, one_sided=0.0).channels["force"] for k in range(3)
    ]
    even = float(np.sqrt(np.mean([np.var(part) for part in one_sided])))
    assert found.distortion.gap["even"] == pytest.approx(even, rel=0.05)
    assert found.distortion.force["even"] == pytest.approx(even, rel=0.05)
    assert found.distortion.gap["noise"] == pytest.approx(1.0, rel=0.1)
    assert found.distortion.gap["odd"] > 5.0 * found.distortion.gap["noise"]


def test_the_report_its_lines_and_its_page_say_it(found: Explanation, tmp_path: Path) -> None:
    data = report_data(found)
    assert json.loads(json.dumps(data, allow_nan=False))["distortion"]["text"] in "\n".join(report_lines(data))
    page = write_report(found, tmp_path / "report")
    assert "Before any model: force" in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_runs_that_tell_nothing_leave_it_out() -> None:
    runs = [replace(multisine_run(k, changes={"displacement": ALL_LINES}), run_id=f"all {k}") for k in range(2)]
    found = explain(viscous(), runs)
    assert found.distortion is None
    assert report_data(found)["distortion"] is None
    assert not any("before any model" in line for line in report_lines(report_data(found)))


ALL_LINES = {"f_min": 0.5, "f_max": 25.0, "lines": "all", "max_displacement": 0.02, "max_velocity": 0.5}
