"""The commands before a test, and what ``run`` is told: on a simulated rig in a process of its own."""

from __future__ import annotations

import io
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from api.cli.main import main
from api.cli.person import Terminal
from api.cli.preparation import setup_from
from rigctl.address import connect
from rigctl.errors import CalibrationExpired, Declined
from rigctl.runfile import read_run
from tests.api.rigs import a_sim


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with a_sim("modbus://127.0.0.1:0", "--speed", "50", "--specimen", "passive", "--hide", "force_offset") as rig:
        yield rig


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def records(path: Path, *, days: int) -> None:
    today = datetime.now(UTC).date()  # asked for each time: midnight may come between two tests
    path.write_text(
        f'[[sensors]]\nchannel = "force"\nserial = "LC-1"\ndate = {today - timedelta(days=400)}\n'
        f"expires = {today + timedelta(days=days)}\nscale = 1.01\n"
    )


PLAN = """
[[tests]]
name = "slow"
kind = "sine"
sample_rate = 1000.0
amplitude = 0.005
frequency = 4.0
cycles = 2
before = [{step = "tare", readings = 30}]

[[tests]]
name = "never"
kind = "sine"
sample_rate = 1000.0
amplitude = 0.005
frequency = 4.0
cycles = 2
before = [{step = "gate", of = "oil", min = 300.0}]
on_failure = "skip"
"""


def said(capsys: pytest.CaptureFixture[str]) -> tuple[Any, str]:
    """What was printed as JSON, and what was said on standard error. Any: JSON."""
    out, err = capsys.readouterr()
    return json.loads(out) if out.strip() else None, err


def test_calibration_records_are_listed_and_an_expired_one_is_status_1(capsys: pytest.CaptureFixture[str]) -> None:
    records(Path("good.toml"), days=0)
    records(Path("late.toml"), days=-1)
    assert main(["rig", "calibration", "good.toml", "--json"]) == 0
    assert not said(capsys)[0][0]["expired"]
    assert main(["rig", "calibration", "late.toml"]) == 1
    assert "serial LC-1): expired on" in capsys.readouterr().out
    assert main(["rig", "calibration", "absent.toml"]) == 2


def test_tare_jog_mount_and_remove_from_the_command_line(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rig", "tare", url, "-o", "tare.json", "--readings", "40", "--json"]) == 0
    tare, _ = said(capsys)
    assert tare == json.loads(Path("tare.json").read_text())
    assert tare["uncertainty_n"] < 10
    assert main(["rig", "tare", url, "--limit", "1e-3"]) == 1
    assert "detach the specimen" in said(capsys)[1]
    assert main(["rig", "jog", url, "--to", "0.004", "--json"]) == 0
    assert said(capsys)[0]["displacement_m"] == pytest.approx(0.004, abs=1e-4)
    assert main(["rig", "jog", url]) == 2
    assert "--to or --by" in said(capsys)[1]
    assert main(["rig", "mount", url, "--yes", "--json"]) == 0
    mounted = said(capsys)[0]
    assert abs(mounted["zero"]["force_n"]) < 20
    assert main(["rig", "mount", url]) == 1
    assert "no terminal" in said(capsys)[1], "nobody can be asked"
    assert main(["rig", "remove", url, "--yes", "--tare", "tare.json"]) == 0


def test_a_crawl_is_stored_with_its_result_and_a_specimen_is_not_weighed(
    url: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["rig", "crawl", url, "-o", "crawl", "--cycles", "1", "--amplitude", "0.004", "--json"]) == 0
    found, _ = said(capsys)
    assert found == json.loads(Path("crawl/crawl.json").read_text())
    assert read_run("crawl/crawl.h5").status == "complete"
    assert 0 < found["friction_n"]["value"] < 200
    assert main(["rig", "weigh", url, "-o", "weigh"]) == 1
    assert "\n" not in said(capsys)[1].strip()


def test_run_applies_calibration_and_tare_and_says_what_was_skipped(
    url: str, capsys: pytest.CaptureFixture[str]
) -> None:
    records(Path("good.toml"), days=30)
    records(Path("late.toml"), days=-1)
    Path("plan.toml").write_text(PLAN)
    told = ["--serial", "7", "--fixture", "clevis", "--oil", "ISO VG 32", "--operator", "A", "-o", "runs", "--json"]
    assert main(["run", "plan.toml", "--rig", url, "--calibration", "good.toml", *told]) == 1
    made, err = said(capsys)
    assert "test 'never' was skipped" in err
    assert [one["file"] for one in made] == ["runs/slow.h5", None]
    run = read_run(made[0]["file"])
    assert (run.setup.specimen_serial, run.setup.fixture, run.setup.oil) == ("7", "clevis", "ISO VG 32")
    assert run.setup.calibrations[0].scale == 1.01
    assert run.setup.tare is not None
    assert len(run.events_utc) == len(run.events) > 1
    assert main(["run", "plan.toml", "--rig", url, "--calibration", "late.toml", *told]) == 2
    assert "expired on" in said(capsys)[1]


class Typist(io.StringIO):
    """Standard error, read by somebody who answers each question that they see with the next line."""

    def __init__(self, keyboard: int, monkeypatch: pytest.MonkeyPatch) -> None:
        super().__init__()
        self.keyboard, self.lines, self._monkeypatch = keyboard, list[str](), monkeypatch

    def write(self, text: str) -> int:
        if text and self.lines:
            os.write(self.keyboard, self.lines.pop(0).encode())
        return super().write(text)

    def answers(self, text: str) -> None:
        self._monkeypatch.setattr(sys, "stderr", self)
        self.lines += text.splitlines(keepends=True)


@pytest.fixture
def typist(monkeypatch: pytest.MonkeyPatch) -> Iterator[Typist]:
    keyboard, read = os.openpty()
    typist = Typist(keyboard, monkeypatch)
    with os.fdopen(read) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        yield typist
    os.close(keyboard)


@pytest.fixture
def person(typist: Typist) -> Callable[[str], None]:
    """What somebody at a terminal answers."""
    return typist.answers


def test_what_was_typed_before_a_question_is_shown_does_not_answer_it(typist: Typist) -> None:
    os.write(typist.keyboard, b"y\ny\ny\n")  # an operator who is in a hurry
    typist.answers("no\n")
    with pytest.raises(Declined):
        Terminal().confirm("May it move now?")


def test_a_person_at_the_terminal_confirms_declines_and_reads_a_number(person: Callable[[str], None]) -> None:
    asked = Terminal()
    person("y\n")
    asked.confirm("Ready?")
    for answer in ("n\n", "\n"):
        person(answer)
        with pytest.raises(Declined, match="Ready"):
            asked.confirm("Ready?")
    person("warm\n21,5\n")
    assert asked.number("Temperature of the room", "°C") == 21.5
    person("\n")
    with pytest.raises(Declined, match="no answer"):
        asked.number("Temperature of the room", "°C")


def test_an_expired_calibration_that_a_person_accepts_is_an_event(person: Callable[[str], None]) -> None:
    records(Path("late.toml"), days=-1)
    told = {"serial": "", "fixture": "", "oil": "", "calibration": Path("late.toml"), "tare": None}
    with closing(connect("modbus://127.0.0.1:9")) as transport:  # nothing is sent
        person("y\n")
        [note] = setup_from(Terminal(), transport, **told).notes
        assert "the operator accepted: calibration of force" in note
        person("n\n")
        with pytest.raises(CalibrationExpired):
            setup_from(Terminal(), transport, **told)


def test_a_plan_that_asks_is_refused_where_nobody_can_be_asked(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("plan.toml").write_text(PLAN.replace('step = "tare", readings = 30', 'step = "prompt", text = "Ready?"'))
    assert main(["run", "plan.toml", "--rig", url, "-o", "runs"]) == 2
    assert "no terminal" in said(capsys)[1]
    assert not Path("runs").exists()
