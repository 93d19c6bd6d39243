"""A command that refuses says so in one line: what it found about the data before is not printed too."""

from __future__ import annotations

from pathlib import Path

import pytest

from api.cli.main import main
from identification.physical.model import Model, element
from identification.physical.modelfile import write_model
from rigctl.runfile import with_channel, write_run
from tests.identification.hysteretic import hysteretic


@pytest.mark.parametrize(
    "command", ["fit model.json run.h5 -o fitted.json --starts 0", "characterise run.h5 -o sheet.html"]
)
def test_a_refusal_is_one_line_also_where_the_data_have_findings(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    run = hysteretic(1, 800)
    write_run(tmp_path / "run.h5", with_channel(run, "force", -run.channels["force"], "N"))  # a finding: its sign
    write_model(tmp_path / "model.json", Model(name="m", elements=(element("viscous_damping", {"c": 300.0}),)))
    assert main(command.split()) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "reversed" not in line
