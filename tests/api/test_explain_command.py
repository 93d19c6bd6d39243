"""What `damper-rig explain` says of the runs that it is given."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from identification.datachecks import findings_in
from identification.physical.modelfile import write_model
from rigctl.runfile import read_run, with_channel, write_run
from tests.identification.specimens import AS_SIMULATED, run


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two runs, one clipped and one that drifts, which somebody's simulation meets: nothing is missing."""
    drifting, clipped = run("none", 2, 3), run("none", 0, 3)
    force = drifting.channels["force"] + np.linspace(0.0, 90.0, drifting.samples)
    top = np.minimum(clipped.channels["force"], 0.7 * clipped.channels["force"].max())
    for name, one, values in (("drifting", drifting, force), ("clipped", clipped, top)):
        changed = replace(one, channels={**one.channels, "force": values})
        write_run(tmp_path / f"{name}.h5", with_channel(changed, "force_simulated", values, "N"))
    write_model(tmp_path / "model.json", AS_SIMULATED)
    return tmp_path


def test_explain_says_what_the_data_checks_saw_in_the_words_of_fit_and_in_the_report(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    runs = ["drifting.h5", "clipped.h5"]
    due = findings_in([read_run(path) for path in runs])
    assert len(due) >= 2
    assert main(["fit", "model.json", *runs, "-o", "fitted.json"]) == 0
    of_fit = capsys.readouterr().err
    assert main(["explain", "--simulated", runs[0], "--held-out", runs[1], "-o", "report"]) == 0
    assert capsys.readouterr().err == of_fit == "".join(f"damper-rig: {line}\n" for line in due)
    assert set(due) <= set(json.loads(Path("report/report.json").read_text())["notes"])
    assert due[0].split(": ", 2)[2] in Path("report/report.html").read_text(encoding="utf-8")


def test_where_the_base_explains_all_no_optimiser_filter_or_distribution_of_scipy_is_loaded(tmp_path: Path) -> None:
    for index in (0, 1, 5):
        write_run(tmp_path / f"{index}.h5", run("none", index, 3))
    write_model(tmp_path / "model.json", AS_SIMULATED)
    absent = {"scipy.optimize", "scipy.ndimage", "scipy.special", "scipy.signal", "scipy.stats", "scipy.spatial"}
    command = ["explain", "model.json", "0.h5", "1.h5", "--held-out", "5.h5", "-o", "report"]
    code = f"import sys; from api.cli.main import main; main({command}); print(sorted({absent} & sys.modules.keys()))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert said.stdout.startswith("verdict: no discrepancy")
    assert said.stdout.splitlines()[-1] == "[]"
