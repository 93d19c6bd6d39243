"""A record is played as it was measured: its part, about its mean, from rest to rest."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from excitation.errors import DesignError
from excitation.files import write_excitation
from excitation.rpc3 import Channel, TimeHistory, write_rpc3
from excitation.synthesis import excitation_from_config
from tests.excitation.generators import write_record

WIDE = {"max_displacement": 0.1, "max_velocity": 2.0}


def config(path: Path, **more: Any) -> dict[str, Any]:
    return {"kind": "replay", "record": str(path), "channel": "stroke", "bounds": WIDE, **more}


@pytest.fixture
def records(tmp_path: Path) -> dict[str, Path]:
    """The same motion in every format, in millimetres where it may be."""
    made = write_record(tmp_path / "x.h5")
    mm = 1e3 * made.displacement_m
    savemat(tmp_path / "x.mat", {"stroke": mm, "sample_rate": 1000.0})
    write_rpc3(
        tmp_path / "x.rsp",
        TimeHistory(sample_rate_hz=1000.0, channels=(Channel(name="stroke", unit="mm", values=mm),), drive=False),
    )
    with (tmp_path / "x.csv").open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["time (s)", "force (N)", "stroke (mm)"])
        out.writerows([n / 1000.0, 0.0, value] for n, value in enumerate(mm.tolist()))
    return {ending: tmp_path / f"x.{ending}" for ending in ("h5", "mat", "rsp", "csv")}


@pytest.mark.parametrize("ending", ["h5", "mat", "rsp", "csv"])
def test_every_format_plays_the_same_motion(records: dict[str, Path], ending: str) -> None:
    more = {"channel": "displacement_command"} if ending == "h5" else {"unit": "mm"} if ending == "mat" else {}
    made = excitation_from_config(config(records[ending], **more))
    reference = write_record(records["h5"]).displacement_m
    inside = slice(500, -500)
    expected = (reference - reference.mean())[inside]
    np.testing.assert_allclose(made.displacement_m[inside], expected, atol=1e-6 if ending == "rsp" else 1e-12)
    assert made.sample_rate_hz == 1000.0
    assert (made.displacement_m[0], made.displacement_m[-1]) == (0.0, 0.0)


def test_a_part_at_another_rate_is_that_part(records: dict[str, Path]) -> None:
    more = {"channel": "displacement_command", "start": 2.0, "end": 6.0, "sample_rate": 250.0, "scale": -2.0}
    made = excitation_from_config(config(records["h5"], **more))
    part = write_record(records["h5"]).displacement_m[2000:6000]
    expected = -2.0 * (part - part.mean())[::4]
    assert made.samples == 1000
    np.testing.assert_allclose(made.displacement_m[200:800], expected[200:800], atol=2e-4 * np.ptp(expected))


def test_what_lies_above_the_filter_is_gone_and_the_current_is_held(records: dict[str, Path]) -> None:
    more = {"channel": "displacement_command", "f_max": 3.0, "current_channel": "current_command"}
    made = excitation_from_config(config(records["h5"], **more))
    spectrum = np.abs(np.fft.rfft(made.displacement_m))
    frequency = np.arange(spectrum.size) / 8.0
    assert spectrum[frequency > 4.5].max() < 2e-3 * spectrum.max()
    assert made.current_a is not None
    assert made.current_a[2500] == 0.25


def test_the_current_of_a_mat_file_is_played_in_its_unit(tmp_path: Path) -> None:
    made = write_record(tmp_path / "record.h5")
    assert made.current_a is not None
    write_excitation(tmp_path / "own.mat", made)
    own = {"channel": "displacement_command", "current_channel": "current_command"}
    played = excitation_from_config(config(tmp_path / "own.mat", **own))
    assert played.current_a is not None
    assert np.array_equal(played.current_a, made.current_a)
    savemat(tmp_path / "other.mat", {"sample_rate": 1000.0, "x": made.displacement_m, "i": 1e3 * made.current_a})
    other = {"channel": "x", "unit": "m", "current_channel": "i", "current_unit": "mA"}
    again = excitation_from_config(config(tmp_path / "other.mat", **other))
    assert again.current_a == pytest.approx(made.current_a)
    with pytest.raises(DesignError, match="current_unit is 'V': it must be one of A, mA, amp"):
        excitation_from_config(config(tmp_path / "other.mat", **{**other, "current_unit": "V"}))
    with pytest.raises(DesignError, match="channel 'i' has unit ''"):
        excitation_from_config(config(tmp_path / "other.mat", **{**other, "current_unit": ""}))


def test_a_record_that_has_changed_makes_no_design_again(records: dict[str, Path]) -> None:
    made = excitation_from_config(config(records["csv"]))
    assert excitation_from_config(made.design).displacement_m.tobytes() == made.displacement_m.tobytes()
    text = records["csv"].read_text()
    records["csv"].write_text(text.replace("7.999", "7.9990", 1))
    with pytest.raises(DesignError, match="SHA-256 differs"):
        excitation_from_config(made.design)


@pytest.mark.parametrize(
    ("ending", "more", "says"),
    [
        ("csv", {"channel": "nothing"}, "no channel 'nothing'"),
        ("csv", {"channel": "force"}, "has unit 'N': it must be one of m, mm"),
        ("mat", {}, "has unit ''"),
        ("mat", {"unit": "miles"}, "unit is 'miles'"),
        ("csv", {"start": 7.0, "end": 9.0}, "the record lasts 8 s"),
        ("csv", {"start": 7.0, "end": 6.0}, "end is 6 s"),
        ("csv", {"fade": 5.0}, "two of them are longer"),
        ("csv", {"sample_rate": 1e9}, "cannot be brought to it"),
        ("csv", {"scale": 0.0}, "scale is 0"),
        ("csv", {"bounds": {"max_displacement": 0.001, "max_velocity": 1.0}}, "level = "),
        ("csv", {"start": 1e308}, "the record lasts 8 s"),
    ],
)
def test_what_cannot_be_replayed_is_refused_in_one_line(
    records: dict[str, Path], ending: str, more: dict[str, Any], says: str
) -> None:
    with pytest.raises(DesignError, match=says) as refused:
        excitation_from_config(config(records[ending], **more))
    assert "\n" not in str(refused.value)


def test_what_is_no_record_is_refused_in_one_line(tmp_path: Path) -> None:
    for name, content in (("x.h5", b"no"), ("x.mat", b"no"), ("x.rsp", b"no"), ("x.csv", b"\xff"), ("x.txt", b"")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(DesignError, match=name) as refused:
            excitation_from_config(config(tmp_path / name))
        assert "\n" not in str(refused.value)
    with pytest.raises(DesignError, match="no such file"):
        excitation_from_config(config(tmp_path / "nowhere.csv"))
