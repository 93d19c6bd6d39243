"""The commands at the rig: bad input is one line and moves nothing; faults and iterations from the command line."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from api.cli.main import main
from excitation.files import read_excitation
from rigctl.address import connect
from rigctl.runfile import read_run
from tests.api.rigs import a_sim, said_in_one_line

NOWHERE = ("--rig", "modbus://127.0.0.1:9", "-o", "o")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "road.h5", "--rig", "modbus:/1", "-o", "o"], ["modbus:/1", "modbus://HOST:PORT"]),
        (["run", "road.h5", "--rig", "can://telepathy/1", "-o", "o"], ["telepathy", "loopback"]),
        (["run", "road.h5", "--rig", "can://loopback/x?fd=maybe", "-o", "o"], ["maybe", "true or false"]),
        (["iterate", "road.h5", "--rig", "ftp://x", "-o", "o"], ["ftp://x", "modbus://HOST:PORT"]),
        (["iterate", "absent.h5", "--rig", "modbus://127.0.0.1:9", "-o", "o"], ["absent.h5"]),
        (["iterate", "road.h5", "--rig", "modbus://127.0.0.1:9", "-o", "o", "--gain", "0"], ["gain is 0"]),
        (["iterate", "road.h5", "--rig", "modbus://127.0.0.1:9", "-o", "o", "--bandwidth", "-3"], ["bandwidth is -3"]),
        (["iterate", "road.h5", "--rig", "modbus://127.0.0.1:9", "-o", "o", "--iterations", "0"], ["iterations is 0"]),
        (
            ["iterate", "road.h5", *NOWHERE, "--interlock", "force:1:2:panic"],
            ["force:1:2:panic"],
        ),
        (["iterate", "road.h5", *NOWHERE, "--from", "absent.drive.h5"], ["absent.drive.h5", "no such file"]),
        (["iterate", "road.h5", *NOWHERE, "--from", "road.h5"], ["road.h5", "no stored drive"]),
        (["run", "road.h5", "--rig", "modbus://127.0.0.1:9", "-o", "o", "--ramp", "0"], ["ramp is 0"]),
        (["run", "road.h5", "--rig", "modbus://127.0.0.1:9", "-o", "o", "--settle", "nan"], ["settle is nan"]),
        (["sim", "--listen", "can://telepathy/1"], ["telepathy", "loopback"]),
        (["sim", "--listen", "modbus://127.0.0.1:0", "--specimen", "sofa"], ["sofa", "semi-active"]),
        (["sim", "--listen", "modbus://127.0.0.1:0", "--fault", "fire"], ["fire", "emergency_stop"]),
        (["sim", "--listen", "modbus://127.0.0.1:0", "--fault", "lost:3"], ["lost:3", "from 0 to 1"]),
        (["sim", "--listen", "modbus://127.0.0.1:0", "--speed", "0"], ["speed is 0"]),
        (["sim", "--listen", "modbus://127.0.0.1:0", "--seed", "-1"], ["seed is -1"]),
    ],
)
def test_bad_input_is_one_line_and_status_2(
    road: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: list[str]
) -> None:
    status = main(arguments)
    line = said_in_one_line(capsys)
    assert status == 2, line
    assert all(word in line for word in words), line
    assert [path.name for path in road.iterdir()] == ["road.h5"]


@pytest.mark.parametrize("url", ["modbus://127.0.0.1:0", "can://loopback/fault-{}?fd=true"])
def test_a_fault_that_was_ordered_is_read_by_the_operator_and_by_the_file(
    road: Path, capsys: pytest.CaptureFixture[str], url: str
) -> None:
    with a_sim(url, "--fault", "emergency_stop@1.5", "--speed", "1") as rig:
        assert main(["run", "road.h5", "--rig", rig, "-o", "runs"]) == 1
    line = capsys.readouterr().err
    assert "the emergency stop was pressed" in line
    assert line.count("\n") == 1
    run = read_run(road / "runs" / "road.h5")
    assert run.status == "aborted"
    assert 0 < run.samples < 3000
    assert "emergency stop" in run.events[-1][1]


MISCHIEF = ("lost:0.004", "delayed:0.004", "doubled:0.02", "reordered:0.004", "corrupted:0.004")


OTHER_WIRES = ("can://loopback/wild-{}", "can://loopback/wild-{}?fd=true")


@pytest.mark.parametrize(
    "url", ["modbus://127.0.0.1:0", *(pytest.param(u, marks=pytest.mark.slow) for u in OTHER_WIRES)]
)
def test_over_a_wire_that_does_everything_wrong_a_run_is_whole(road: Path, url: str) -> None:
    share = 0.1 if url.endswith("{}") else 1.0  # a block of classic CAN is 257 frames, of which all must arrive
    orders = [f"{name}:{float(value) * share:g}" for name, value in (order.split(":") for order in MISCHIEF)]
    with a_sim(url, "--speed", "1", "--fault", *orders) as rig:
        assert main(["run", "road.h5", "--rig", rig, "-o", "runs"]) == 0
    run = read_run(road / "runs" / "road.h5")
    assert (run.status, run.samples) == ("complete", 3000)
    np.testing.assert_array_equal(
        run.channels["displacement_command"], read_excitation(road / "road.h5").displacement_m
    )
    error = run.channels["displacement"] - run.channels["displacement_command"]
    assert np.std(error) < 0.2 * np.std(run.channels["displacement_command"])


@pytest.mark.slow
def test_iterate_stores_drive_chart_and_runs_and_says_what_came_of_it(
    road: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with a_sim("modbus://127.0.0.1:0", "--speed", "50") as rig:
        assert main(["iterate", "road.h5", "--rig", rig, "-o", "out", "--json"]) == 0
        [told] = json.loads(capsys.readouterr().out)
        assert main(["run", told["drive"], "--rig", rig, "-o", "again"]) == 0
        capsys.readouterr()
        again = ["iterate", "road.h5", "--rig", rig, "-o", "out2", "--from", told["drive"], "--motion-only", "--json"]
        assert main(again) == 0
        [continued] = json.loads(capsys.readouterr().out)
        stopped = ["iterate", "road.h5", "--rig", rig, "-o", "out3", "--interlock", "force:-50:50:stop:0.005"]
        assert main(stopped) == 1
        assert "interlock: force outside -50 … 50: stop" in said_in_one_line(capsys)
    assert len(continued["errors"]) == 1, "the stored drive is good"
    assert continued["errors"][0] < 0.01
    with a_sim("modbus://127.0.0.1:0", "--speed", "50", "--seed", "7") as another:
        assert main(["iterate", "road.h5", "--rig", another, "-o", "out4", "--from", told["drive"]]) == 2
        assert "made on the rig 'damper-rig sim_rig 1', this one is 'damper-rig sim_rig 7'" in said_in_one_line(capsys)
    assert not (road / "out4").exists()
    assert (told["test"], told["outcome"]) == ("road", "converged")
    assert told["errors"][0] > 0.02 > 0.01 >= told["errors"][-1]
    assert {path.name for path in (road / "out").iterdir()} == {
        "road.drive.h5",
        "road.convergence.html",
        *(f"road_iteration_{k}.h5" for k in range(len(told["errors"]))),
    }
    target = read_excitation(road / "road.h5").displacement_m
    run = read_run(road / "again" / "road.drive.h5")
    assert np.std(run.channels["displacement"] - target) < 0.012 * np.std(target)


def test_iterate_that_does_not_get_there_ends_with_1_and_keeps_the_best(
    road: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with a_sim("modbus://127.0.0.1:0", "--speed", "50") as rig:
        arguments = ["iterate", "road.h5", "--rig", rig, "-o", "out", "--tolerance", "0.0001", "--iterations", "1"]
        arguments += ["--cool-to", "29"]
        assert main(arguments) == 1
    assert "not converged" in capsys.readouterr().out
    assert (road / "out" / "road.drive.h5").is_file()


def test_ctrl_z_holds_and_ctrl_z_again_resumes_and_no_sample_is_lost(road: Path) -> None:
    with a_sim("modbus://127.0.0.1:0", "--speed", "1") as rig:
        command = [sys.executable, "-m", "api.cli", "run", "road.h5", "--rig", rig, "-o", "runs", "--json"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process, closing(connect(rig)) as wire:
            # 300 of 3000 samples in real time: the hold must come before their end.
            _until(lambda: wire.status(2.0).consumed > 300)
            process.send_signal(signal.SIGTSTP)
            _until(lambda: (s := wire.status(2.0)).state.name == "HOLD" and s.arrived)
            process.send_signal(signal.SIGTSTP)
            said, _ = process.communicate(timeout=90)
            assert process.returncode == 0
    run = read_run(road / json.loads(said)[0]["file"])
    assert (run.status, run.samples) == ("complete", 3000)
    texts = [text for _, text in run.events]
    assert "real-time priority" in texts[0]
    assert texts[1:] == ["hold", "resumed"]
    assert np.std(run.channels["displacement"] - run.channels["displacement_command"]) < 0.2 * np.std(
        run.channels["displacement_command"]
    )


@pytest.mark.slow
def test_ctrl_z_holds_an_iteration_and_ctrl_z_again_resumes_it(road: Path) -> None:
    with a_sim("modbus://127.0.0.1:0", "--speed", "1") as rig:
        command = [sys.executable, "-m", "api.cli", "iterate", "road.h5", "--rig", rig, "-o", "runs", "--json"]
        command += ["--iterations", "1", "--tolerance", "50"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process, closing(connect(rig)) as wire:
            _until(lambda: wire.status(2.0).consumed > 200)
            process.send_signal(signal.SIGTSTP)
            _until(lambda: (s := wire.status(2.0)).state.name == "HOLD" and s.arrived)
            process.send_signal(signal.SIGTSTP)
            said, _ = process.communicate(timeout=90)
            assert process.returncode in (0, 1)
    run = read_run(road / json.loads(said)[0]["runs"][0])
    assert (run.status, run.samples) == ("complete", 3000)
    assert [text for _, text in run.events][1:] == ["hold", "resumed"]


PLAN = """
[warm_up]
name = "warm-up"
kind = "sine"
sample_rate = 1000.0
amplitude = 0.02
frequency = 4.0
cycles = 20
current = 0.5

[[tests]]
name = "warm"
kind = "sine"
sample_rate = 1000.0
amplitude = 0.005
frequency = 4.0
cycles = 2
current = 0.5
min_temperature = {low}
"""


def test_a_plan_warms_the_damper_up_before_its_test_and_records_the_test_only(
    road: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (road / "plan.toml").write_text(PLAN.format(low=31))
    with a_sim("modbus://127.0.0.1:0", "--speed", "50") as rig:
        assert main(["run", "plan.toml", "--rig", rig, "-o", "runs"]) == 0
        assert [path.name for path in (road / "runs").iterdir()] == ["warm.h5"]
        assert np.mean(read_run(road / "runs" / "warm.h5").channels["temperature"]) > 30.9
        capsys.readouterr()
        (road / "cold.toml").write_text(PLAN.format(low=90)[PLAN.index("[[tests]]") :])
        assert main(["run", "cold.toml", "--rig", rig, "-o", "cold"]) == 1
    assert "play a warm-up first" in said_in_one_line(capsys)


def test_an_interlock_of_the_command_line_ends_the_test(road: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with a_sim("modbus://127.0.0.1:0", "--speed", "50") as rig:
        arguments = ["run", "road.h5", "--rig", rig, "-o", "runs", "--interlock"]
        assert main([*arguments, "force:-50:50:stop:0.005"]) == 1
        assert "interlock: force outside -50 … 50: stop" in capsys.readouterr().err
        assert main([*arguments, "force:-50:50:panic"]) == 2
    assert read_run(road / "runs" / "road.h5").status == "aborted"


def _until(true: Callable[[], bool], within_s: float = 90.0) -> None:
    ends = time.monotonic() + within_s
    while not true():
        assert time.monotonic() < ends
        time.sleep(0.02)


def test_a_rig_check_keeps_its_page_and_leaves_the_rig_disabled(road: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with a_sim("modbus://127.0.0.1:0") as url:
        assert main(["rig", "check", url, "--yes", "-o", "protocol.html", "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        with closing(connect(url)) as wire:
            status = wire.status(2.0)
    assert {one["verdict"] for one in found} == {"good", "note"}
    assert found[-1]["part"] == "motion"
    assert "with 1 mm" in (road / "protocol.html").read_text()
    assert (status.state.name, int(status.faults)) == ("DISABLED", 0)


@pytest.mark.parametrize("command", ["run", "iterate"])
def test_a_test_outside_an_envelope_is_refused_before_the_rig_is_spoken_to(
    road: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    (road / "small.toml").write_text('name = "small rig"\n[motion]\nmax_displacement = 0.005\nmax_velocity = 1.0\n')
    nobody = "modbus://127.0.0.1:9"
    assert main([command, "road.h5", "--rig", nobody, "-o", "o", "--envelope", "small.toml"]) == 2
    assert "displacement 0.008 m, the limit is 0.005 m" in said_in_one_line(capsys)
    assert main([command, "road.h5", "--rig", nobody, "-o", "o", "--envelope", "absent.toml"]) == 2
    assert "absent.toml" in said_in_one_line(capsys)
