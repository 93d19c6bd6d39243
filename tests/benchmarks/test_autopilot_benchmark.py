"""A hidden specimen on a rig that plays any excitation, and the rig time that an autopilot saves on it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.explain.autopilot import both_ways, summary
from benchmarks.hidden import bench
from excitation.plan import test_from_config as the_test
from identification.fitting import fit
from identification.physical.modelfile import model_from_json


@pytest.mark.slow
def test_a_bench_measures_the_motion_that_was_asked_for_with_the_noise_of_its_case() -> None:
    one = bench(7001, "null")
    stroke = 0.5 * one.envelope.stroke_m
    config = {"name": "sine", "kind": "sine", "sample_rate": 1000.0, "amplitude": stroke, "frequency": 1.0, "cycles": 6}
    if one.envelope.current_a is not None:
        config["current"] = one.envelope.current_a[1]
    asked = the_test(config).excitation
    run, again = one.play(asked, 1), one.play(asked, 2)
    assert np.max(np.abs(run.channels["displacement"] - asked.displacement_m)) < 1e-3 * stroke
    apart = run.channels["force"][1000:] - again.channels["force"][1000:]
    assert np.std(apart) == pytest.approx(np.sqrt(2.0) * one.case.noise_n, rel=0.15)
    found = fit(model_from_json(one.case.base_model), [*one.case.runs, run], refine=True)
    assert found.rms < 1.2 * one.case.noise_n


@pytest.mark.bench
def test_the_autopilot_is_sure_of_the_right_name_after_less_motion_than_the_plan() -> None:
    outcome = both_ways("single", 7503)
    assert outcome["autopilot"]["sure"]
    assert sorted(outcome["autopilot"]["names"]) == outcome["true"]
    assert outcome["autopilot"]["seconds"] < 0.5 * outcome["plan"]["seconds"]
    assert "of the plan's" in summary([outcome])
