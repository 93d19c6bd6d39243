"""The run file keeps what it is given and refuses what is wrong, in one line."""

from __future__ import annotations

import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rigctl.errors import RunFileError
from rigctl.recover import recover, recover_directory
from rigctl.runfile import CHANNEL_UNITS, Run, read_run, with_channel, write_run
from rigctl.runwriter import RunWriter, part_path


def a_run(samples: int = 300) -> Run:
    time = np.arange(samples) / 1000.0
    return Run(
        run_id="r-1",
        created="2026-01-02T03:04:05+00:00",
        specimen="semi-active 7",
        sample_rate_hz=1000.0,
        period_samples=100,
        excitation_kind="sine",
        status="complete",
        channels={"displacement": 0.01 * np.sin(60 * time), "force": 900 * np.cos(60 * time)},
        units={"displacement": "m", "force": "N"},
        design={"kind": "sine", "amplitude": 0.01},
        events=((0.1, "grün"), (0.2, "stopped by the operator")),
        test_id="t",
        campaign_id="c",
    )


def names(directory: Path) -> list[str]:
    return sorted(entry.name for entry in directory.iterdir())


def a_plain_file(path: Path, *, text: type = str, samples: int = 5) -> None:
    """A file as another program writes it from the contract alone."""
    with h5py.File(path, "w") as file:
        for name, value in {
            "format": "damper-rig/run",
            "run_id": "x",
            "created": "2026-01-02T03:04:05Z",
            "specimen": "s",
            "excitation_kind": "custom",
            "status": "complete",
        }.items():
            file.attrs[name] = np.bytes_(value) if text is bytes else value
        file.attrs["format_version"] = np.int32(1)
        file.attrs["sample_rate"] = np.float32(500.0)
        file.attrs["samples"] = np.int64(samples)
        file.attrs["period_samples"] = np.uint8(0)
        for name in ("displacement", "force"):
            data = file.create_dataset(f"channels/{name}", data=np.arange(samples, dtype=float))
            data.attrs["unit"] = np.bytes_(CHANNEL_UNITS[name][0]) if text is bytes else CHANNEL_UNITS[name][0]


def refusal(path: Path) -> str:
    with pytest.raises(RunFileError) as caught:
        read_run(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    return message


def test_what_is_written_is_read(tmp_path: Path) -> None:
    write_run(tmp_path / "a.h5", a_run())
    back = read_run(tmp_path / "a.h5")
    for name, values in a_run().channels.items():
        np.testing.assert_array_equal(back.channels[name], values)
    strip = {"channels": {"force": back.channels["force"]}, "units": {"force": "N"}}
    assert repr(replace(back, path=None, **strip)) == repr(replace(a_run(), **strip))  # type: ignore[arg-type]
    assert back.units == a_run().units
    assert names(tmp_path) == ["a.h5"]


@given(
    arrays(np.float64, st.integers(0, 40), elements=st.floats(allow_nan=False, allow_infinity=False)),
    st.floats(1e-3, 1e5),
)
def test_every_finite_sample_comes_back_bit_for_bit(tmp_path_factory, values, rate) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path_factory.mktemp("runs") / "a.h5"
    write_run(path, replace(a_run(), channels={"force": values}, units={"force": "N"}, sample_rate_hz=rate))
    back = read_run(path)
    assert back.channels["force"].tobytes() == values.tobytes()
    assert back.sample_rate_hz == rate


@pytest.mark.parametrize("text", [str, bytes])
def test_a_plain_file_of_another_program_is_read(tmp_path: Path, text: type) -> None:
    a_plain_file(tmp_path / "p.h5", text=text)
    run = read_run(tmp_path / "p.h5")
    assert (run.sample_rate_hz, run.samples, run.units["force"], run.design) == (500.0, 5, "N", None)


def test_a_file_without_optional_parts_and_with_other_channels_is_read(tmp_path: Path) -> None:
    a_plain_file(tmp_path / "p.h5")
    with h5py.File(tmp_path / "p.h5", "r+") as file:
        file.create_dataset("channels/torque_x", data=np.ones(5)).attrs["unit"] = "N*m"
        file.create_dataset("channels/frame_counter", data=np.arange(5)).attrs["unit"] = "1"
    assert read_run(tmp_path / "p.h5").units["torque_x"] == "N·m"


def _set(name: str, value: object):  # type: ignore[no-untyped-def]
    return lambda file: file.attrs.__setitem__(name, value)


def _channel(name: str, values: object, unit: str | None):  # type: ignore[no-untyped-def]
    def change(file: h5py.File) -> None:
        if f"channels/{name}" in file:
            del file[f"channels/{name}"]
        dataset = file.create_dataset(f"channels/{name}", data=values)
        if unit is not None:
            dataset.attrs["unit"] = unit

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_set("format", "something/else"), ["format", "something/else"]),
        (_set("format_version", 2), ["format_version is 2"]),
        (_set("samples", 6), ["displacement", "5 samples", "first bad sample 5"]),
        (_set("samples", "many"), ["samples", "number"]),
        (_set("sample_rate", 0.0), ["sample_rate", "positive"]),
        (_set("status", "fine"), ["status", "fine", "complete"]),
        (_set("created", "yesterday"), ["created", "ISO 8601"]),
        (_set("excitation_kind", "noise"), ["excitation_kind", "multisine"]),
        (lambda file: file.attrs.__delitem__("run_id"), ["run_id", "missing"]),
        (lambda file: file.__delitem__("channels"), ["/channels"]),
        (_channel("force", [1.0, 2.0, np.nan, 4.0, np.inf], "N"), ["force", "sample 2", "nan"]),
        (_channel("force", [1.0, 2.0, 3.0], "N"), ["force", "3 samples", "first bad sample 3"]),
        (_channel("force", np.ones(5), None), ["force", "unit is missing", "N"]),
        (_channel("force", np.ones(5), "kN"), ["force", "kN", "unknown"]),
        (_channel("displacement", np.ones(5), "N"), ["displacement", "'N'", "must be m"]),
        (_channel("extra", np.ones(5), "furlong"), ["extra", "furlong"]),
        (_channel("force", np.ones((5, 2)), "N"), ["force", "1-D array"]),
        (_channel("force", [b"a"] * 5, "N"), ["force", "1-D array of numbers"]),
        (_channel("force/inner", np.ones(5), "N"), ["force"]),
        (lambda file: file.create_group("excitation").attrs.__setitem__("design", "{"), ["design", "JSON"]),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path: Path, change, words) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "w.h5"
    a_plain_file(path)
    with h5py.File(path, "r+") as file:
        if "force/inner" in str(change.__closure__ and [c.cell_contents for c in change.__closure__]):
            del file["channels/force"]
        change(file)
    message = refusal(path)
    for word in words:
        assert word in message


def test_a_damaged_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "d.h5"
    write_run(path, a_run(5000))
    whole = path.read_bytes()
    for keep in (0, 10, 600, len(whole) // 2):
        path.write_bytes(whole[:keep])
        refusal(path)
    path.write_text("time,force\n0,1\n")
    refusal(path)
    refusal(tmp_path / "absent.h5")


def test_a_damaged_block_is_named_with_its_first_sample(tmp_path: Path) -> None:
    path = tmp_path / "d.h5"
    a_plain_file(path, samples=4000)
    with h5py.File(path, "r+") as file:
        del file["channels/force"]
        data = file.create_dataset(
            "channels/force", data=np.random.default_rng(1).normal(size=4000), chunks=(1000,), fletcher32=True
        )
        data.attrs["unit"] = "N"
        where = data.id.get_chunk_info(2).byte_offset
    raw = bytearray(path.read_bytes())
    raw[where + 8] ^= 0xFF
    path.write_bytes(raw)
    assert "force" in refusal(path)
    assert "sample 2000" in refusal(path)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write_run(path, a_run())
    before = path.read_bytes()
    with pytest.raises(TypeError):
        write_run(path, replace(a_run(), design={"no": object()}))
    assert path.read_bytes() == before
    assert names(tmp_path) == ["a.h5"]


def test_with_channel_adds_one_and_keeps_the_rest() -> None:
    run = with_channel(a_run(), "force_simulated", np.zeros(300), "N")
    assert list(run.channels) == ["displacement", "force", "force_simulated"]
    with pytest.raises(RunFileError, match="force_simulated"):
        with_channel(a_run(), "force_simulated", np.zeros(299), "N")


def template() -> Run:
    return replace(a_run(), channels={name: np.empty(0) for name in a_run().channels}, events=())


@given(st.lists(st.integers(0, 260), max_size=12))
def test_blocks_of_any_size_make_the_whole(tmp_path_factory, sizes) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path_factory.mktemp("runs") / "a.h5"
    source = a_run(sum(sizes))
    with RunWriter(path, template(), clock=lambda: 0.0) as writer:
        start = 0
        for size in sizes:
            writer.append({name: values[start : start + size] for name, values in source.channels.items()})
            start += size
        writer.event(0.5, "an event")
        writer.close("complete")
    back = read_run(path)
    assert (back.status, back.samples, back.events) == ("complete", sum(sizes), ((0.5, "an event"),))
    for name, values in source.channels.items():
        np.testing.assert_array_equal(back.channels[name], values)


def test_a_block_left_by_an_exception_closes_as_truncated(tmp_path: Path) -> None:
    def capture() -> None:
        with RunWriter(tmp_path / "a.h5", template()) as writer:
            writer.append(a_run(150).channels)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        capture()
    assert (read_run(tmp_path / "a.h5").status, read_run(tmp_path / "a.h5").samples) == ("truncated", 150)


def test_a_bad_block_is_refused_and_changes_nothing(tmp_path: Path) -> None:
    with RunWriter(tmp_path / "a.h5", template()) as writer:
        writer.append(a_run(150).channels)
        for bad in (
            {"force": np.ones(3)},
            {"force": np.ones(3), "displacement": np.ones(2)},
            {"force": np.array([1.0, np.nan]), "displacement": np.ones(2)},
        ):
            with pytest.raises(RunFileError):
                writer.append(bad)
        writer.close("aborted")
    assert read_run(tmp_path / "a.h5").samples == 150


def test_a_captured_run_is_never_overwritten(tmp_path: Path) -> None:
    write_run(tmp_path / "a.h5", a_run())
    with pytest.raises(RunFileError, match="exists already"):
        RunWriter(tmp_path / "a.h5", template())


def test_a_live_capture_is_readable_and_not_recoverable(tmp_path: Path) -> None:
    with RunWriter(tmp_path / "a.h5", template()) as writer:
        writer.append(a_run(150).channels)
        writer.flush()
        with h5py.File(part_path(tmp_path / "a.h5"), "r", swmr=True) as live:
            assert live["channels/force"].shape == (150,)
        with pytest.raises(RunFileError, match="live process"):
            recover(part_path(tmp_path / "a.h5"))
        writer.close("complete")


KILLED = """
import sys, os, numpy as np
sys.path.insert(0, {tests!r})
from test_runfile import a_run, template
from rigctl.runwriter import RunWriter
writer = RunWriter({path!r}, template(), flush_interval_s=0.0)
for start in range(0, 300_000, 50):
    part = slice(start % 250, start % 250 + 50)
    writer.append({{name: values[part] for name, values in a_run().channels.items()}})
    writer.event(start / 1000, "block")
    print(writer.samples, flush=True)
"""


def test_after_kill_9_every_flushed_sample_is_recovered_and_twice_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "sub" / "k.h5"
    path.parent.mkdir()
    code = KILLED.format(tests=str(Path(__file__).parent), path=str(path))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        acknowledged = 0
        while acknowledged < 2000:
            acknowledged = int(process.stdout.readline())
        process.send_signal(signal.SIGKILL)
    (done,) = recover_directory(tmp_path)
    run = read_run(path)
    assert done.path == path
    assert run.status == "truncated"
    assert run.samples == done.samples >= acknowledged
    sent = a_run().channels["force"][:250]  # what the child appended, again and again
    np.testing.assert_array_equal(run.channels["force"], np.resize(sent, run.samples))
    before = path.read_bytes()
    assert recover_directory(tmp_path) == ()
    assert path.read_bytes() == before
    assert [entry.name for entry in path.parent.iterdir()] == ["k.h5"]


def test_an_orphan_that_cannot_be_read_is_reported_and_kept(tmp_path: Path) -> None:
    (tmp_path / "bad.h5.part").write_bytes(b"not HDF5")
    (result,) = recover_directory(tmp_path)
    assert result.path is None
    assert "bad.h5.part" in result.reason
    assert (tmp_path / "bad.h5.part").exists()
    with pytest.raises(RunFileError, match="no such directory"):
        recover_directory(tmp_path / "absent")


def test_a_long_capture_takes_no_more_memory_than_a_short_one(tmp_path: Path) -> None:
    """Measured in its own process: after a warm-up the memory must not grow with the samples."""
    if not Path("/proc/self/statm").exists():
        pytest.skip("this system does not tell how much memory a process has")
    code = """
import sys
import numpy as np
from pathlib import Path
from dataclasses import replace
from rigctl.runfile import Run
from rigctl.runwriter import RunWriter
pages = lambda: int(Path("/proc/self/statm").read_text().split()[1])
units = {"force": "N", "displacement": "m", "temperature": "degC", "pressure": "Pa"}
template = Run(run_id="x", created="2026-01-01T00:00:00+00:00", specimen="", sample_rate_hz=1000.0, period_samples=0,
    excitation_kind="sine", status="truncated", channels={name: np.empty(0) for name in units}, units=units)
writer = RunWriter(Path(sys.argv[1]), template, flush_interval_s=0.0)
for k in range(600):
    writer.append({name: np.full(1000, float(k)) for name in units})
    if k == 99:
        before = pages()
print(4096 * (pages() - before))
writer.close("complete")
"""
    said = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "long.h5")], capture_output=True, text=True, check=True
    )
    assert int(said.stdout) < 4e6, "16 MB of samples were written meanwhile"
