"""What is written reads back; what is damaged is refused in one line and no partly written file remains."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from excitation.design import remake
from excitation.envelope import Envelope, check
from excitation.errors import DesignError, ExcitationError, ExcitationFileError
from excitation.files import READABLE, WRITABLE, read_excitation, write_excitation
from excitation.kinds import Kind
from excitation.plan import Test
from excitation.portable_math import uniform
from excitation.record import read_channel
from excitation.rig import Control, MotionLimits
from excitation.rpc3 import Channel, TimeHistory, read_rpc3, write_rpc3
from excitation.signal import Excitation
from excitation.synthesis import excitation_from_config

MULTISINE: dict[str, Any] = {
    "kind": "multisine",
    "sample_rate": 500.0,
    "period_samples": 700,
    "periods": 2,
    "displacement": {"f_min": 1.0, "f_max": 20.0, "max_displacement": 0.02, "max_velocity": 0.4},
    "current": {"f_min": 1.0, "f_max": 50.0, "min": 0.2, "max": 1.1},
}


def made() -> Excitation:
    return excitation_from_config(MULTISINE)


@st.composite
def excitations(draw: st.DrawFn) -> Excitation:
    samples = draw(st.integers(2, 3000))
    seed = draw(st.integers(0, 9999))
    current = uniform((seed, 1), samples) if draw(st.booleans()) else None
    return Excitation(
        kind=draw(st.sampled_from(list(Kind))),
        sample_rate_hz=draw(st.sampled_from([100.0, 1000.0, 512.5, 44100.0 / 7])),
        period_samples=draw(st.integers(0, samples)),
        displacement_m=draw(st.floats(1e-6, 1.0)) * (uniform((seed, 0), samples) - 0.5),
        current_a=current,
        design=draw(st.dictionaries(st.text(max_size=8), st.integers() | st.text(max_size=200), max_size=4)),
    )


@settings(max_examples=15, deadline=None)
@given(excitations())
@pytest.mark.parametrize("ending", WRITABLE)
def test_every_format_reads_back_what_was_written(ending: str, excitation: Excitation) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"x{ending}"
        write_excitation(path, excitation)
        back = read_excitation(path)
    sixteen_bits = ending in (".drv", ".rsp")
    for wrote, read in (
        (excitation.displacement_m, back.displacement_m),
        (excitation.current_a, back.current_a),
    ):
        assert (wrote is None) == (read is None)
        if wrote is not None and read is not None:
            tolerance = np.abs(wrote).max() / 32767 * 0.5 * (1 + 1e-9) if sixteen_bits else 0.0
            np.testing.assert_allclose(read, wrote, rtol=0, atol=tolerance)
    assert (back.kind, back.period_samples) == (excitation.kind, excitation.period_samples)
    assert back.sample_rate_hz == excitation.sample_rate_hz
    assert back.design == excitation.design


@pytest.mark.parametrize("ending", READABLE)
def test_a_design_is_made_again_from_any_file(ending: str, tmp_path: Path) -> None:
    write_excitation(tmp_path / f"x{ending}", made())
    again = remake(read_excitation(tmp_path / f"x{ending}"))
    assert again.displacement_m.tobytes() == made().displacement_m.tobytes()


def test_the_same_design_gives_the_same_file(tmp_path: Path) -> None:
    for name in ("a.h5", "b.h5", "a.drv", "b.drv", "a.csv", "b.csv"):
        write_excitation(tmp_path / name, made())
    for ending in ("h5", "drv", "csv"):
        assert (tmp_path / f"a.{ending}").read_bytes() == (tmp_path / f"b.{ending}").read_bytes()


def test_the_hdf5_layout_is_the_contracts(tmp_path: Path) -> None:
    write_excitation(tmp_path / "x.h5", made())
    with h5py.File(tmp_path / "x.h5") as file:
        assert file.attrs["format"] == "damper-rig/excitation"
        assert file.attrs["samples"] == 1400
        assert file.attrs["period_samples"] == 700
        assert file.attrs["excitation_kind"] == "multisine"
        assert file.attrs["sample_rate"] == 500.0
        assert file.attrs["coverage"] == pytest.approx(file.attrs["coverage_normalised"] * 99)
        assert file["channels/displacement_command"].attrs["unit"] == "m"
        assert file["channels/current_command"].attrs["unit"] == "A"
        assert file["channels/current_command"].dtype == np.float64


def test_a_spreadsheet_sees_one_header_and_one_line_a_sample(tmp_path: Path) -> None:
    write_excitation(tmp_path / "x.csv", made())
    with (tmp_path / "x.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 1400
    assert float(rows[3]["displacement_command (m)"]) == made().displacement_m[3]
    assert float(rows[3]["time (s)"]) == 3 / 500.0


def test_a_plain_table_is_an_excitation_of_its_own_rate(tmp_path: Path) -> None:
    text = "time (s),displacement_command (m)\n" + "".join(f"{n * 0.002},{0.001 * n}\n" for n in range(10))
    (tmp_path / "own.csv").write_text(text)
    own = read_excitation(tmp_path / "own.csv")
    assert (own.kind, own.sample_rate_hz, own.period_samples) == (Kind.CUSTOM, 500.0, 0)
    with pytest.raises(DesignError, match="no design"):
        remake(own)


def broken(change: Any) -> Any:
    def write(path: Path) -> None:
        write_excitation(path, made())
        with h5py.File(path, "r+") as file:
            change(file)

    return write


def put(file: h5py.File, name: str, values: NDArray[np.float64], unit: str) -> None:
    del file[f"channels/{name}"]
    file[f"channels/{name}"] = values
    file[f"channels/{name}"].attrs["unit"] = unit


def with_nan(file: h5py.File) -> None:
    file["channels/displacement_command"][17] = np.nan


BROKEN: dict[str, tuple[Any, str]] = {
    "format": (broken(lambda f: f.attrs.modify("format", "other")), "format is 'other'"),
    "version": (broken(lambda f: f.attrs.modify("format_version", 9)), "format_version is 9"),
    "missing": (broken(lambda f: f.__delitem__("channels/displacement_command")), "displacement_command is missing"),
    "short": (broken(lambda f: put(f, "current_command", np.zeros(3), "A")), "current_command has 3 samples"),
    "unit": (broken(lambda f: put(f, "current_command", np.zeros(1400), "mA")), "unit 'mA'"),
    "nan": (broken(with_nan), "displacement_command, sample 17 is nan"),
    "kind": (broken(lambda f: f.attrs.modify("excitation_kind", "noise")), "noise"),
    "rate": (broken(lambda f: f.attrs.modify("sample_rate", -1.0)), "sample_rate is -1"),
    "design": (broken(lambda f: f.attrs.modify("design", "{")), "design is not JSON"),
    "foreign": (lambda path: path.write_bytes(b"no HDF5"), "not an HDF5 file"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_damaged_file_is_refused_in_one_line_that_names_it(fault: str, tmp_path: Path) -> None:
    write, expected = BROKEN[fault]
    write(tmp_path / "bad.h5")
    with pytest.raises(ExcitationFileError) as refused:
        read_excitation(tmp_path / "bad.h5")
    assert "bad.h5" in str(refused.value)
    assert expected in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("a.csv", b"x,y\n1,2\n", "no column 'time (s)'"),
        ("a.csv", b"time (s),displacement_command (m)\n0,1\n0.1,abc\n", "line 3"),
        ("a.csv", b"time (s),displacement_command (m)\n0,1\n0.1,1\n0.3,2\n", "does not rise evenly"),
        ("a.csv", b"time (s),displacement_command (m)\n\xff\n", "not UTF-8"),
        ("a.mat", b"nothing", "a.mat"),
        ("a.drv", b"nothing", "no RPC III file"),
        ("a.xyz", b"", "ending '.xyz' is not known"),
        ("none.h5", None, "no such file"),
    ],
)
def test_a_foreign_file_is_refused_in_one_line(name: str, content: bytes | None, expected: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ExcitationError) as refused:
        read_excitation(tmp_path / name)
    assert expected in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("ending", WRITABLE)
def test_what_cannot_be_written_leaves_nothing_behind(ending: str, tmp_path: Path) -> None:
    with pytest.raises(ExcitationFileError):
        write_excitation(tmp_path / "missing" / f"x{ending}", made())
    (tmp_path / f"x{ending}").mkdir()
    with pytest.raises(ExcitationFileError):
        write_excitation(tmp_path / f"x{ending}", made())
    assert [p.name for p in tmp_path.iterdir()] == [f"x{ending}"]


def records(content: bytes) -> list[tuple[str, str]]:
    blocks = int(content[128 + 32 : 256].rstrip(b"\0"))
    cut = [content[k : k + 128] for k in range(0, 512 * blocks, 128)]
    return [(r[:32].rstrip(b"\0").decode(), r[32:].rstrip(b"\0").decode()) for r in cut if r[:1] != b"\0"]


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 5000), st.integers(1, 4), st.integers(0, 999))
def test_rpc3_keeps_to_blocks_of_512_bytes_and_the_true_number_of_samples(
    samples: int, channels: int, seed: int
) -> None:
    history = TimeHistory(
        sample_rate_hz=204.8,
        channels=tuple(
            Channel(name=f"c{n}", unit="mm", values=10.0**n * (uniform((seed, n), samples) - 0.3))
            for n in range(channels)
        ),
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "x.drv"
        write_rpc3(path, history)
        content, back = path.read_bytes(), read_rpc3(path)
    header = records(content)
    assert [key for key, _ in header[:3]] == ["FORMAT", "NUM_HEADER_BLOCKS", "NUM_PARAMS"]
    assert dict(header)["NUM_PARAMS"] == str(len(header))
    assert dict(header)["DAMPER_RIG.SAMPLES"] == str(samples)
    assert len(content) % 512 == 0
    assert back.sample_rate_hz == 204.8
    for wrote, read in zip(history.channels, back.channels, strict=True):
        assert (read.name, read.unit, read.values.size) == (wrote.name, wrote.unit, samples)
        step = np.abs(wrote.values).max() / 32767
        np.testing.assert_allclose(read.values, wrote.values, rtol=0, atol=0.5 * step * (1 + 1e-9))


def rpc3_of_another_writer(path: Path, kind: str, full_scale: int, frames_per_group: int) -> NDArray[np.float64]:
    """Two channels, as other programs write them: groups of several frames, floats or integers,
    millimetres.
    """
    frame, groups = 256, 3
    points = frame * frames_per_group
    raw = np.arange(groups * 2 * points).reshape(groups, 2, points) % 1000 - 500
    keys = {
        "FORMAT": "BINARY",
        "NUM_HEADER_BLOCKS": "5",
        "NUM_PARAMS": "20",
        "FILE_TYPE": "TIME_HISTORY",
        "TIME_TYPE": "RESPONSE",
        "DELTA_T": "4.882813E-03",
        "CHANNELS": "2",
        "PTS_PER_FRAME": str(frame),
        "PTS_PER_GROUP": str(points),
        "FRAMES": str(groups * frames_per_group),
        "DATA_TYPE": kind,
        "INT_FULL_SCALE": str(full_scale),
        "DESC.CHAN_1": "Load",
        "UNITS.CHAN_1": "kN",
        "SCALE.CHAN_1": "1.000000E-03",
        "DESC.CHAN_2": "Stroke",
        "UNITS.CHAN_2": "mm",
        "SCALE.CHAN_2": "2.500000E-02",
    }
    header = b"".join(k.encode().ljust(32, b"\0") + v.encode().ljust(96, b"\0") for k, v in keys.items())
    dtype = "<i2" if kind == "SHORT_INTEGER" else "<f4"
    path.write_bytes(header.ljust(5 * 512, b"\0") + raw.astype(dtype).tobytes())
    stroke = raw[:, 1].reshape(-1).astype(float)
    return stroke * (0.025 * full_scale / 32768 if kind == "SHORT_INTEGER" else 1.0)


@pytest.mark.parametrize("kind", ["SHORT_INTEGER", "FLOATING_POINT"])
@pytest.mark.parametrize("full_scale", [32768, 32752])
@pytest.mark.parametrize("frames_per_group", [1, 4])
def test_rpc3_of_other_writers_is_read(kind: str, full_scale: int, frames_per_group: int, tmp_path: Path) -> None:
    stroke_mm = rpc3_of_another_writer(tmp_path / "x.rsp", kind, full_scale, frames_per_group)
    read = read_excitation(tmp_path / "x.rsp")
    np.testing.assert_allclose(read.displacement_m, 1e-3 * stroke_mm, rtol=1e-6, atol=1e-12)
    assert read.sample_rate_hz == pytest.approx(204.8)
    assert read.current_a is None


def test_a_cut_rpc3_file_is_refused(tmp_path: Path) -> None:
    write_excitation(tmp_path / "x.drv", made())
    whole = (tmp_path / "x.drv").read_bytes()
    (tmp_path / "x.drv").write_bytes(whole[:-700])
    with pytest.raises(ExcitationFileError, match="cut off"):
        read_excitation(tmp_path / "x.drv")
    (tmp_path / "x.drv").write_bytes(whole.replace(b"SHORT_INTEGER", b"LONG_INTEGER\0"))
    with pytest.raises(ExcitationFileError, match="DATA_TYPE"):
        read_excitation(tmp_path / "x.drv")


@settings(max_examples=40, deadline=None)
@given(st.data())
@pytest.mark.parametrize("ending", READABLE)
def test_whatever_happens_to_its_bytes_a_file_reads_or_is_refused_in_one_line(ending: str, data: st.DataObject) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"x{ending}"
        # flipped bytes crash the HDF5 library itself now and then: such a file is only cut off here
        path.write_bytes(_damaged(WHOLE[ending], data, flips=0 if ending == ".h5" else 6))
        assert "\n" not in _refusal(path)


def _refusal(path: Path) -> str:
    try:
        read_excitation(path)
    except ExcitationError as error:
        return str(error)
    return ""


def _whole(ending: str) -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"x{ending}"
        write_excitation(path, excitation_from_config({**MULTISINE, "period_samples": 100, "periods": 1}))
        return path.read_bytes()


WHOLE = {ending: _whole(ending) for ending in READABLE}


def _damaged(content: bytes, data: st.DataObject, flips: int) -> bytes:
    changed = bytearray(content)
    for _ in range(data.draw(st.integers(0, flips))):
        changed[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    return bytes(changed[: data.draw(st.integers(0, len(content)))]) if data.draw(st.booleans()) else bytes(changed)


def rpc3_padded(path: Path, samples: int, pad: str, more: dict[str, str] | None = None) -> NDArray[np.float64]:
    """One channel of ``samples`` points of a sine of 1.2 mm, as another program writes it, to whole frames of 256."""
    raw = np.rint(20_000 * np.cos(2 * np.pi * np.arange(samples) / 100)).astype(int)
    frames = -(-samples // 256)
    fill = np.full(frames * 256 - samples, raw[-1] if pad == "held" else 0)
    keys = {
        "FORMAT": "BINARY_IEEE_LITTLE_END", "NUM_HEADER_BLOCKS": "5", "NUM_PARAMS": "14", "FILE_TYPE": "TIME_HISTORY",
        "TIME_TYPE": "DRIVE", "DELTA_T": "1.0E-03", "CHANNELS": "1", "PTS_PER_FRAME": "256", "PTS_PER_GROUP": "256",
        "FRAMES": str(frames), "DATA_TYPE": "SHORT_INTEGER", "INT_FULL_SCALE": "32768", "UNITS.CHAN_1": "mm",
        "SCALE.CHAN_1": "6.0E-05", **(more or {}),
    }  # fmt: skip
    header = b"".join(k.encode().ljust(32, b"\0") + v.encode().ljust(96, b"\0") for k, v in keys.items())
    path.write_bytes(header.ljust(5 * 512, b"\0") + np.concatenate([raw, fill]).astype("<i2").tobytes())
    return 6e-8 * raw


@pytest.mark.parametrize("pad", ["zero", "held"])
@pytest.mark.parametrize("samples", [1000, 1001, 930])
def test_the_padding_of_the_last_frame_is_not_played(samples: int, pad: str, tmp_path: Path) -> None:
    meant = rpc3_padded(tmp_path / "x.drv", samples, pad)
    read = read_excitation(tmp_path / "x.drv")
    np.testing.assert_allclose(read.displacement_m, meant, atol=1e-15)
    assert read.figures["padding_left_out"] == 1024 - samples


def test_a_last_frame_that_is_full_or_rests_at_zero_without_a_step_loses_no_motion(tmp_path: Path) -> None:
    meant = rpc3_padded(tmp_path / "x.drv", 1024, "zero")
    np.testing.assert_allclose(read_excitation(tmp_path / "x.drv").displacement_m, meant, atol=1e-15)
    meant = rpc3_padded(tmp_path / "x.drv", 926, "zero")  # ends where the sine passes zero
    read = read_excitation(tmp_path / "x.drv")
    assert np.abs(np.diff(read.displacement_m)).max() <= np.abs(np.diff(meant)).max() * 1.01


@pytest.mark.parametrize("keyword", ["SAMPLES", "ACME.SAMPLES", "NUM_SAMPLES", "acme.Total_Samples", "SAMPLES.CHAN_1"])
def test_the_samples_that_another_writer_states_are_all(keyword: str, tmp_path: Path) -> None:
    meant = rpc3_padded(tmp_path / "x.drv", 1000, "zero", {keyword: "1000"})
    np.testing.assert_allclose(read_excitation(tmp_path / "x.drv").displacement_m, meant, atol=1e-15)
    rpc3_padded(tmp_path / "x.drv", 1000, "zero", {keyword: "2000"})
    with pytest.raises(ExcitationFileError, match="'2000': the data hold 1024 samples"):
        read_excitation(tmp_path / "x.drv")


@pytest.mark.parametrize(
    ("full_scale", "limit", "factor"),
    [(32752, 1.2, 1.0), (32752, 1.2 * 32752 / 32768, 32752 / 32768), (32752, 5.0, 32752 / 32768), (32768, 5.0, 1.0)],
)
def test_both_conventions_of_full_scale_are_told_apart_by_the_limits(
    full_scale: int, limit: float, factor: float, tmp_path: Path
) -> None:
    more = {"INT_FULL_SCALE": str(full_scale), "LOWER_LIMIT.CHAN_1": str(-limit), "UPPER_LIMIT.CHAN_1": str(limit)}
    meant = rpc3_padded(tmp_path / "x.drv", 1024, "zero", more)
    read = read_excitation(tmp_path / "x.drv")
    np.testing.assert_allclose(read.displacement_m, factor * meant, rtol=1e-12, atol=1e-18)
    assert ("scaling" in read.figures) == (full_scale != 32768)


@pytest.mark.parametrize("pad", ["zero", "held"])
def test_padding_of_a_group_of_several_frames_is_not_played(pad: str, tmp_path: Path) -> None:
    """1000 of 1280 samples: four frames are full of signal or padding, all five are stated."""
    more = {"PTS_PER_GROUP": "1280", "FRAMES": "5"}
    meant = rpc3_padded(tmp_path / "x.drv", 1000, pad, more)
    fill = np.full(256, np.rint(meant[-1] / 6e-8) if pad == "held" else 0).astype("<i2")
    with (tmp_path / "x.drv").open("ab") as file:
        file.write(fill.tobytes())
    np.testing.assert_allclose(read_excitation(tmp_path / "x.drv").displacement_m, meant, atol=1e-15)


@pytest.mark.parametrize(("full_scale", "factor"), [(20000, 20000 / 32768), (2047, 2047 / 32768), (16384, 0.5)])
def test_integers_beyond_the_full_scale_say_that_it_is_a_factor(full_scale: int, factor: float, tmp_path: Path) -> None:
    meant = rpc3_padded(tmp_path / "x.drv", 1024, "zero", {"INT_FULL_SCALE": str(full_scale)})
    np.testing.assert_allclose(read_excitation(tmp_path / "x.drv").displacement_m, factor * meant, atol=1e-15)


def test_integers_of_a_converter_of_12_bits_are_its_counts(tmp_path: Path) -> None:
    header = rpc3_padded(tmp_path / "x.drv", 1024, "zero", {"INT_FULL_SCALE": "2047"})
    counts = np.rint(header / header.max() * 2047)
    content = (tmp_path / "x.drv").read_bytes()[: 5 * 512] + counts.astype("<i2").tobytes()
    (tmp_path / "x.drv").write_bytes(content)
    read = read_excitation(tmp_path / "x.drv")
    np.testing.assert_allclose(read.displacement_m, 6e-8 * counts, atol=1e-15)
    assert "no integer is beyond INT_FULL_SCALE 2047" in str(read.figures["scaling"])


@pytest.mark.parametrize(("unit", "factor"), [("MM", 1.0), ("IN", 25.4), ("CM", 10.0)])
def test_units_in_capitals_are_those_in_small_letters(unit: str, factor: float, tmp_path: Path) -> None:
    meant = rpc3_padded(tmp_path / "x.drv", 1024, "zero", {"UNITS.CHAN_1": unit})
    np.testing.assert_allclose(read_excitation(tmp_path / "x.drv").displacement_m, factor * meant, atol=1e-15)
    assert read_channel(tmp_path / "x.drv", "channel 1", "m")[0] == pytest.approx(factor * meant)


@pytest.mark.parametrize(("keyword", "value"), [("FORMAT", "ASCII"), ("FILE_TYPE", "HISTOGRAM")])
def test_what_is_no_binary_time_history_is_refused(keyword: str, value: str, tmp_path: Path) -> None:
    rpc3_padded(tmp_path / "x.drv", 1000, "zero", {keyword: value})
    with pytest.raises(ExcitationFileError, match=f"{keyword} is '{value}'.*can be read"):
        read_excitation(tmp_path / "x.drv")


@pytest.mark.parametrize("ending", [".drv", ".rsp"])
def test_a_file_of_ours_in_16_bits_fits_the_rig_that_its_design_fits(ending: str, tmp_path: Path) -> None:
    limits = MotionLimits(
        max_displacement_m=0.021, max_velocity_m_s=0.41, max_acceleration_m_s2=43.0, bandwidth_hz=25.0
    )
    rig = Envelope(motion=limits, control=Control(min_current_a=0.2, max_current_a=1.1))
    check(Test(name="made", excitation=made()), rig)
    write_excitation(tmp_path / f"x{ending}", made())
    read = read_excitation(tmp_path / f"x{ending}")
    check(Test(name="read", excitation=read), rig)
    assert read.displacement_m.tobytes() == made().displacement_m.tobytes()


def test_samples_that_another_program_changed_are_those_that_are_read(tmp_path: Path) -> None:
    changed = replace(made(), displacement_m=1.001 * made().displacement_m)
    write_excitation(tmp_path / "x.drv", changed)
    read = read_excitation(tmp_path / "x.drv")
    np.testing.assert_allclose(read.displacement_m, changed.displacement_m, atol=1e-6)


Channels = tuple[NDArray[np.float64], NDArray[np.float64] | None]


def _as_excitation(path: Path) -> Channels:
    read = read_excitation(path)
    return read.displacement_m, read.current_a


def _as_record(path: Path) -> Channels:
    return read_channel(path, "displacement_command", "m")[0], None


@pytest.mark.parametrize("current", [None, 0.123456])
def test_a_csv_that_was_cut_off_anywhere_is_refused_or_whole(current: float | None, tmp_path: Path) -> None:
    sine = {"kind": "sine", "sample_rate": 500.0, "amplitude": 0.01, "frequency": 7.3, "cycles": 4, "current": current}
    whole = excitation_from_config({key: value for key, value in sine.items() if value is not None})
    write_excitation(tmp_path / "x.csv", whole)
    content = (tmp_path / "x.csv").read_bytes()
    for size in range(len(content) - 120, len(content)):
        (tmp_path / "x.csv").write_bytes(content[:size])
        for read in (_as_excitation, _as_record):
            try:
                displacement, held = read(tmp_path / "x.csv")
            except ExcitationError as refused:
                assert "\n" not in str(refused)  # noqa: PT017 - what is whole is as good
                continue
            assert displacement.tobytes() == whole.displacement_m.tobytes()
            assert held is None or held.tobytes() == whole.current_a.tobytes()  # type: ignore[union-attr]


def test_a_csv_that_was_cut_off_is_refused(tmp_path: Path) -> None:
    write_excitation(tmp_path / "x.csv", made())
    lines = (tmp_path / "x.csv").read_text().splitlines(keepends=True)
    (tmp_path / "x.csv").write_text("".join(lines[:-300]))
    with pytest.raises(ExcitationFileError, match="1100 samples: line 2 says samples = 1400"):
        read_excitation(tmp_path / "x.csv")
