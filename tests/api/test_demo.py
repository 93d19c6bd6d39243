"""The main job end to end, and its end at any moment."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from api.demo.demonstration import judged
from rigctl.runfile import read_run

COMMAND = [sys.executable, "-m", "api.cli", "demo"]


def descendants(pid: int) -> set[int]:
    """The processes that a process has started and that still run, and theirs. Needs /proc."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rsplit(")", 1)[1].split()
        except (OSError, IndexError):  # it has ended meanwhile
            continue
        if fields[0] != "Z":
            children.setdefault(int(fields[1]), []).append(int(stat.parent.name))
    found: set[int] = set()
    ahead = [pid]
    while ahead:
        more = children.get(ahead.pop(), [])
        found.update(more)
        ahead += more
    return found


def alive(pids: set[int]) -> set[int]:
    found = set()
    for pid in pids:
        with suppress(OSError):  # it has ended
            if ") Z" not in Path(f"/proc/{pid}/stat").read_text():
                found.add(pid)
    return found


@pytest.mark.parametrize(
    ("named", "said"), [((), "not named"), (("end_stop",), "named right"), (("free_play",), "named wrong")]
)
def test_without_a_name_nothing_is_called_named_wrong(named: tuple[str, ...], said: str) -> None:
    assert judged(named, ("end_stop",)) == said


@pytest.mark.slow
def test_the_demo_names_the_hidden_effect_and_leaves_two_reports_and_no_process(tmp_path: Path) -> None:
    before = os.times()
    out = tmp_path / "out"
    with subprocess.Popen(
        [*COMMAND, "-o", out.name, "--effect", "damping_asymmetry", "--seed", "6", "--json"],  # a folder of here
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        answer, messages = process.communicate(timeout=1200)
    assert process.returncode == 0, messages
    after = os.times()  # of processors, of all its processes: other programs may have them
    assert after.children_user + after.children_system - before.children_user - before.children_system < 180.0
    found = json.loads(answer)
    assert found["hidden"] == ["damping_asymmetry"]
    assert found["named_right"]
    assert found["rig"]["gap"]["held_out"]["closed"] > 0.9
    assert found["real"]["gap"]["held_out"]["final"] < 0.5 * found["real"]["gap"]["held_out"]["base_refitted"]
    assert found["real"]["gap"]["train"]["final"] > 2.0 * found["real"]["gap"]["train"]["noise_floor"]
    assert "rms stays" in found["real"]["remainder"]["text"]  # a real damper is in no catalogue
    assert found["rig"]["remainder"]["text"] == ""
    runs = [read_run(path) for path in (out / "runs").glob("*.h5")]
    assert {run.status for run in runs} == {"complete"}
    assert len(runs) == 8
    page = (out / "report.html").read_text()
    assert "damping_asymmetry" in page
    assert "= 0 " not in page  # values that are held at nothing
    for link in ("rig/report.html", "real/report.html"):
        assert link in page
        assert (out / link).is_file()
    assert "\x1b" not in messages  # no colour and no bar in a pipe


MOMENTS = {"the rig starts": "hidden in it", "the service starts": "2  Start", "tests run": "sine 1 Hz"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("moment", "number"), [*((moment, signal.SIGINT) for moment in MOMENTS), ("tests run", signal.SIGTERM)]
)
def test_whenever_the_demo_is_interrupted_everything_ends_and_the_rig_is_safe(
    tmp_path: Path, moment: str, number: signal.Signals
) -> None:
    if not Path("/proc").is_dir():
        pytest.skip("no /proc: what a process has started cannot be seen here")
    out = tmp_path / "out"
    with subprocess.Popen(
        [*COMMAND, "-o", str(out), "--seed", "1"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        started: set[int] = set()
        for line in process.stderr:
            started |= descendants(process.pid)
            if MOMENTS[moment] in line:
                break
        started |= descendants(process.pid)
        os.kill(process.pid, number)
        rest = process.stderr.read()
        assert process.wait(60) == 1
    assert rest.splitlines()[-1] == "damper-rig: interrupted"
    assert "Traceback" not in rest
    assert started
    assert not alive(started)
    assert not list(out.rglob("*.part"))
    for path in out.rglob("*.h5"):
        assert read_run(path).status in ("complete", "aborted")
    assert not (out / "report.html").exists()
    for log in ("sim.log", "service.log"):
        assert not (out / log).exists() or "Traceback" not in (out / log).read_text()


def test_the_demo_changes_no_folder_with_other_things_in_it(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("four years of work")
    ended = subprocess.run([*COMMAND, "-o", str(tmp_path)], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 2
    assert "not empty" in ended.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]
