"""Calibration records, tare and the rest of the preparation travel in the run file and correct what is recorded."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from datetime import date, datetime, timedelta
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excitation.files import read_plan
from rigctl.calibration import Calibration, check_valid, read_calibrations
from rigctl.errors import CalibrationError, CalibrationExpired, ProcedureError, RunFileError
from rigctl.limits import Limits
from rigctl.preparation import Tare, WarmUp, as_json, record_from
from rigctl.priority import streaming_priority
from rigctl.procedures.tare import check_tare
from rigctl.recover import recover
from rigctl.runfile import Run, read_run, write_run
from rigctl.runwriter import RunWriter
from rigctl.setup import Setup, setup_from_json, setup_json
from rigctl.transport import Capability, Identity

CELL = Calibration(
    channel="force",
    sensor="load cell 25 kN",
    serial="LC-1234",
    date="2026-03-01",
    expires="2027-03-01",
    scale=1.002,
    offset=-3.0,
    uncertainty=12.0,
    certificate="D-K-17",
)
TARE = Tare(
    rig="maker model 7",
    measured_at="2026-06-01T08:00:00+00:00",
    offset_n=42.5,
    standard_deviation_n=10.0,
    uncertainty_n=0.8,
    readings=160,
    window_s=2.0,
    limit_n=500.0,
    displacement_m=0.0,
    temperature_degc=23.0,
)
WARM_UP = WarmUp(
    finished_at="2026-06-01T08:10:00+00:00", energy_j=5e3, duration_s=60.0, plays=3, start_degc=21.0, end_degc=35.5
)
SETUP = Setup(
    specimen_serial="7",
    fixture="clevis 12 mm",
    oil="ISO VG 32",
    ambient_degc=22.5,
    calibrations=(CELL,),
    tare=TARE,
    warm_up=WARM_UP,
)
GOLDEN = Path(__file__).parent / "golden" / "run-before-setup.h5"


def an_empty_run(setup: Setup) -> Run:
    return replace(
        read_run(GOLDEN), channels={"force": np.empty(0)}, units={"force": "N"}, events=(), setup=setup, path=None
    )


def written(path: Path, setup: Setup, status: str = "complete") -> RunWriter:
    writer = RunWriter(path, an_empty_run(setup))
    writer.append({"force": np.arange(5.0)})
    writer.event(0.001, "hold")
    writer.event(0.001, "resumed")
    writer.flush()
    if status:
        writer.close(status)
    return writer


@pytest.mark.parametrize("setup", [Setup(), SETUP, replace(SETUP, tare=None), Setup(oil="ISO VG 32")])
def test_the_preparation_travels_in_the_run_file(tmp_path: Path, setup: Setup) -> None:
    written(tmp_path / "a.h5", setup)
    run = read_run(tmp_path / "a.h5")
    assert run.setup == setup
    write_run(tmp_path / "b.h5", run)
    again = read_run(tmp_path / "b.h5")
    assert (again.setup, again.events, again.events_utc) == (setup, run.events, run.events_utc)


def test_every_event_has_a_time_of_day_and_recovery_keeps_it(tmp_path: Path) -> None:
    before = datetime.now().astimezone()
    writer = written(tmp_path / "a.h5", SETUP, status="")
    orphan = tmp_path / "b.h5.part"
    orphan.write_bytes(writer.part.read_bytes())  # as a crash leaves it
    writer.close("complete")
    run = read_run(recover(orphan))
    assert [text for _, text in run.events] == ["hold", "resumed"]
    stamps = [datetime.fromisoformat(text) for text in run.events_utc]
    assert len(stamps) == 2
    assert all(-1 <= (stamp - before).total_seconds() < 60 for stamp in stamps)
    assert (run.setup, run.status) == (SETUP, "truncated")


def test_a_file_of_an_earlier_version_reads_as_before() -> None:
    run = read_run(GOLDEN)
    assert (run.samples, run.status, run.operator) == (60, "complete", "A")
    assert run.events == ((0.02, "hold"), (0.02, "resumed"))
    assert (run.events_utc, run.setup) == ((), Setup())


@pytest.mark.parametrize(
    ("name", "value"),
    [("tare", "not JSON"), ("tare", json.dumps(asdict(TARE) | {"readings": 0})), ("warm_up", "[1]"),
     ("ambient_temperature", "warm"), ("calibration_date", "last spring")],
)  # fmt: skip
def test_a_damaged_preparation_is_refused_in_one_line(tmp_path: Path, name: str, value: str) -> None:
    path = tmp_path / "a.h5"
    written(path, SETUP)
    with h5py.File(path, "r+") as file:
        (file["channels/force"] if name.startswith("calibration") else file).attrs[name] = value
    with pytest.raises(RunFileError, match="preparation") as caught:
        read_run(path)
    assert "\n" not in str(caught.value)


def test_calibration_and_tare_correct_what_is_recorded_and_nothing_else() -> None:
    values = np.random.default_rng(1).normal(size=(7, 5))
    np.testing.assert_array_equal(Setup().corrected(values), values)
    calibrated = Setup(calibrations=(CELL,)).corrected(values)
    np.testing.assert_allclose(calibrated[:, 0], 1.002 * values[:, 0] - 3.0)
    tared = SETUP.corrected(values)
    np.testing.assert_allclose(tared[:, 0], 1.002 * (values[:, 0] - 42.5))
    np.testing.assert_array_equal(tared[:, 1:], values[:, 1:])
    assert Setup(tare=TARE).corrected(np.array([[42.5, 0, 0, 0, 0]]))[0, 0] == 0


TOML = """
format = "damper-rig/calibration"
[[sensors]]
channel = "force"
sensor = "load cell 25 kN"
serial = "LC-1234"
date = 2026-03-01
expires = 2027-03-01
scale = 1.002
offset = -3.0
uncertainty = 12.0
certificate = "D-K-17"
"""


def test_records_are_read_from_toml_and_json(tmp_path: Path) -> None:
    toml, other = tmp_path / "c.toml", tmp_path / "c.json"
    toml.write_text(TOML)
    other.write_text(json.dumps({"sensors": [{k: v for k, v in asdict(CELL).items() if v != ""}]}))
    assert read_calibrations(toml) == read_calibrations(other) == (CELL,)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"force"', '"moment"', "moment"),
        ("2027-03-01", "2026-02-01", "before its date"),
        ("2027-03-01", '"some day"', "some day"),
        ('serial = "LC-1234"', "", "serial is missing"),
        ('"LC-1234"', '" "', "serial"),
        ("scale = 1.002", "scale = 0.0", "scale"),
        ("scale = 1.002", "gain = 1.002", "gain"),
        ("uncertainty = 12.0", "uncertainty = -1.0", "uncertainty"),
        ("[[sensors]]", "[sensors]", "sensors"),
        ("damper-rig/calibration", "damper-rig/run", "damper-rig/run"),
        ("= 2026", "=", "neither valid TOML"),
    ],
)
def test_a_wrong_record_is_refused_in_one_line_that_names_the_file(
    tmp_path: Path, old: str, new: str, says: str
) -> None:
    path = tmp_path / "c.toml"
    path.write_text(TOML.replace(old, new))
    with pytest.raises(CalibrationError, match=says) as caught:
        read_calibrations(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_record_is_valid_on_its_last_day_and_not_after_it() -> None:
    check_valid((CELL,), date(2027, 3, 1))
    with pytest.raises(CalibrationExpired, match=r"LC-1234\) expired on 2027-03-01"):
        check_valid((CELL,), date(2027, 3, 2))
    with pytest.raises(CalibrationError, match="check the clock"):
        check_valid((CELL,), date(2026, 2, 28))


def test_the_examples_of_the_documentation_are_valid(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "laboratory.md").read_text(encoding="utf-8")
    records, plan = (part.partition("```")[0] for part in text.split("```toml\n")[1:])
    (tmp_path / "sensors.toml").write_text(records)
    (tmp_path / "plan.toml").write_text(plan)
    assert read_calibrations(tmp_path / "sensors.toml")[0].channel == "force"
    read = read_plan(tmp_path / "plan.toml")
    assert len(read.tests[0].before) == 4
    assert read.warm_up is not None
    assert read.warm_up.conditions_the_damper


def test_a_setup_is_the_same_after_json() -> None:
    for setup in (Setup(), SETUP, replace(SETUP, tare=None, oil="")):
        assert setup_from_json(json.loads(json.dumps(setup_json(setup)))) == setup


def test_a_tare_of_another_rig_or_of_yesterday_is_refused() -> None:
    rig = Identity(
        map_version=1,
        vendor="maker",
        model="model",
        serial="7",
        channel_count=5,
        sample_rate_min_hz=100.0,
        sample_rate_max_hz=5000.0,
        fifo_samples=4096,
        capture_samples=4096,
        capabilities=Capability.NONE,
        limits=Limits(),
    )
    taken = datetime.fromisoformat(TARE.measured_at)
    check_tare(TARE, rig, taken + timedelta(hours=11))
    with pytest.raises(ProcedureError, match="13 h old"):
        check_tare(TARE, rig, taken + timedelta(hours=13))
    with pytest.raises(ProcedureError, match="belongs to the rig 'maker model 7'"):
        check_tare(TARE, replace(rig, serial="8"), taken)


@pytest.mark.parametrize("change", [{"measured_at": "today"}, {"measured_at": "2026-06-01"}, {"extra": 1}])
def test_a_record_of_a_procedure_must_be_whole(change: dict[str, Any]) -> None:
    assert record_from(Tare, as_json(TARE), "t.json") == TARE
    with pytest.raises(ProcedureError):
        record_from(Tare, as_json(TARE) | change, "t.json")


def test_what_the_system_permits_for_a_stream_is_one_line() -> None:
    with streaming_priority() as first, streaming_priority() as second:
        assert first == second
        assert "real-time priority" in first
        assert "memory" in first
