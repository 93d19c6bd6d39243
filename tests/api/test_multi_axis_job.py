"""The job ``multi_axis`` designs what `damper-rig design multi-axis` designs."""

from __future__ import annotations

import io
import tomllib
from pathlib import Path

import h5py
import httpx
import numpy as np
import pytest

from api.cli.main import main
from tests.api.following import reached

EXAMPLE = Path("examples/multi_axis.toml")


def test_the_example_gives_the_samples_of_the_command_line(
    base: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    design = tomllib.loads(EXAMPLE.read_text())
    answer = httpx.post(f"{base}/v1/jobs", json={"kind": "multi_axis", "design": design}, timeout=120)
    assert answer.status_code == 201, answer.text
    job = reached(base, answer.headers["location"], lambda one: one["ended"] is not None, 300.0)
    assert (job["state"], job["name"]) == ("done", "multisines of stroke, sideways, tilt"), job
    assert main(["design", "multi-axis", str(EXAMPLE), "-o", str(tmp_path / "axes.h5")]) == 0
    assert "realisations 4" in capsys.readouterr().out
    sent = httpx.get(base + job["files"]["axes.h5"], timeout=60)
    assert sent.headers["content-type"] == "application/x-hdf5"
    with h5py.File(io.BytesIO(sent.content)) as theirs, h5py.File(tmp_path / "axes.h5") as ours:
        name = "realisation_3/channels/sideways_command"
        assert np.array_equal(theirs[name][()], ours[name][()])
        assert np.abs(ours[name][()]).max() <= 0.005
    assert job["result"] == {
        "axes": ["stroke", "sideways", "tilt"], "realisations": 4, "samples": 15000, "duration_s": 30.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"axes": []}, "axes has 0 entries"),
        ({"period_samples": 10**9}, "period_samples"),
        ({"matrix": "magic"}, "matrix"),
        ({"speed": 1}, "speed"),
        ({"sample_rate": 10.0}, "f_max"),
    ],
)
def test_a_design_that_is_wrong_is_refused_in_one_line(base: str, change: dict[str, object], said: str) -> None:
    design = tomllib.loads(EXAMPLE.read_text()) | change
    answer = httpx.post(f"{base}/v1/jobs", json={"kind": "multi_axis", "design": design}, timeout=120)
    assert answer.status_code == 422, answer.text
    assert said in answer.text
