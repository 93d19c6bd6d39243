"""Every command refuses a hostile file in one line, with status 2, and writes nothing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from api.cli.main import main
from tests.hostile_files import HOSTILE

COMMANDS = {
    "fit": ["fit", "MODEL", "FILE", "-o", "OUT.json"],
    "simulate": ["simulate", "MODEL", "FILE", "-o", "OUT.h5"],
    "score": ["score", "FILE"],
    "compare": ["compare", "MODEL", "MODEL", "--runs", "FILE", "-o", "OUT.html"],
    "explain": ["explain", "MODEL", "FILE", "-o", "OUT"],
    "analyse": ["analyse", "FILE", "-o", "OUT.html"],
    "characterise": ["characterise", "FILE", "-o", "OUT.html"],
    "study explore": ["study", "explore", "MODEL", "FILE", "-o", "OUT.html"],
    "study sensitivity": ["study", "sensitivity", "MODEL", "--at", "FILE", "-o", "OUT.html"],
    "convert": ["convert", "FILE", "-o", "OUT.csv"],
    "align": ["align", "FILE", "FILE", "--take", "a=force", "--trigger", "0.1", "-o", "OUT.h5"],
    "run": ["run", "FILE", "--rig", "modbus://127.0.0.1:9", "-o", "OUT"],
    "iterate": ["iterate", "FILE", "--rig", "modbus://127.0.0.1:9", "-o", "OUT"],
    "report": ["report", "FOLDER"],
}
MODEL = {
    "format": "damper-rig/model",
    "format_version": 1,
    "name": "m",
    "kind": "physical",
    "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]},
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_refuses_a_file_whose_data_are_in_another_file(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write, expected = HOSTILE["external storage"]
    write(tmp_path / "bad.h5")
    (tmp_path / "model.json").write_text(json.dumps(MODEL))
    folder = tmp_path / "report"
    folder.mkdir()
    (folder / "evidence.h5").write_bytes((tmp_path / "bad.h5").read_bytes())
    words = {"FILE": tmp_path / "bad.h5", "MODEL": tmp_path / "model.json", "FOLDER": folder}
    arguments = [str(words.get(one, one)).replace("OUT", str(tmp_path / "out")) for one in COMMANDS[command]]
    status, said = main(arguments), capsys.readouterr().err
    assert status == 2, said
    assert said.count("\n") == 1
    if command != "report":  # it reads report.json first, which is not there
        assert expected in said
    assert not list(tmp_path.glob("out*"))


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_file_is_refused_at_the_command_line(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write, expected = HOSTILE[kind]
    write(tmp_path / "bad.h5")
    file, out = str(tmp_path / "bad.h5"), str(tmp_path / "out")
    for command in (["score", file], ["run", file, "--rig", "modbus://127.0.0.1:9", "-o", out]):
        status, said = main(command), capsys.readouterr().err
        assert (status, said.count("\n")) == (2, 1), said
        assert expected in said


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("[" * 100_000 + "]" * 100_000, "nested"),
        ('{"format": ' * 500 + "1" + "}" * 500, "nested"),
        ('{"format": 1' + "0" * 400 + "}", "digits"),
        ('{"format": 1e400}', "beyond"),
        ('{"format": NaN}', "NaN"),
        ('{"format": "\\ud800"}', "surrogate"),
    ],
    ids=["deep lists", "deep objects", "10^400", "1e400", "NaN", "half a character"],
)
def test_a_model_file_of_strange_json_is_refused(
    text: str, word: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "model.json").write_text(text)
    status = main(["compare", str(tmp_path / "model.json"), "--runs", "a.h5", "-o", str(tmp_path / "out.html")])
    said = capsys.readouterr().err
    assert (status, said.count("\n")) == (2, 1)
    assert word in said


def test_a_matlab_file_that_unpacks_to_far_more_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bomb.mat"
    savemat(path, {"run": np.zeros(1 << 24)}, do_compression=True)  # 128 MB in 130 kB
    for command in (
        ["convert", str(path), "-o", str(tmp_path / "out.h5")],
        ["run", str(path), "--rig", "modbus://127.0.0.1:9", "-o", str(tmp_path / "out")],
    ):
        status, said = main(command), capsys.readouterr().err
        assert (status, said.count("\n")) == (2, 1), said
        assert "unpacks to more than" in said
