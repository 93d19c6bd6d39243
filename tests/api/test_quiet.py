"""`damper-rig --quiet COMMAND`: the result, the errors, and nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from rigctl.runfile import write_run
from tests.identification.sines import sine_run


def test_quiet_leaves_the_findings_out_and_keeps_result_and_errors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, sheet = str(tmp_path / "run.h5"), str(tmp_path / "sheet.html")
    write_run(tmp_path / "run.h5", sine_run(lambda x, v: -900.0 * np.arctan(v / 0.05), 0.02, 1.0, noise=1.0))
    assert main(["characterise", run, "-o", sheet]) == 0
    loud = capsys.readouterr()
    assert "reversed" in loud.err
    assert main(["--quiet", "characterise", run, "-o", sheet]) == 0
    calm = capsys.readouterr()
    assert (calm.out, calm.err) == (loud.out, "")
    assert main(["-q", "characterise", "none.h5", "-o", sheet]) == 2
    assert "none.h5" in capsys.readouterr().err
    assert main(["characterise", run, "-o", sheet]) == 0
    assert capsys.readouterr().err == loud.err
